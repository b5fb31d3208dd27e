"""Estimated errors of contact tractions between bodies of linear and quadratic elements."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import trapezoid

import bemkit as bk
from bemkit.results.contact_places import FAR_END_SHARE
from bemkit.results.contact_table import ContactTable
from bemkit.results.error_indicators import continuation_error, nodal_error
from bemkit.results.solution import Solution
from bemkit.solvers.active_sets import NodeStatus
from checks.calibration.true_errors import true_errors

LAYERS = bk.MeshOptions(accuracy=1e-3, rising_degrees=True)


def solved(name: str, degree: int, mesh: bk.MeshOptions) -> Solution:
    scene = bk.load_scene(name)
    bodies = tuple(replace(body, mesh=None, discretisation=None) for body in scene.bodies)
    return bk.run(replace(scene, bodies=bodies, discretisation=bk.Galerkin(degree), mesh=mesh))


@cache
def pin(side: str) -> Solution:
    """Return the pin with the nodes of contact on a side, to a fifth of the errors that are judged."""
    scene = bk.load_scene("pin-in-plate")
    (pair,) = scene.contacts
    bodies = tuple(replace(body, mesh=None, discretisation=None) for body in scene.bodies)
    mesh = bk.MeshOptions(accuracy=1e-2, rising_degrees=True)
    contacts = (replace(pair, multipliers_on=side),)
    return bk.run(replace(scene, bodies=bodies, contacts=contacts, discretisation=bk.Galerkin(2), mesh=mesh))


@pytest.mark.slow
@pytest.mark.parametrize("n_elements", [80, 120, 160, 240])
@pytest.mark.parametrize("degree", [1, 2])
def test_the_estimates_are_near_the_errors(degree: int, n_elements: int) -> None:
    solution = solved("pin-in-plate", degree, bk.MeshOptions(elements=n_elements))
    ((side, _),) = solution.contact_sides.values()
    energy, tractions = true_errors(solution, pin(".".join(side)))
    assert solution.estimated_error is not None
    assert 0.5 < solution.estimated_error / energy < 3.0
    assert solution.estimated_traction_error is not None
    assert 0.5 < solution.estimated_traction_error / tractions < 3.0
    assert "of contact tractions" in str(solution)


def test_tractions_that_a_few_nodes_carry_are_warned_of() -> None:
    """Tractions are wrong by a third; the estimate of coarse zones is on the safe side."""
    solution = solved("two-cylinders", 2, bk.MeshOptions(elements=80))
    texts = [str(warning) for warning in solution.warnings]
    assert any(re.match(r"The estimated error of contact tractions is \d\d+ %: use more", text) for text in texts), (
        texts
    )


def test_two_nodes_have_no_estimate() -> None:
    assert solved("tilted-punch", 1, bk.MeshOptions(elements=80)).estimated_traction_error is None


def test_a_contact_of_two_nodes_counts_as_wrong_beside_others() -> None:
    s = np.array([0.0, 1.0, 2.0, 3.0, 0.0, 1.0])
    none, even = np.zeros(6), np.array([-1.0, -1.0, -1.0, -1.0, -3.0, -3.0])
    parts = ("long",) * 4 + ("short",) * 2
    table = ContactTable(
        parts, s, none, s, none, none, even, none, none, none, np.full(6, NodeStatus.STICK), np.full(6, 0.5)
    )
    assert nodal_error(table, 1, lambda _: 2, none > 0.0) == 2.0 * 9.0
    assert nodal_error(table.renamed({"short": "short"}), 1, lambda _: 1, none[4:] > 0.0) is None


def test_a_part_with_few_elements_is_named_with_its_body() -> None:
    solution = solved("tilted-punch", 1, bk.MeshOptions(elements=6))
    warning = next(each for each in solution.warnings if each.kind == "held part with few elements")
    assert str(warning).startswith("Body 'block': Part "), warning


def test_errors_far_from_contact_make_the_body_too_stiff() -> None:
    """The pressure is smooth; at both ends of the held top tractions have no bound."""
    parts = (
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("top", bk.PrescribedDisplacement(0.0, -1e-3), sides=("top",)),
    )
    block = bk.Scene(
        title="block", shape=bk.Rectangle(1.0, 1.0), material=bk.Material(1.0, 0.3), parts=parts, law=bk.Frictionless(),
        discretisation=bk.Galerkin(6), mesh=bk.MeshOptions(elements=16),
    )  # fmt: skip
    coarse = bk.run(block)
    layers = bk.MeshOptions(accuracy=1e-4, rising_degrees=True)
    fine = bk.run(replace(block, discretisation=bk.Galerkin(2), mesh=layers))
    error = coarse.force_normal / fine.force_normal - 1.0
    assert error > 1e-5
    assert coarse.estimated_error is not None
    assert 0.05 < error / coarse.estimated_error**2 < 1.0
    assert coarse.estimated_traction_error is not None
    assert 0.5 < coarse.estimated_traction_error / error < 3.0


def test_estimates_of_linear_elements_exclude_the_neighbours_of_a_singular_corner() -> None:
    """A block sticks to its floor: the second difference one element from the corner takes the node at the corner."""
    parts = (
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("top", bk.PrescribedDisplacement(0.0, -1e-3), sides=("top",)),
    )
    block = bk.Scene(
        title="block", shape=bk.Rectangle(1.0, 1.15), material=bk.Material(1.0, 0.41), parts=parts,
        law=bk.Coulomb(1.41), discretisation=bk.Galerkin(1), mesh=bk.MeshOptions(elements=56),
    )  # fmt: skip
    fine = bk.run(replace(block, discretisation=bk.Galerkin(2), mesh=LAYERS))
    coarse = bk.run(block)
    _, tractions = true_errors(coarse, fine)
    assert coarse.estimated_traction_error is not None
    assert 0.5 < coarse.estimated_traction_error / tractions < 2.0  # 3.6 with that node


@pytest.mark.slow
def test_linear_elements_that_a_longer_one_of_the_other_body_excludes_have_no_estimate() -> None:
    """At the edges of a punch; the next second difference takes a node at the end of the longer element."""
    material = bk.Material(1.0, 0.3)
    held = bk.Part("held", bk.Clamped(), sides=("bottom",))
    press = bk.Part("press", bk.PrescribedDisplacement(0.0, -1e-4), sides=("top",))
    scene = bk.Scene(
        title="punch", law=bk.Frictionless(), discretisation=bk.Galerkin(1), mesh=bk.MeshOptions(elements=38),
        bodies=(
            bk.Body(name="lower", shape=bk.Rectangle(1.0, 0.63), material=material, parts=(held,)),
            bk.Body(name="upper", shape=bk.Rectangle(0.702, 0.537, (0.149, 0.63)), material=material, parts=(press,)),
        ),
        contacts=(bk.ContactPair(("upper.bottom", "lower.top")),),
    )  # fmt: skip
    coarse = bk.run(scene)
    _, tractions = true_errors(coarse, bk.run(replace(scene, discretisation=bk.Galerkin(2), mesh=LAYERS)))
    assert coarse.estimated_traction_error is not None
    assert 0.5 < coarse.estimated_traction_error / tractions < 6.0  # 5.6: stiffness alone, 22 with that node


@pytest.mark.slow
def test_ends_of_contact_inside_elements_count_in_the_energy() -> None:
    """A single element of degree 6 touches, where pressures vanish like a root."""
    parts = (
        bk.Part("contact", bk.Contact(bk.RigidHalfPlane()), sides=("arc",), where=bk.Expression("y < 0.8")),
        bk.Part("top", bk.PrescribedDisplacement(0.0, -6e-3), sides=("start", "end")),
    )
    disc = bk.Scene(
        title="half disc", shape=bk.Sector(1.0, 180.0, 360.0, (0.0, 1.0)), material=bk.Material(1.0, 0.21), parts=parts,
        law=bk.Frictionless(), discretisation=bk.Galerkin(6), mesh=bk.MeshOptions(elements=19, density={"arc": 4.0}),
    )  # fmt: skip
    fine = bk.run(replace(disc, discretisation=bk.Galerkin(2), mesh=LAYERS))
    coarse = bk.run(disc)
    energy, _ = true_errors(coarse, fine)
    assert coarse.estimated_error is not None
    assert 0.5 < coarse.estimated_error / energy < 3.0  # 0.26 without them


@pytest.mark.slow
def test_errors_at_a_singular_corner_spread_to_its_neighbour() -> None:
    """Four elements of degree 6 touch: the corner's is excluded, and causes the error of the next one."""
    shape = bk.Polygon(((-0.5, 0.0), (0.5, 0.0), (0.88, 0.8), (-0.36, 0.8)), ("bottom", "right", "top", "left"))
    parts = (
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("top", bk.PrescribedDisplacement(-1.1e-3, -1.2e-3), sides=("top",)),
    )
    scene = bk.Scene(
        title="leaning", shape=shape, material=bk.Material(1.0, 0.3), parts=parts, law=bk.Coulomb(0.2),
        discretisation=bk.Galerkin(6), mesh=bk.MeshOptions(elements=17, grading=bk.Algebraic(2.0)),
    )  # fmt: skip
    fine = bk.run(replace(scene, discretisation=bk.Galerkin(2), mesh=LAYERS))
    coarse = bk.run(scene)
    _, tractions = true_errors(coarse, fine)
    assert coarse.singular_corners
    assert coarse.estimated_traction_error is not None
    assert 0.5 < coarse.estimated_traction_error / tractions < 3.0  # 0.07 without that


