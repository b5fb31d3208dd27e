"""Integrals on curved elements: against mpmath, composite rules and Duffy's trick; what closed boundaries obey."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import cache
from itertools import product

import mpmath
import numpy as np
import pytest

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.geometry import (
    Algebraic,
    Arc,
    BoundaryMesh,
    Disk,
    ExteriorOf,
    GeometryError,
    Outline,
    ParametricCurve,
    PlateWithHole,
    Ring,
    Sector,
    Segment,
    Side,
    Uniform,
    discretise,
)
from bemkit.geometry.neighbours import corner_nodes
from bemkit.geometry.placement import Placement
from bemkit.operators.boundary import SteklovPoincareOperator
from bemkit.operators.element_geometry import ElementGeometry
from bemkit.operators.integrals.inner import inner_integrals
from bemkit.operators.integrals.pairs import Degrees, PairIntegrals
from bemkit.operators.integrals.sweep import PairSweep
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from tests.operators.collocation_matrices import collocation_matrices
from tests.slow import slow_except, slow_only

DEGREES = Degrees(log=(1, 1), double=(1, 2))
HIGH = Degrees(log=(11, 11), double=(11, 12))
BOTH = pytest.mark.parametrize("degrees", [DEGREES, HIGH], ids=["low degrees", "high degrees"])


def ellipse(a: float, b: float) -> Outline:
    curve = ParametricCurve(
        lambda p: np.column_stack([a * np.cos(2 * np.pi * p), b * np.sin(2 * np.pi * p)]),
        lambda p: 2 * np.pi * np.column_stack([-a * np.sin(2 * np.pi * p), b * np.cos(2 * np.pi * p)]),
    )
    return Outline(((Side("rim", curve),),))


def dome() -> Outline:
    """Return a half disk: arcs and a straight side that meet at right angles."""
    arcs = [Side(f"arc-{k}", Arc((0.0, 0.0), 1.0, k * np.pi / 2, (k + 1) * np.pi / 2)) for k in range(2)]
    return Outline(((*arcs, Side("floor", Segment((-1.0, 0.0), (1.0, 0.0)))),))


MESHES: dict[str, Callable[[], BoundaryMesh]] = {
    "disk of four elements": lambda: discretise(Disk(1.3).outline(), n_elements=4),
    "disk far from the origin": lambda: discretise(Disk(0.5, (3.0, -2.0)).outline(), n_elements=24),
    "ring": lambda: discretise(Ring(0.6, 1.0).outline(), n_elements=32),
    "thin ring": lambda: discretise(Ring(0.999, 1.0).outline(), n_elements=32),
    "plate with hole": lambda: discretise(PlateWithHole(2.0, 1.0, 0.3).outline(), n_elements=36),
    "narrow bridge": lambda: discretise(PlateWithHole(2.0, 1.0, 0.4999).outline(), n_elements=40),
    "dome": lambda: discretise(dome(), n_elements=12),
    "graded dome": lambda: discretise(dome(), n_elements=30, grading=Algebraic(6.0)),
    "ellipse": lambda: discretise(ellipse(2.0, 1.0), n_elements=24),
    "outside of a disk": lambda: discretise(ExteriorOf(Disk(0.7)).outline(), n_elements=16),
}
QUICK = ("narrow bridge", "graded dome", "outside of a disk")


def swept(mesh: BoundaryMesh, degrees: Degrees = DEGREES) -> PairIntegrals:
    return PairSweep(mesh, degrees).chunk(slice(0, mesh.n_elements))


# --- inner integrals, one point and one arc, against extended precision ---

POINTS = [  # parameters of points seen from an arc: next to it on both sides, at and beyond its end, far away
    *[(0.23, 1e-10), (0.23, -1e-3), (0.23, 0.9), (0.23, -0.9)],
    *[(1.0 + 1e-12, 0.0), (1.0, 1e-6), (1.0 + 1e-3, 0.0), (2.5, -1.0), (1.0, -9.0)],
]


legendre = cache(mpmath.legendre)
INTEGRANDS = (  # of the vector d from the arc to the point, and the direction of the arc; times P_b
    lambda d, direction: mpmath.log(abs(d)),
    lambda d, direction: d / mpmath.conj(d),
    lambda d, direction: mpmath.im(direction / d),
)


@pytest.mark.slow
@pytest.mark.parametrize("n_elements", [4, 64])
def test_inner_integrals_against_extended_precision(n_elements: int) -> None:
    geometry = ElementGeometry(discretise(Disk(1.3).outline(), n_elements=n_elements))
    with mpmath.workdps(25):
        bend = mpmath.pi / n_elements
        scale = mpmath.mpc(0, 1) * bend * mpmath.mpf(1.3) * mpmath.expj(bend)
        direction = cache(lambda t: mpmath.expj(bend * t))

        def place(t: mpmath.mpc) -> mpmath.mpc:
            return (direction(t) - 1) / (mpmath.mpc(0, 1) * bend)

        for real, imaginary in POINTS:
            x = place(mpmath.mpc(real, imaginary))
            from_ends = [np.array([complex((x - place(end)) * scale)]) for end in (-1, 1)]
            inner = inner_integrals(geometry, Degrees(log=(0, 12), double=(0, 12)), np.array([0]), *from_ends)
            ends = [-1, real, 1] if -1 < real < 1 else [-1, 1]
            integrands = [cache(lambda t, f=f, x=x: f(x - place(t), direction(t))) for f in INTEGRANDS]
            for b in (1, 12):
                # the arc is known to the round-off of its coordinates, eps R / half length = eps n / pi; next to
                # an end P_b, whose slope is b (b + 1) / 2 there, magnifies the round-off of the parameter
                tolerance = 2e-15 * (n_elements + 10 + b * (b + 1) / 2)
                log, quotient, angle = (
                    mpmath.quad(lambda t, f=f, b=b: legendre(b, t) * f(t), ends) for f in integrands
                )
                assert inner.log[b][0] == pytest.approx(float(log), abs=tolerance)
                assert inner.quotient[b][0] == pytest.approx(complex(quotient), abs=tolerance)
                assert inner.double[b][0] == pytest.approx(float(angle), abs=tolerance)


# --- pairs of elements against rules that know nothing of the method ---


def trace(mesh: BoundaryMesh, element: int, xi: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return points and derivatives dx/dxi of an element as complex numbers."""
    unit = np.array([1.0, 1j])
    elements = np.array([element])
    return mesh.points(elements, xi)[0] @ unit, mesh.derivatives(elements, xi)[0] @ unit


