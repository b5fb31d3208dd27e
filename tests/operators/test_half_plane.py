"""The flexibility of the surface of a half-plane: symmetry, positivity, and forces of known displacement."""

import numpy as np
import pytest
from mpmath import log, mpf, workdps

from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.outline import Surface
from bemkit.geometry.shapes import ElasticHalfPlane
from bemkit.operators.half_plane.elasticity import HalfPlaneElasticity, half_plane_map
from bemkit.operators.half_plane.equations import HalfPlaneEquations
from bemkit.operators.half_plane.flexibility import mean_logarithms
from bemkit.operators.material import Material, Plane
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions

MATERIAL = Material(2.0, 0.3)
PLACES = np.array([0.0, 1e-7, 5e-7, 2e-6, 1e-4, 0.01, 0.02, 0.05, 0.3, 0.4, 1.0])


def strip(places: np.ndarray, angle: float = 0.0) -> BoundaryMesh:
    n = len(places) - 1
    nodes = -places[:, None] * np.array([np.cos(angle), np.sin(angle)])
    elements = np.column_stack([np.arange(n), np.arange(1, n + 1)])
    return BoundaryMesh(nodes, elements, is_exterior=True, surface=Surface())


@pytest.mark.parametrize("given", [PLACES, np.linspace(0.0, 1.0, 31)], ids=["graded", "equal"])
def test_mean_logarithms_agree_with_sixty_digits(given: np.ndarray) -> None:
    means = mean_logarithms(given)
    with workdps(60):
        places = [mpf(float(place)) for place in given]
        for i in range(len(means)):
            for j in range(len(means)):
                (a, b), (c, d) = places[i : i + 2], places[j : j + 2]
                terms = [sign * _twice_integrated(x) for x, sign in ((d - a, 1), (d - b, -1), (c - a, -1), (c - b, 1))]
                exact = float(sum(terms) / ((b - a) * (d - c)))
                # differences of neighbours that are up to four times as long leave a digit or two
                assert means[i, j] == pytest.approx(exact, rel=1e-12), (i, j)


def test_the_series_of_distant_intervals_has_all_digits() -> None:
    means = mean_logarithms(np.linspace(0.0, 1.0, 61))[0]
    with workdps(60):
        ends = [mpf(float(place)) for place in np.linspace(0.0, 1.0, 61)]
        for j in range(21, 60):  # from 20 lengths on
            sums = _twice_integrated(ends[j + 1]) - _twice_integrated(ends[j + 1] - ends[1])
            sums += _twice_integrated(ends[j] - ends[1]) - _twice_integrated(ends[j])
            exact = float(sums / (ends[1] * (ends[j + 1] - ends[j])))
            # the term of the tenth power is 1.5e-3 / 20^10; round-off of the logarithm itself
            assert means[j] == pytest.approx(exact, abs=1e-15), j


def _twice_integrated(x: mpf) -> mpf:
    return x**2 / 2 * (log(abs(x)) - mpf(3) / 2) if x else mpf(0)


@pytest.mark.parametrize("plane", Plane)
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_flexibility_is_symmetric_and_positive(plane: Plane, angle: float) -> None:
    flexibility = HalfPlaneElasticity(strip(PLACES, angle), Material(2.0, 0.45, plane)).full_flexibility
    np.testing.assert_array_equal(flexibility, flexibility.T)
    scaled = np.sqrt(np.diag(flexibility))
    # by the variations of 9 intervals: the smallest eigenvalue of the scaled matrix is about 0.04
    assert np.linalg.eigvalsh(flexibility / np.outer(scaled, scaled)).min() > 1e-3


def test_a_turned_half_plane_has_turned_displacements() -> None:
    angle, force = 0.7, np.random.default_rng(1).normal(size=(len(PLACES) - 1, 2))
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    straight, turned = (half_plane_map(strip(PLACES, each), MATERIAL) for each in (0.0, angle))
    expected = straight.strain_displacement(force) @ rotation.T
    np.testing.assert_allclose(turned.strain_displacement(force @ rotation.T), expected, rtol=0.0, atol=1e-12)