def test_singular_corners_are_excluded() -> None:
    """Beside an acute corner the pressure grows like r^-0.36: the last element is off by more than all others."""
    shape = bk.Polygon(((-0.5, 0.0), (0.5, 0.0), (0.9, 0.8), (-0.5, 0.8)), ("bottom", "right", "top", "left"))
    parts = (
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("top", bk.PrescribedDisplacement(y=-1e-3), sides=("top",)),
    )
    scene = bk.Scene(
        title="leaning", shape=shape, material=bk.Material(1.0, 0.3), parts=parts, law=bk.Frictionless(),
        discretisation=bk.Galerkin(2), mesh=bk.MeshOptions(elements=80, grading=bk.Algebraic(3.0)),
    )  # fmt: skip
    solution = bk.run(scene)
    table, (corner,) = solution.contact, solution.singular_corners
    assert [warning.kind for warning in solution.warnings] == ["singular contact traction"]
    length = solution.mesh.lengths[list(corner.elements)].sum()
    distance = np.hypot(table.x - corner.x, table.y - corner.y) / length
    share = np.select([distance < 0.999, distance < 1.001], [0.0, FAR_END_SHARE[1]], 1.0)
    assert np.bincount(np.digitize(share, [0.05, 0.5])).tolist() == [2, 1, table.n_contact - 3]
    counted = nodal_error(table, 2, solution.n_sides, share)
    assert counted is not None
    assert solution.places.squared_traction_error() == counted
    assert counted < (nodal_error(table, 2, solution.n_sides, np.ones(table.n_contact)) or 0.0)


