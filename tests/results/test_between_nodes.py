"""Violations of the contact conditions between the nodes: known ones are found, and they fall with the elements."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import bemkit as bk
from bemkit.results.between_nodes import BetweenNodes, violations_at
from bemkit.results.points_between import PointsBetween, points_between
from bemkit.results.result_file import write_result
from bemkit.results.solution import Solution
from tests.slow import slow_only
from tests.solutions import changed as changed_solution

DEGREES = [0, 1, 2, 3, 8]
DEPTH, RISE = 1e-3, 0.3


def solved(name: str, degree: int, elements: int) -> Solution:
    """Return a shipped scene on a uniform mesh; of constant elements if the degree is zero."""
    discretisation = bk.Galerkin(degree) if degree else bk.ConstantCollocation()
    scene = replace(bk.load_scene(name), discretisation=discretisation, mesh=bk.MeshOptions(elements=elements))
    solution = bk.run(scene)
    assert solution.is_converged
    return solution


def measured(solution: Solution) -> BetweenNodes:
    assert solution.between_nodes is not None
    return solution.between_nodes


@pytest.fixture(scope="module")
def sliding() -> Solution:
    """Quadratic elements under a pressure of 1 and a shear of 0.3, which is all that friction bears."""
    return solved("uniform-slip", 2, 20)


def changed(solution: Solution, displacement: float = 0.0, normal: float = 0.0, shear: float = 0.0) -> BetweenNodes:
    """Raise the end node of one contact element, and tilt the tractions there so that their means stay as they are."""
    element = int(solution.mesh.part("floor")[3])
    u, t = solution.boundary.displacement.copy(), solution.boundary.traction_dofs.copy()
    nodes = solution.scene.discretisation.displacement_space(solution.mesh).element_dofs[element]
    u[nodes[2], 1] += displacement
    t[2 * element : 2 * element + 2] += np.outer([-1.0, 1.0], [shear, normal])
    return measured(changed_solution(solution, boundary=replace(solution.boundary, displacement=u, traction_dofs=t)))


def test_a_parabola_between_its_nodes_is_seen_to_penetrate(sliding: Solution) -> None:
    # zero at two nodes, DEPTH above the floor at the third: -DEPTH / 8 halfway between the first two
    found = changed(sliding, displacement=DEPTH)
    assert found.penetration_depth == pytest.approx(DEPTH / 8.0, rel=0.02)  # points of the element are that dense
    force = np.hypot(1.0, 0.3) * 2.0  # of the tractions on a width of 2
    length = force / sliding.scene.material.plane_modulus
    assert found.penetration == pytest.approx(found.penetration_depth / length, rel=1e-9)
    assert (found.tension, found.cone_excess) == pytest.approx((0.0, 0.0), abs=1e-12)
    # it is open by DEPTH at its end
    assert found.complementarity == pytest.approx(DEPTH / length, rel=1e-9)
    # lowered at the end it penetrates by more, there and on the next element
    assert changed(sliding, displacement=-DEPTH).penetration_depth == pytest.approx(DEPTH, rel=1e-9)


@pytest.mark.parametrize("crossing", [1e-3, 0.05, 0.5])
def test_a_penetration_that_is_small_beside_the_range_of_the_clearance_is_found(crossing: float) -> None:
    """A parabola that is negative over a part of an element: its least value lies between the points."""
    xi = points_between(2)
    middle = 0.5 * (xi[3] + xi[4])
    clearance = (xi - middle) ** 2 - crossing**2 - (xi[3] - middle) ** 2  # `crossing` at two points alike
    at, nothing = np.stack([xi, 0.0 * xi], axis=1), np.zeros_like(xi)
    found = violations_at(PointsBetween(at, xi, at, clearance, nothing, nothing, nothing), bk.Frictionless(), 1.0, 2.0)
    assert found.penetration_depth == pytest.approx(crossing**2 + (xi[3] - middle) ** 2, rel=1e-12)
    assert found.penetration == pytest.approx(0.5 * found.penetration_depth)
    assert found.penetration_depth > (1.25 if crossing < 0.1 else 1.0) * -clearance.min()


def test_round_off_of_coordinates_is_no_depth(sliding: Solution) -> None:
    far = float(np.abs(sliding.mesh.nodes).max())
    assert changed(sliding, displacement=-4.0 * np.finfo(float).eps * far).penetration_depth == 0.0
    assert changed(sliding, displacement=-400.0 * np.finfo(float).eps * far).penetration_depth > 0.0


def test_tension_and_friction_beyond_the_bound_are_seen(sliding: Solution) -> None:
    tense = changed(sliding, normal=1.0 + RISE)
    largest = np.hypot(1.0, 0.3)  # of the traction
    assert tense.tension == pytest.approx(RISE / largest, rel=1e-9)  # at the end of the element
    assert tense.penetration == pytest.approx(0.0, abs=1e-12)
    sheared = changed(sliding, shear=RISE)
    assert sheared.cone_excess == pytest.approx(RISE / largest, rel=1e-9)
    assert sheared.tension == 0.0
    assert sheared.worst == sheared.cone_excess


@pytest.mark.parametrize("degree", DEGREES)
def test_uniform_contact_is_perfect_between_the_nodes_too(degree: int) -> None:
    found = measured(solved("uniform-slip", degree, 20))
    assert found.worst <= 1e-11  # the fields are exact to round-off
    assert found.penetration_depth <= 1e-11


@pytest.mark.parametrize("degree", slow_only(DEGREES, 2, 8))
def test_the_obstacle_counts_between_the_nodes(degree: int) -> None:
    # the bottom lies on y = 0, on elements of length 0.1; the floor rises between their ends
    solution = solved("uniform-slip", degree, 60)
    bumps = bk.Contact(bk.Gap(bk.Expression("-1e-3 * sin(10 * pi * x) ** 2")))
    parts = tuple(replace(part, condition=bumps) if part.name == "floor" else part for part in solution.scene.parts)
    found = measured(changed_solution(solution, scene=replace(solution.scene, parts=parts)))
    assert found.penetration_depth == pytest.approx(1e-3, rel=0.01)  # the middle is among the points


def mean_worst(degree: int, counts: tuple[int, ...]) -> float:
    """Return the geometric mean over some meshes, on each of which the status changes elsewhere in an element."""
    return float(np.exp(np.mean([np.log(measured(solved("paper-1", degree, n)).worst) for n in counts])))


@pytest.mark.slow
@pytest.mark.parametrize(("degree", "power"), [(1, 1.5), (2, 0.5), (4, 0.5)])
def test_violations_fall_with_the_elements(degree: int, power: float) -> None:
    coarse, fine = (mean_worst(degree, counts) for counts in ((40, 48, 56, 64), (160, 192, 224, 256)))
    # Tractions end like the square root of the distance, clearances begin like its power 3/2. Constant tractions are
    # never tensile; what is left of them is an element that is open at one end.
    assert power - 0.4 <= np.log(coarse / fine) / np.log(4.0) <= power + 0.4
    assert fine < 0.02


@pytest.mark.slow
def test_violations_fall_with_the_degree() -> None:
    two, four, eight = (mean_worst(degree, (40, 48, 56, 64)) for degree in (2, 4, 8))
    assert 0.8 * two > four > 1.25 * eight


def test_curved_elements_fall_by_their_order() -> None:
    # chords of a smooth gap: of the second order between the nodes of linear elements
    coarse, fine = (measured(solved("wavy-obstacle", 1, n)).penetration_depth for n in (80, 160))
    assert 3.5 < coarse / fine < 4.5


def test_results_say_it() -> None:
    solution = solved("paper-1", 2, 40)
    assert solution.summary()["between_nodes"] == measured(solution).as_dict()
    assert measured(solution).violations.keys() < solution.certificate.violations.keys()
    bent = bk.run(bk.load_scene("bending"))
    assert bent.between_nodes is None
    assert bent.summary()["between_nodes"] is None


def test_files_hold_it(tmp_path: Path) -> None:
    solution = solved("paper-1", 2, 40)
    write_result(tmp_path / "result.h5", solution)
    with h5py.File(tmp_path / "result.h5") as file:
        assert json.loads(file["derived"][()])["between_nodes"] == measured(solution).as_dict()
    write_result(tmp_path / "bent.h5", bk.run(bk.load_scene("bending")))
    with h5py.File(tmp_path / "bent.h5") as file:
        assert json.loads(file["derived"][()])["between_nodes"] is None


def test_what_is_not_finite_is_nan() -> None:
    solution = solved("paper-1", 2, 40)
    lost = replace(solution.boundary, displacement=np.full_like(solution.boundary.displacement, np.inf))
    found = measured(changed_solution(solution, boundary=lost))
    assert np.isnan(found.worst)


def test_the_end_of_an_obstacle_between_two_closed_nodes_overlaps_in_the_mirror_too() -> None:
    """Round-off of the clearances of both nodes decided whether the corner beside one of them was found."""
    found = []
    for sign in (1.0, -1.0):
        corners = [(-0.5, -1.0), (0.525, -1.0), (0.525, 0.0), (-0.5, 0.0)]
        box = bk.RigidPolygon(tuple((sign * x, y) for x, y in corners))
        foot = bk.Part("foot", bk.Contact(box), ("bottom",))
        top = bk.Part("top", bk.PrescribedDisplacement(1e-3 * sign, -3e-3), ("top",))
        scene = bk.Scene(
            title="block on a box",
            shape=bk.Rectangle(1.2, 0.5, (-0.3 if sign > 0.0 else -0.9, 0.0)),
            material=bk.Material(1.0, 0.3),
            parts=(foot, top),
            law=bk.Coulomb(0.3),
            discretisation=bk.Galerkin(2),
            mesh=bk.MeshOptions(elements=40),
        )
        found.append(bk.run(scene).contacts_between_nodes["foot"])
    assert found[0].penetration > 0.03
    assert found[0].penetration == pytest.approx(found[1].penetration, rel=1e-6)
    assert abs(found[0].place[0]) == pytest.approx(0.525, abs=1e-6)