def summed(
    degrees: Degrees, mesh: BoundaryMesh, i: int, j: int, xi: FloatArray, t: FloatArray, weight: FloatArray
) -> PairIntegrals:
    """Sum the integrands over points (xi, t) of the square."""
    (x, dx), (y, dy) = trace(mesh, i, xi), trace(mesh, j, t)
    rho = x - y
    measure = weight * np.abs(dx) * np.abs(dy)
    result = PairIntegrals.zeros(degrees, ())
    n_test, n_trial = result.double.shape
    p_xi, p_t = np.polynomial.legendre.legvander(xi, n_test - 1), np.polynomial.legendre.legvander(t, n_trial - 1)
    for a, b in np.ndindex(n_test, n_trial):
        density = measure * p_xi[:, a] * p_t[:, b]
        if b < n_trial - 1:
            result.log[a, b] = np.sum(density * np.log(np.abs(rho)))
            result.quotient[a, b] = np.sum(density * rho / rho.conj())
        result.double[a, b] = np.sum(density * (dy / rho).imag / np.abs(dy)) / (2 * np.pi)
    return result


def check_pair(mesh: BoundaryMesh, computed: PairIntegrals, i: int, j: int, expected: PairIntegrals) -> None:
    size = mesh.lengths[i] * mesh.lengths[j]
    # round-off of a few hundred points of the reference, relative to the largest the pair can contribute
    for name, scale in (("log", size), ("quotient", size), ("double", mesh.lengths[i])):
        difference = getattr(computed, name)[:, :, i, j] - getattr(expected, name)
        assert np.abs(difference).max() < 4e-14 * scale, name  # 2.3e-14 with other kernels


def composite(n_pieces: int) -> tuple[FloatArray, FloatArray]:
    points, weights = np.polynomial.legendre.leggauss(20)
    edges = np.linspace(-1.0, 1.0, n_pieces + 1)
    half = 1.0 / n_pieces
    return (edges[:-1, None] + half * (points + 1.0)).ravel(), np.tile(weights * half, n_pieces)


def graded(n_points: int) -> tuple[FloatArray, FloatArray]:
    """Return a rule on [0, 1] for r log r and the like."""
    points, weights = np.polynomial.legendre.leggauss(n_points)
    v = 0.5 * (points + 1.0)
    return v**6, 3.0 * weights * v**5