def test_a_pressure_displaces_as_flamant_says() -> None:
    mesh = strip(np.linspace(0.0, 1.0, 201))
    elastic, n = half_plane_map(mesh, MATERIAL), mesh.n_elements
    force = np.zeros((n, 2))
    force[100] = (0.0, -1.0)  # pressed down on one element, its centre at x = -0.5025
    u = elastic.strain_displacement(force)
    x = mesh.centres[:, 0]
    distance = np.abs(x - x[100])
    away = distance > 0.05
    modulus, compressibility = MATERIAL.plane_modulus, MATERIAL.plane_compressibility
    # surface far away sinks less: -(2 P / (pi E')) log(1 / r); points move towards the force by (1-2nu)P/(4 mu)...
    np.testing.assert_allclose(u[away, 1], 2.0 / (np.pi * modulus) * np.log(distance[away]), rtol=2e-3)
    np.testing.assert_allclose(u[away, 0], -0.5 * compressibility * np.sign(x - x[100])[away], rtol=1e-12)


def test_the_condensed_map_is_the_inverse_of_the_flexibility() -> None:
    mesh = strip(np.linspace(0.0, 1.0, 21), 0.3)
    n, random = mesh.n_elements, np.random.default_rng(2)
    retained = np.zeros((n, 2), bool)
    retained[4:16] = True
    fixed, moved = np.zeros((n, 2), bool), np.zeros((n, 2))
    fixed[16:, 1], moved[16:, 1] = True, 0.2
    frame = np.broadcast_to(np.array([[0.6, 0.8], [-0.8, 0.6]]), (n, 2, 2))
    conditions = NodalConditions(frame, fixed, moved, retained)
    given = np.where(retained, 0.0, 0.1)
    elastic = half_plane_map(mesh, MATERIAL)
    condensed = elastic.condense(conditions, given)
    held = random.normal(size=np.count_nonzero(retained))
    displacement, force = condensed.recover(held)
    local, acting = conditions.in_frames(displacement), conditions.in_frames(force)
    np.testing.assert_allclose(local[retained], held)
    np.testing.assert_allclose(local[fixed], 0.2)
    np.testing.assert_allclose(acting[conditions.is_free], conditions.in_frames(given)[conditions.is_free])
    np.testing.assert_allclose(elastic.strain_displacement(force), displacement, atol=1e-12)
    np.testing.assert_allclose(condensed.stiffness @ held - condensed.load, acting[retained], rtol=1e-9, atol=1e-9)
    response, at_rest = condensed.follow(np.array([0, 1, 5]))
    np.testing.assert_allclose(at_rest + response @ held, local.ravel()[[0, 1, 5]], rtol=1e-9)


def test_a_strip_has_open_ends_and_the_body_below() -> None:
    mesh = BoundaryMesh(*_of(ElasticHalfPlane(-1.0, 3.0)), is_exterior=True, surface=Surface())
    np.testing.assert_array_equal(mesh.normals, [[0.0, 1.0]] * 2)
    assert mesh.area == np.inf
    assert mesh.diameter == 4.0


def _of(shape: ElasticHalfPlane) -> tuple[np.ndarray, np.ndarray]:
    curve = shape.outline().sides[0].curve
    return curve.point(np.array([0.0, 0.5, 1.0])), np.array([[0, 1], [1, 2]])


def test_kept_logarithms_do_not_grow_with_the_sets_of_nodes_that_are_asked_for() -> None:
    places = np.linspace(0.0, 1.0, 501)
    equations = HalfPlaneEquations(places, MATERIAL, np.zeros((0, 500), complex))
    everywhere = np.arange(500)
    for first in range(500):
        seen = equations.kept_logarithms(np.array([first, (first + 7) % 500]), everywhere)
        assert sum(each.size for each in equations.kept.values()) <= 400 * 500  # logarithms for each element
    np.testing.assert_array_equal(seen, equations.logarithms(np.array([499, 6]), everywhere))
    assert equations.kept_logarithms(everywhere, np.array([499, 6])).base is not None  # the transposed one, kept