@pytest.mark.slow
def test_linear_elements_on_flat_sides_are_not_much_too_stiff() -> None:
    """A block on another that is wider, moved by given amounts; on curves the estimate is four times that."""
    material = bk.Material(1.0, 0.25)
    held, pressed = (
        bk.Part("held", bk.Clamped(), ("bottom",)),
        bk.Part("pressed", bk.PrescribedDisplacement(0, -2e-4), ("top",)),
    )
    lower = bk.Body(name="lower", shape=bk.Rectangle(1.0, 0.73), material=material, parts=(held,))
    shape = bk.Rectangle(0.84, 0.84, corner=(0.08, 0.73))
    upper = bk.Body(name="upper", shape=shape, material=material, parts=(pressed,))
    contact = bk.ContactPair(("upper.bottom", "lower.top"), multipliers_on="upper.bottom")
    scene = bk.Scene(
        title="blocks", bodies=(lower, upper), contacts=(contact,), law=bk.Frictionless(),
        discretisation=bk.Galerkin(1), mesh=bk.MeshOptions(elements=44),
    )  # fmt: skip
    coarse, fine = bk.run(scene), bk.run(replace(scene, discretisation=bk.Galerkin(2), mesh=LAYERS))
    _, tractions = true_errors(coarse, fine)
    assert coarse.estimated_traction_error is not None
    assert 0.5 < coarse.estimated_traction_error / tractions < 3.0