def duffy(corner_xi: float, corner_t: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return a rule on the square whose singular point is one corner."""
    r, weight_r = graded(50)
    s, weight_s = composite(2)
    s, weight_s = 0.5 * (s + 1.0), 0.5 * weight_s
    near, far = (2.0 * r[:, None] * s).ravel(), np.repeat(2.0 * r, s.size)
    # next to the corner the weights are below 1e-24, and points coincide
    weight = 4.0 * (weight_r[:, None] * r[:, None] * weight_s).ravel()
    near, far, weight = (values[far > 1e-14] for values in (near, far, weight))
    u, v = np.concatenate([near, far]), np.concatenate([far, near])
    return corner_xi - np.sign(corner_xi) * u, corner_t - np.sign(corner_t) * v, np.tile(weight, 2)


@pytest.mark.parametrize(
    ("name", "degrees"),
    slow_only(
        product(("ring", "dome", "ellipse", "disk of four elements"), (DEGREES, HIGH)),
        *product(("ring", "dome", "ellipse", "disk of four elements"), (HIGH,)),
        ("ellipse", DEGREES),
    ),
)
def test_touching_pairs_against_duffy(name: str, degrees: Degrees) -> None:
    mesh = MESHES[name]()
    computed = swept(mesh, degrees)
    for i in range(0, mesh.n_elements, max(1, mesh.n_elements // 6)):
        j = int(mesh.node_elements[mesh.elements[i, 1], 1])
        check_pair(mesh, computed, i, j, summed(degrees, mesh, i, j, *duffy(1.0, -1.0)))
        check_pair(mesh, computed, j, i, summed(degrees, mesh, j, i, *duffy(-1.0, 1.0)))


@pytest.mark.parametrize("n_elements", [4, 12])
def test_elements_of_a_circle_against_themselves(n_elements: int) -> None:
    # x - y = 2 i R sin(bend (xi - t) / 2) exp(i (middle angle + bend (xi + t) / 2)); k = -1 / (4 pi R)
    radius, bend = 1.3, np.pi / n_elements
    mesh = discretise(Disk(radius).outline(), n_elements=n_elements)
    computed = swept(mesh)
    distance, weight = graded(60)
    s, weight_s = composite(2)
    r = np.repeat(2.0 * distance, s.size)
    middle = (s * (1.0 - distance[:, None])).ravel()
    w = 2.0 * (weight[:, None] * (1.0 - distance[:, None]) * weight_s).ravel()
    size = (radius * bend) ** 2
    tolerance = 1e-13 * size  # a sum of 2400 terms in the reference
    for i, (a, b) in itertools.product(range(n_elements), np.ndindex(2, 2)):
        power = (middle - 0.5 * r) ** a * (middle + 0.5 * r) ** b + (middle + 0.5 * r) ** a * (middle - 0.5 * r) ** b
        log = size * np.sum(w * power * np.log(2 * radius * np.sin(0.5 * bend * r)))
        turn = np.exp(2j * (bend * middle + (2 * i + 1) * bend))
        assert computed.log[a, b, i, i] == pytest.approx(log, abs=tolerance)
        assert computed.quotient[a, b, i, i] == pytest.approx(-size * np.sum(w * power * turn), abs=tolerance)
        k = -1.0 / (4.0 * np.pi * radius) * (2.0 / (a + 1) if a == 0 else 0.0) * (2.0 if b == 0 else 0.0)
        assert computed.double[a, b, i, i] == pytest.approx(k * size / (radius * bend) * radius * bend, abs=tolerance)


@pytest.mark.parametrize(
    ("name", "degrees"),
    slow_only(
        product(("ring", "plate with hole", "dome", "disk far from the origin"), (DEGREES, HIGH)),
        *product(("ring", "plate with hole", "dome", "disk far from the origin"), (HIGH,)),
    ),
)
def test_separated_pairs_against_a_composite_rule(name: str, degrees: Degrees) -> None:
    mesh = MESHES[name]()
    computed = swept(mesh, degrees)
    points, weights = composite(3)
    xi, t = np.repeat(points, points.size), np.tile(points, points.size)
    rng = np.random.default_rng(3)
    for i, j in rng.integers(0, mesh.n_elements, (30, 2)).tolist():
        if i == j or set(mesh.elements[i]) & set(mesh.elements[j]):
            continue
        check_pair(mesh, computed, i, j, summed(degrees, mesh, i, j, xi, t, np.outer(weights, weights).ravel()))


# --- what every closed boundary obeys ---


@pytest.mark.parametrize("name", slow_except(MESHES, *QUICK))
def test_pairs_are_symmetric(name: str) -> None:
    # test and trial elements are integrated by different means: this compares them
    mesh = MESHES[name]()
    integrals = swept(mesh)
    size = mesh.lengths[:, None] * mesh.lengths
    # elements are known to the round-off of their coordinates
    tolerance = size * (2e-14 + 4e-16 * mesh.diameter / np.minimum(mesh.lengths[:, None], mesh.lengths))
    for values in (integrals.log, integrals.quotient):
        assert (np.abs(values - values.transpose(1, 0, 3, 2)) / tolerance).max() < 1.0


@pytest.mark.parametrize("name", slow_except(MESHES, *QUICK))
def test_halves_add_up(name: str) -> None:
    mesh = MESHES[name]()
    whole, halves = swept(mesh), swept(mesh.refined(np.arange(mesh.n_elements)))
    tolerance = mesh.lengths[:, None] * mesh.lengths * (1e-13 + 1e-15 * mesh.diameter / mesh.lengths.min())
    n = mesh.n_elements
    for name in ("log", "quotient", "double"):
        values = getattr(halves, name)[0, 0].reshape(n, 2, n, 2).sum(axis=(1, 3))
        scale = tolerance if name != "double" else tolerance / mesh.lengths
        assert (np.abs(values - getattr(whole, name)[0, 0]) / scale).max() < 1.0, name


@pytest.mark.parametrize("name", slow_except(MESHES, *QUICK))
def test_the_boundary_is_seen_under_half_a_turn(name: str) -> None:
    mesh = MESHES[name]()
    seen = swept(mesh).double[:, 0].sum(axis=2)
    expected = 0.5 if mesh.is_exterior else -0.5
    # of the thin ring, a millionth of the coordinates' size apart, the angle is known to 1e-16 / 1e-3
    np.testing.assert_allclose(seen[0], expected * mesh.lengths, rtol=1e-12)
    np.testing.assert_allclose(seen[1], 0.0, atol=1e-12 * mesh.lengths.max())


@pytest.mark.slow
def test_tiny_curved_elements_leave_no_cracks_between_them() -> None:
    mesh = discretise(Sector(1.0, -90.0, 0.0).outline(), n_elements=16)
    for _ in range(25):
        mesh = mesh.refined(np.unique(mesh.node_elements[corner_nodes(mesh)]))
    assert mesh.lengths.min() < 1e-8
    seen = swept(mesh).double[0, 0].sum(axis=1)
    # coordinates hold 1e-16 / 1e-8 of the shape of an element, and gaps of that would be seen
    np.testing.assert_allclose(seen, -0.5 * mesh.lengths, rtol=1e-13)


@pytest.mark.parametrize("centre", [(0.0, 0.0), (3e5, -4e5), (6e6, 8e6)])
def test_curves_are_known_to_the_round_off_of_where_they_were_evaluated(centre: tuple[float, float]) -> None:
    distance = 1.0 + abs(centre[1])
    at_home = discretise(Disk(0.5).outline(), n_elements=96)
    drawn, placed = Disk(0.5, centre), Placement(centre, 30.0).mesh(at_home)
    moved = BoundaryMesh.transformed(at_home, shift=(-centre[0], -centre[1]))
    for far in (discretise(drawn.outline(), n_elements=96), placed, moved):
        geometry = ElementGeometry(far.unit)
        assert geometry.curved is not None
        np.testing.assert_allclose(geometry.half, ElementGeometry(at_home.unit).half, rtol=1e-13 * distance)
        np.testing.assert_allclose(np.abs(geometry.point(np.arange(96), 0.3)), 0.125**0.5, atol=1e-15 * distance)


@pytest.mark.parametrize("make", MESHES.values(), ids=MESHES)
def test_collocation_keeps_translations(make: Callable[[], BoundaryMesh]) -> None:
    mesh = make()
    _, double = collocation_matrices(mesh, Material(1.0, 0.3))
    translations = np.tile(np.eye(2), (mesh.n_elements, 1))
    expected = 0.5 if mesh.is_exterior else -0.5
    np.testing.assert_allclose(double @ translations, expected * translations, rtol=0.0, atol=1e-12)


def test_collocation_against_the_kernels_of_kelvin() -> None:
    material = Material(2.0, 0.3)
    mu, nu = material.shear_modulus, 0.3
    mesh = MESHES["plate with hole"]()
    single, double = (m.reshape(36, 2, 36, 2) for m in collocation_matrices(mesh, material))
    points, weights = composite(20)
    for j in range(0, 36, 5):
        elements = np.array([j])
        y, normal = mesh.points(elements, points)[0], mesh.normals_at(elements, points)[0]
        measure = weights * mesh.jacobian(elements, points)[0]
        for i in range(36):
            if i == j:
                continue
            r = y - mesh.centres[i]
            d = np.hypot(*r.T)
            q = np.einsum("pi,pj->ijp", r, r) / d**2
            across = np.einsum("pi,pi->p", r, normal) / d
            turned = np.einsum("pi,pj->ijp", r / d[:, None], normal)
            log = -(3 - 4 * nu) * np.log(d / mesh.diameter)
            u = (log * np.eye(2)[:, :, None] + q) / (8 * np.pi * mu * (1 - nu))
            # Somigliana: row i belongs to the load at x, column j to the displacement at y
            t = across * ((1 - 2 * nu) * np.eye(2)[:, :, None] + 2 * q) - (1 - 2 * nu) * (
                turned - turned.swapaxes(0, 1)
            )
            t = -t / (4 * np.pi * (1 - nu) * d)
            np.testing.assert_allclose(single[i, :, j], u @ measure, rtol=0.0, atol=1e-14)
            np.testing.assert_allclose(double[i, :, j], t @ measure, rtol=0.0, atol=1e-13)


def test_a_straight_curve_has_the_integrals_of_straight_elements() -> None:
    corners = [(0.0, 0.0), (1.0, 0.0), (0.4, 0.8)]

    def side(k: int, is_curve: bool) -> Side:
        segment = Segment(corners[k], corners[(k + 1) % 3])
        # an uneven parameter, so that the arc length has something to do
        curve = ParametricCurve(
            lambda p: segment.point(p * (0.5 + 0.5 * p)), lambda p: segment.derivative(p) * (0.5 + p)[:, None]
        )
        return Side(f"side-{k}", curve if is_curve else segment)

    straight, curved = (
        discretise(Outline((tuple(side(k, is_curve) for k in range(3)),)), n_elements=18, grading=Uniform())
        for is_curve in (False, True)
    )
    assert straight.is_straight.all()
    assert not curved.is_straight.any()
    one, other = swept(straight), swept(curved)
    for name in ("log", "quotient", "double"):
        np.testing.assert_allclose(getattr(other, name), getattr(one, name), rtol=0.0, atol=1e-15)


def test_elements_that_bend_too_much_are_refused() -> None:
    three = Outline(
        ((Side("long", Arc((0.0, 0.0), 1.0, 0.0, 4.5)), Side("rest", Arc((0.0, 0.0), 1.0, 4.5, 2 * np.pi))),)
    )
    mesh = discretise(three, n_elements=2)
    with pytest.raises(GeometryError, match=r"element 0 from \(1, .*bends too much .*: use more elements there"):
        PairSweep(mesh, DEGREES)
    PairSweep(discretise(three, n_elements=4), DEGREES)


def test_only_true_corners_are_corners() -> None:
    mesh = discretise(PlateWithHole(2.0, 1.0, 0.3).outline(), n_elements=36)
    assert corner_nodes(mesh).sum() == 4
    mesh = discretise(dome(), n_elements=9)
    corners = mesh.nodes[corner_nodes(mesh)]
    np.testing.assert_allclose(np.sort(corners[:, 0]), [-1.0, 1.0], atol=1e-15)


# --- the maps on curved elements ---


@pytest.mark.parametrize("name", ["ring", "dome", "ellipse"])
def test_the_map_kills_rigid_motions_and_is_in_equilibrium(name: str) -> None:
    mesh = MESHES[name]()
    elastic = GalerkinElasticity(mesh, Material(1.0, 0.3))
    matrix = SteklovPoincareOperator(elastic).matrix()
    motions = rigid_motions(mesh.nodes, mesh.centre, mesh.diameter).reshape(-1, 3)
    # the rotation is not a polynomial of the arc length: its interpolant is made the rigid motion
    assert np.abs(matrix @ motions).max() < 1e-13
    np.testing.assert_allclose(matrix, matrix.T, rtol=0.0, atol=1e-15)
    assert np.linalg.eigvalsh(matrix)[3] > 1e-3


@pytest.mark.parametrize("kind", [GalerkinElasticity, CollocationElasticity])
@pytest.mark.parametrize("name", slow_only(["plate with hole", "outside of a disk"], "plate with hole"))
def test_maps_do_not_depend_on_units_or_position(
    kind: type[GalerkinElasticity | CollocationElasticity], name: str
) -> None:
    mesh = MESHES[name]()
    matrix = SteklovPoincareOperator(kind(mesh, Material(1.0, 0.3))).matrix()
    for shift, factor in (((0.0, 0.0), 1e-6), ((0.0, 0.0), 1e6), ((3.0, -2.0), 1.0)):
        moved = SteklovPoincareOperator(kind(mesh.transformed(shift, factor), Material(1.0, 0.3))).matrix()
        # round-off of the integrals times the condition of V
        np.testing.assert_allclose(moved, matrix, rtol=0.0, atol=1e-11 * np.abs(matrix).max())
