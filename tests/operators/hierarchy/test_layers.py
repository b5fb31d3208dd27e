"""Closed forms of both layers: the matrices of collocation, quadrature, and the same numbers from both back ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from bemkit.arrays import ComplexArray, IntArray
from bemkit.geometry import BoundaryMesh, Disk, PlateWithHole, Rectangle, discretise
from bemkit.geometry.symmetry.lines import Symmetry
from bemkit.operators.collocation import compiled
from bemkit.operators.collocation.curved_elements import CurvedElements
from bemkit.operators.collocation.equations import NOWHERE, collocation_equations, point_forces
from bemkit.operators.collocation.layers import Constants, Layer, Unknowns, straight_layer
from bemkit.operators.element_geometry import ElementGeometry
from bemkit.operators.material import Material
from tests.operators.collocation_matrices import collocation_matrices
from tests.slow import slow_except

MATERIAL = Material(2.0, 0.3)


@pytest.fixture(params=["numpy", "numba"])
def backend(request: pytest.FixtureRequest) -> str:
    if request.param == "numba":
        request.getfixturevalue("compiled_at_once")
        assert compiled.layer_for(1) is not straight_layer
    return str(request.param)


def fields_of(
    backend: str, constants: Constants, x: ComplexArray, places: IntArray, start: ComplexArray, end: ComplexArray
) -> ComplexArray:
    """Return the factors (6, n_points, n_elements) of p, conj(p), v, conj(v), s, conj(s)."""
    layer = straight_layer if backend == "numpy" else compiled.loaded()
    return stacked(*(factors_of(layer, constants, is_double, (x, places), (start, end)) for is_double in (False, True)))


def factors_of(
    layer: Layer,
    constants: Constants,
    is_double: bool,
    at: tuple[ComplexArray, IntArray],
    elements: tuple[ComplexArray, ComplexArray],
) -> ComplexArray:
    """Return the factors of `straight_factors` from units along x and y of each density of its own."""
    n, n_densities = elements[0].size, 1 + is_double
    weights = np.tile(np.eye(n_densities, dtype=complex), (n, 1))[:, None]
    unknowns = Unknowns(np.repeat(np.arange(n), n_densities)[:, None], weights, np.arange(2 * n * n_densities))
    along = layer(constants, is_double, *at, elements, unknowns).reshape(n, n_densities, 2, -1)
    # f v + g conj(v) of v = 1 and of v = i
    factor, conjugate = (0.5 * (along[:, :, 0] + sign * 1j * along[:, :, 1]) for sign in (-1, 1))
    return np.concatenate([factor, conjugate], axis=1)


def stacked(single: ComplexArray, double: ComplexArray) -> ComplexArray:
    return np.concatenate([single, double[:, [0, 2, 1, 3]]], axis=1).transpose(1, 2, 0)


@pytest.fixture
def unloaded() -> Iterator[None]:
    """Let numba be looked for again, and once more when everything is as it was."""
    compiled.loaded.cache_clear()
    yield
    compiled.loaded.cache_clear()


def straight(shape: Rectangle | PlateWithHole, n_elements: int) -> BoundaryMesh:
    mesh = discretise(shape.outline(), n_elements=n_elements).unit
    return BoundaryMesh(mesh.nodes, mesh.elements)


@pytest.mark.parametrize("slopes", [True, False], ids=["slopes", "constant"])
@pytest.mark.parametrize("shape", [Rectangle(1.0, 2.0), PlateWithHole(2.0, 1.5, 0.4)], ids=["rectangle", "hole"])
@pytest.mark.parametrize("is_curved", [False, True], ids=["straight", "curved"])
@pytest.mark.usefixtures("backend")
def test_columns_are_those_of_collocation(shape: Rectangle | PlateWithHole, is_curved: bool, slopes: bool) -> None:
    mesh = discretise(shape.outline(), n_elements=60).unit if is_curved else straight(shape, 60)
    assert mesh.is_straight.all() == (not is_curved or isinstance(shape, Rectangle))
    assert_columns_are_those_of_collocation(mesh, slopes)


@pytest.mark.parametrize(
    "symmetry",
    slow_except([Symmetry(x=1.0), Symmetry(y=0.75), Symmetry(x=1.0, y=0.75)], Symmetry(x=1.0, y=0.75)),
    ids=str,
)
@pytest.mark.parametrize("shape", [Rectangle(2.0, 1.5), PlateWithHole(2.0, 1.5, 0.4)], ids=["rectangle", "hole"])
@pytest.mark.parametrize("slopes", slow_except([True, False], True), ids=["slopes", "constant"])
def test_columns_of_symmetric_bodies_are_those_of_collocation(
    shape: Rectangle | PlateWithHole, symmetry: Symmetry, slopes: bool
) -> None:
    mesh = discretise(shape.outline(), n_elements=80, symmetry=symmetry).unit
    assert mesh.n_elements * symmetry.n_images == 80
    assert_columns_are_those_of_collocation(mesh, slopes)
    columns = collocation_equations(mesh, MATERIAL, np.arange(mesh.n_elements), takes_slopes=slopes)
    # a point of no element sees the element alone, a point in the middle of one its images, too
    alone, with_images = columns.fields(columns.points[:1], np.array([40])), columns.block(np.arange(2), np.array([40]))
    assert abs(alone - with_images).max() > 1e-3


def assert_columns_are_those_of_collocation(mesh: BoundaryMesh, slopes: bool) -> None:
    n, order = mesh.n_elements, np.random.default_rng(0).permutation(mesh.n_elements)
    single, double = collocation_matrices(mesh, MATERIAL, takes_slopes=slopes)
    dofs = (2 * order[:, None] + np.arange(2)).ravel()
    columns = collocation_equations(mesh, MATERIAL, order, takes_slopes=slopes)
    entries = columns.block(np.arange(2 * n), np.arange(4 * n)).reshape(2 * n, n, 2, 2)
    whole = np.ix_(dofs, dofs)
    # closed forms on either side: only round-off of entries of size one differs
    np.testing.assert_allclose(entries[:, :, 0].reshape(2 * n, -1), -single[whole], atol=1e-15)
    # four Gauss points at 30 half lengths of an arc leave 6e-15
    np.testing.assert_allclose(entries[:, :, 1].reshape(2 * n, -1), (double + 0.5 * np.eye(2 * n))[whole], atol=1e-14)
    traction, displacement = np.random.default_rng(1).normal(size=(2, n, 2))
    both = np.concatenate([traction, displacement], axis=1).ravel()
    product = (entries.reshape(2 * n, -1) @ both).reshape(n, 2)
    places = np.array([0, 3, n - 1])
    np.testing.assert_allclose(columns.residual(places, traction, displacement), product[places], atol=1e-13)


def test_fields_anywhere_are_integrals_of_the_kernel(backend: str) -> None:
    constants = Constants.of(MATERIAL, 0.7)
    x = np.array([0.3 + 0.4j, -2.0 + 0.1j, 5.0 - 3.0j])
    start, end = np.array([0.2 - 0.1j, 1.0 + 0.5j]), np.array([0.6 + 0.2j, 0.5 + 0.1j])
    fields = fields_of(backend, constants, x, np.full(3, NOWHERE), start, end)
    single, double = fields[:2], fields[2:]
    t, weights = np.polynomial.legendre.leggauss(60)
    span = end - start
    y = 0.5 * (start + end) + 0.5 * np.multiply.outer(t, span)
    rho = x[:, None] - y[:, None, :]
    measure = 0.5 * np.abs(span) * weights[:, None, None]
    nu, normal = MATERIAL.effective_poisson_ratio, -1j * span / np.abs(span)
    kappa = 3.0 - 4.0 * nu
    # Kelvin: u = A (-kappa log|rho| p + (rho / conj(rho)) conj(p) / 2 + p / 2)
    on_p = constants.single * np.sum(measure * (0.5 - kappa * np.log(np.abs(rho) / 0.7)), axis=0)
    on_conjugate = constants.single * np.sum(measure * 0.5 * rho / rho.conj(), axis=0)
    np.testing.assert_allclose(single, [on_p, on_conjugate], rtol=1e-13, atol=1e-15)
    # T v = B int ([(2 - 2 nu) Re + i (1 - 2 nu) Im](n / rho) v + (rho / conj(rho)) Re(n / rho) conj(v)) ds
    flow = normal / rho
    of_density = constants.double * (2.0 * (1.0 - nu) * flow.real + 1j * (1.0 - 2.0 * nu) * flow.imag)
    of_conjugate = constants.double * rho / rho.conj() * flow.real
    local = t[:, None, None]
    expected = [np.sum(measure * each, axis=0) for each in (of_density, of_conjugate)]
    expected += [np.sum(measure * local * each, axis=0) for each in (of_density, of_conjugate)]
    np.testing.assert_allclose(double, expected, atol=1e-14)


def test_midpoints_of_arcs_have_principal_values() -> None:
    mesh, bend = discretise(Disk(1.3).outline(), n_elements=8), np.pi / 8
    elements = CurvedElements(ElementGeometry(mesh), MATERIAL, np.arange(8), 1.0)
    constants, nu = elements.constants, MATERIAL.effective_poisson_ratio
    x, own, element = mesh.centres[2:3] @ [1.0, 1j], np.array([0]), np.array([2])
    v = elements.factors(True, x, own, element)[0, 0, 0]
    # chords from the midpoint turn by half of the angle of the arc
    assert v == pytest.approx(-2.0 * (1.0 - nu) * bend * constants.double, abs=1e-15)
    # log|x - y| = log(2.6 sin(angle / 2))
    distance, weights = np.polynomial.legendre.leggauss(40)
    angle, measure = bend * (0.5 * (distance + 1.0)) ** 4, 2.0 * bend * (0.5 * (distance + 1.0)) ** 3 * weights
    log = 2.0 * 1.3 * np.sum(measure * np.log(2.6 * np.sin(0.5 * angle)))
    p = elements.factors(False, x, own, element)[0, 0, 0]
    assert p == pytest.approx(constants.single * (1.3 * bend - (3.0 - 4.0 * nu) * log), rel=1e-13)


def test_quadrature_gives_the_closed_forms_where_elements_are_straight(backend: str) -> None:
    mesh, order = straight(Rectangle(1.0, 1.0), 48), np.random.default_rng(2).permutation(48)
    geometry, constants = ElementGeometry(mesh), Constants.of(MATERIAL, mesh.diameter)
    elements = CurvedElements(geometry, MATERIAL, order, mesh.diameter)
    chosen = np.array([3, 10, 47])
    start, end, centre = (of[order[chosen]] for of in (geometry.start, geometry.end, geometry.centre))
    # close to the first of them, some half lengths away, far away, and in the middle of the last one
    x = np.append(centre[0] + np.array([1e-3, 0.03j, 0.06, 0.07j, 0.3 + 0.2j, 2.0]), centre[2])
    places = np.append(np.full(6, NOWHERE), 47)
    expected = fields_of(backend, constants, x, np.where(places == 47, 2, NOWHERE), start, end)
    layers = (elements.factors(is_double, x, np.where(places == 47, 2, -1), chosen) for is_double in (False, True))
    np.testing.assert_allclose(stacked(*layers), expected, atol=1e-14)


def test_points_on_the_line_of_an_element_and_close_to_it_keep_their_digits(backend: str) -> None:
    constants, element = Constants.of(MATERIAL, 1.0), (np.array([0.0j]), np.array([1.0 + 0.0j]))
    close = np.array([0.5 + 1e-14j, 1.0 + 1e-12 + 0j, 3.0 + 0j])
    double = fields_of(backend, constants, close, np.full(3, NOWHERE), *element)[2:]
    # just inside of its left side half of the plane is seen, 2 (1 - nu) pi B = 1 / 2; along its line nothing is
    np.testing.assert_allclose(double[0].real, [[-0.5], [0.0], [0.0]], atol=1e-13)
    assert np.isfinite(double).all()
    own = fields_of(backend, constants, np.array([0.5 + 0j]), np.array([0]), *element)[2:]
    np.testing.assert_allclose(own[:2], 0.0, atol=1e-16)


@pytest.mark.usefixtures("backend")
def test_points_of_no_element_see_no_jump() -> None:
    columns = collocation_equations(straight(Rectangle(1.0, 1.0), 20), MATERIAL, np.arange(20), takes_slopes=False)
    of_displacements = 4 * np.arange(20) + 2
    inside = columns.fields(np.array([0.05 + 0.02j]), of_displacements)[0]
    # a unit translation of the boundary: T 1 is -1 inside of the body, -1/2 + 1/2 on its boundary, 0 outside
    np.testing.assert_allclose(inside.sum(), -1.0, atol=1e-14)
    on = columns.block(np.array([0]), of_displacements)[0]
    np.testing.assert_allclose(on.sum(), 0.0, atol=1e-14)
    outside = columns.fields(np.array([3.0 + 0.0j]), of_displacements)[0]
    np.testing.assert_allclose(outside.sum(), 0.0, atol=1e-14)


@pytest.mark.usefixtures("unloaded")
def test_without_numba_the_plan_says_what_to_install(without: Callable[..., None]) -> None:
    without("numba")
    assert compiled.loaded() is straight_layer
    is_expected, why = compiled.expected(2000)
    assert not is_expected
    assert "pip install 'bemkit[fast]'" in why
    assert "takes longer" in compiled.expected(999)[1]


@pytest.mark.parametrize("fault", [RuntimeError("no LLVM"), np.nan], ids=["error", "nan"])
def test_a_broken_numba_is_replaced_by_numpy(fault: float | Exception) -> None:
    def broken(*arguments: object) -> np.ndarray:
        if isinstance(fault, Exception):
            raise fault
        return np.array([fault])

    def load() -> Layer:
        raise ImportError("numba needs an older numpy")

    assert compiled.checked(lambda: broken) is straight_layer
    assert compiled.checked(load) is straight_layer


def test_a_layer_that_works_is_kept() -> None:
    def layer(*arguments: object) -> ComplexArray:
        return straight_layer(*arguments)

    assert compiled.checked(lambda: layer) is layer


@pytest.mark.usefixtures("backend")
def test_forces_are_those_of_the_kernel() -> None:
    x, sources = np.array([0.3 + 0.4j, -2.0 + 0.1j]), np.array([1.0 + 1.0j, -0.5j, 3.0 + 0.0j])
    found = point_forces(x, sources, 0.3, 0.7).reshape(3, 2, 2, 2)  # source, its direction, point, component
    rho = np.stack([(x - sources[:, None]).real, (x - sources[:, None]).imag], axis=-1)
    r = np.linalg.norm(rho, axis=-1)[..., None, None]
    kelvin = -(3.0 - 4.0 * 0.3) * np.log(r / 0.7) * np.eye(2) + rho[..., :, None] * rho[..., None, :] / r**2
    np.testing.assert_allclose(found, kelvin.transpose(0, 2, 1, 3), rtol=1e-13, atol=1e-15)


def test_far_away_fields_keep_their_digits(backend: str) -> None:
    constants, length = Constants.of(MATERIAL, 1.0), 1e-5
    x = 3.0 * np.exp(1j * np.linspace(0.1, 6.0, 7)) + 0.2
    start, end = np.array([0.2 + 0.1j]), np.array([0.2 + 0.1j + length * np.exp(0.7j)])
    double = fields_of(backend, constants, x, np.full(7, NOWHERE), start, end)[2:]
    # ten Gauss points are exact to round-off at 6e5 half lengths
    t, weights = np.polynomial.legendre.leggauss(10)
    tangent, nu = np.exp(0.7j), MATERIAL.effective_poisson_ratio
    flow, moment_flow, turned, moment_turned = np.zeros((4, 7), complex)
    for place, weight in zip(t, weights, strict=True):
        rho = x - start[0] - 0.5 * length * (1.0 + place) * tangent
        rate = -1j * tangent * 0.5 * length * weight / rho
        quotient = rho / rho.conj() * rate.real
        flow, moment_flow = flow + rate, moment_flow + place * rate
        turned, moment_turned = turned + quotient, moment_turned + place * quotient
    expected = [
        constants.double * (2.0 * (1.0 - nu) * flow.real + 1j * (1.0 - 2.0 * nu) * flow.imag),
        constants.double * turned,
    ]
    np.testing.assert_allclose(double[:2, :, 0], expected, rtol=1e-10)
    # of the moments the sum cancels: they are length / distance of the others, which is known to fewer digits
    rest = [constants.double * (2.0 * (1.0 - nu) * moment_flow.real + 1j * (1.0 - 2.0 * nu) * moment_flow.imag)]
    np.testing.assert_allclose(double[2:3, :, 0], rest, atol=1e-15 * np.abs(expected[0]).max())
    assert np.abs(double[2]).max() < 1e-5 * np.abs(double[0]).max()