@pytest.mark.parametrize("degree", [1, 2])
def test_tractions_continued_to_a_held_node_miss_the_next_power(degree: int) -> None:
    """Linear elements go on with a constant and miss a line, quadratic ones go on with a line and miss a parabola."""
    s, x = np.arange(1.0, 4.0), np.linspace(0.0, 1.0, 101)
    tractions = np.stack([s, -2.0 * s], axis=1) ** degree
    missed = x - 1.0 if degree == 1 else (x - 1.0) * (x - 2.0)
    squared = (1.0 + 4.0**degree) * float(trapezoid(missed**2, x))
    assert 0.75 * continuation_error(s, tractions, degree) < squared < 1.001 * continuation_error(s, tractions, degree)
    assert continuation_error(s[:degree], tractions[:degree], degree) == 0.0
    at_corner = np.array([1.0, 1.0, 2.0])  # two nodes of one point, where one side follows another
    assert np.isfinite(continuation_error(at_corner, tractions, degree))
    assert continuation_error(s - 1.0 - 1e-17, tractions, degree) == 0.0


@pytest.mark.parametrize("wall", ["left", "right"])
def test_ends_of_contact_at_a_support_count(wall: str) -> None:
    """The wall holds the node where pressure would be lowest: linear elements keep that of its neighbour."""
    parts = (
        bk.Part("contact", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("wall", bk.Clamped(), sides=(wall,)),
        bk.Part("top", bk.Pressure(2.7e-4), sides=("top",)),
    )
    scene = bk.Scene(
        title="block at a wall", shape=bk.Rectangle(1.0, 1.13), material=bk.Material(1.0, 0.3), parts=parts,
        law=bk.Frictionless(), discretisation=bk.Galerkin(1), mesh=bk.MeshOptions(elements=42),
    )  # fmt: skip
    coarse = bk.run(scene)
    _, tractions = true_errors(coarse, bk.run(replace(scene, discretisation=bk.Galerkin(2), mesh=LAYERS)))
    assert coarse.estimated_traction_error is not None
    assert 0.7 < coarse.estimated_traction_error / tractions < 2.0  # 0.3 without that


@pytest.mark.parametrize("n_elements", [40, 160])
def test_linear_elements_on_arcs_miss_a_part_of_what_presses_them(n_elements: int) -> None:
    """A ring on a thicker mandrel: the nodes are all alike, and only the chords between are wrong."""
    ring = bk.Scene(
        title="Ring on a mandrel",
        shape=bk.Ring(1.0, 2.0),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("hole", bk.Contact(bk.RigidCircle((0.0, 0.0), 1.01)), ("inner",)),),
        symmetry=bk.Symmetry(x=0.0, y=0.0),
        discretisation=bk.Galerkin(1),
        mesh=bk.MeshOptions(elements=n_elements),
    )
    solution = bk.run(ring)
    plane_strain = ring.material.youngs_modulus / (1.0 - 0.3**2)
    pressure = 0.01 * plane_strain / (5.0 / 3.0 + 0.3 / 0.7)
    error = np.abs(solution.contact.sigma_n / -pressure - 1.0).max()
    assert solution.estimated_traction_error == pytest.approx(error, rel=0.1)  # second differences add to it


@pytest.mark.parametrize("corner", [1.4, 1.05])
def test_a_side_that_hangs_over_the_end_of_the_other_goes_on_nowhere(corner: float) -> None:
    """Its last node in contact is no neighbour of a held one: a line through both was wrong by 180 times all forces."""
    below = bk.Body(
        name="below",
        shape=bk.Rectangle(4.0, 1.0, (-2.0, -1.0)),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
    )
    above = replace(
        below, name="above", shape=bk.Rectangle(1.0, 0.5, (corner, 0.0)), parts=(), body_forces=(bk.Gravity(1e-3),)
    )
    scene = bk.Scene(
        title="Overhang",
        bodies=(below, above),
        contacts=(bk.ContactPair(("above.bottom", "below.top")),),
        law=bk.Coulomb(0.3),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(elements=60),
    )
    solution = bk.run(scene)
    assert solution.estimated_traction_error is not None
    assert solution.estimated_traction_error < 0.3
