"""Contact tractions where the contact boundary ends: at rollers, loads and other contact parts, in line and in corners.

The exact fields are those of an Airy function that is even in x and in y: there is no shear on both axes, and no
displacement across them, so that rollers and smooth obstacles on the axes change nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.reference import DiscBetweenPlates
from bemkit.solvers.base import solve
from tests.slow import slow_except

WAVE, AMPLITUDE, PRESSURE = 2.3, 0.004, 1.0
STRESS = {
    "xx": f"{AMPLITUDE * WAVE**2} * cos({WAVE} * x) * (2 * cosh({WAVE} * y) + {WAVE / 2} * y * sinh({WAVE} * y)) - 1",
    "yy": f"-{AMPLITUDE * WAVE**2} * cos({WAVE} * x) * (cosh({WAVE} * y) + {WAVE / 2} * y * sinh({WAVE} * y)) - 1",
    "xy": f"{AMPLITUDE * WAVE**2} * sin({WAVE} * x) * (1.5 * sinh({WAVE} * y) + {WAVE / 2} * y * cosh({WAVE} * y))",
}
FLOOR, WALL = bk.RigidHalfPlane(), bk.RigidHalfPlane((0.0, 0.0), (1.0, 0.0))
TURNED = bk.Traction(bk.Expression(f"-({STRESS['xy']})"), bk.Expression(f"-({STRESS['yy']})"))
PARTS = {
    "roller": (bk.Part("floor", bk.Contact(FLOOR), ("bottom",)), bk.Part("left", bk.Roller(), ("left",))),
    "load": (
        bk.Part("floor", bk.Contact(FLOOR), ("bottom",), bk.Expression("x < 0.5")),
        bk.Part("load", TURNED, ("bottom",), bk.Expression("x > 0.5")),
        bk.Part("left", bk.Roller(), ("left",)),
    ),
    "one line": (
        bk.Part("floor", bk.Contact(FLOOR), ("bottom",), bk.Expression("x < 0.5")),
        bk.Part("right floor", bk.Contact(FLOOR), ("bottom",), bk.Expression("x > 0.5")),
        bk.Part("left", bk.Roller(), ("left",)),
    ),
    "corner": (bk.Part("floor", bk.Contact(FLOOR), ("bottom",)), bk.Part("left", bk.Contact(WALL), ("left",))),
}


def errors(parts: tuple[bk.Part, ...], degree: int, elements: int, density: float) -> dict[str, FloatArray]:
    """Return the errors of sigma_n at the nodes of each contact part, in order, relative to the pressure."""
    loads = (
        bk.Part("right", bk.Traction(bk.Expression(STRESS["xx"]), bk.Expression(STRESS["xy"])), ("right",)),
        bk.Part("top", bk.Traction(bk.Expression(STRESS["xy"]), bk.Expression(STRESS["yy"])), ("top",)),
    )
    mesh = bk.MeshOptions(elements=elements, density={"bottom": density})
    scene = bk.Scene(
        title="Airy function",
        shape=bk.Rectangle(1.0, 1.0),
        material=bk.Material(1.0, 0.3),
        parts=(*parts, *loads),
        discretisation=bk.Galerkin(degree),
        mesh=mesh,
    )
    table = bk.run(scene).contact
    xx, yy = (bk.Expression(STRESS[name])(table.x, table.y) for name in ("xx", "yy"))
    exact = np.where(table.rows("left"), xx, yy)
    return {part: np.abs(table.sigma_n - exact)[table.rows(part)] / PRESSURE for part in table.parts}


@pytest.mark.parametrize("case", PARTS)
@pytest.mark.parametrize("degree", slow_except([2, 3, 4, 5, 6], 2))
def test_ends_converge_like_the_nodes_between(case: str, degree: int) -> None:
    counts = (32, 64) if degree < 5 else (8, 16)
    coarse, fine = (errors(PARTS[case], degree, elements, 1.0) for elements in counts)
    for part, error in fine.items():
        ends, inner = ((max(e[part][0], e[part][-1]), max(e[part][1:-1])) for e in (coarse, fine))
        # symmetry between the elements gives some odd degrees an order more
        assert degree - 0.5 <= np.log2(ends[0] / inner[0]) <= degree + 1.2
        assert inner[0] < 8.0 * inner[1]
        assert max(error) < 0.03 * 10.0 ** (1 - degree)


def test_a_linear_end_node_is_of_the_first_order() -> None:
    """Its traction is the mean that a half hat takes: the value at a third of the element."""
    coarse, fine = (errors(PARTS["load"], 1, elements, 1.0)["floor"] for elements in (32, 64))
    assert 0.8 <= np.log2(coarse[-1] / fine[-1]) <= 1.3
    assert fine[-1] < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize(("degree", "allowed"), [(1, 5e-3), (2, 1e-3), (3, 2e-4), (6, 2e-5)])
def test_the_middle_of_a_disc_that_lies_beside_rollers(degree: int, allowed: float) -> None:
    scene = replace(bk.load_scene("disc-between-plates"), discretisation=bk.Galerkin(degree))
    table = bk.run(scene).contact
    exact = DiscBetweenPlates(1.0, 1.0 - 0.9839656623, scene.material).pressure(np.zeros(1))[0]
    error = abs(-table.sigma_n[np.argmin(table.s)] / exact - 1.0)
    assert 1e-3 * allowed < error < allowed


def wedge(angle: float, degree: int, law: bk.FrictionLaw, overlap: float = 0.0) -> bk.Scene:
    """Return a parallelogram in a corner of its own shape under uniform pressure; the wall may be nearer."""
    along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    corners = ((0.0, 0.0), (1.0, 0.0), (1.0 + along[0], along[1]), (along[0], along[1]))
    wall = bk.RigidHalfPlane((overlap, 0.0), (along[1], -along[0]))
    return bk.Scene(
        title="wedge",
        shape=bk.Polygon(corners, side_names=("bottom", "right", "top", "left")),
        material=bk.Material(1.0, 0.3),
        law=law,
        parts=(
            bk.Part("floor", bk.Contact(FLOOR), ("bottom",)),
            bk.Part("wall", bk.Contact(wall), ("left",)),
            bk.Part("load", bk.Pressure(1.0), ("right", "top")),
        ),
        discretisation=bk.Galerkin(degree),
        mesh=bk.MeshOptions(elements=16),
    )


@pytest.mark.parametrize("degree", slow_except([1, 2, 3, 8], 1, 8))
@pytest.mark.parametrize("angle", slow_except([45.0, 60.0, 90.0, 120.0], 60.0, 120.0))
def test_a_corner_between_two_obstacles_at_any_angle(angle: float, degree: int) -> None:
    """Uniform pressure shrinks the body towards the corner, and slides it along both obstacles."""
    solution = bk.run(wedge(angle, degree, bk.Frictionless()))
    assert solution.is_converged
    assert solution.contact.n_contact == 2 * (4 * degree + 1)
    np.testing.assert_allclose(solution.contact.sigma_n, -1.0, atol=1e-9)  # exact, to the certificate
    shrinkage = (1.0 + 0.3) * (1.0 - 2.0 * 0.3)
    np.testing.assert_allclose(solution.boundary.displacement, -shrinkage * solution.boundary.points, atol=1e-9)
    assert solution.between_nodes is not None
    assert solution.between_nodes.worst < 1e-8


@pytest.mark.parametrize("angle", [60.0, 90.0, 120.0])
def test_tangents_in_a_corner_follow_the_displacements_towards_both_obstacles(angle: float) -> None:
    scene = wedge(angle, 2, bk.Frictionless(), overlap=0.01)
    model = build_model(prepare(scene, scene.build_mesh()))
    state = solve(model.problem, scene.solver).state
    displacement, _ = model.body.recover(state)
    in_corner = np.flatnonzero(model.prepared.contact_nodes.is_shared)
    motion = np.einsum(
        "nkc,nc->nk",
        model.prepared.contact_nodes.frame[in_corner],
        displacement[model.prepared.contact_nodes.nodes[in_corner]],
    )
    assert np.abs(motion).max() > 1e-3 * np.abs(displacement).max()
    np.testing.assert_allclose(state.displacement[in_corner], motion, atol=1e-12)


def test_a_part_has_no_traction_of_its_neighbour_in_a_corner_with_friction() -> None:
    solution = bk.run(wedge(90.0, 2, bk.Coulomb(0.3)))
    assert solution.is_converged
    element = solution.mesh.part("wall")[-1]  # which ends in the corner
    pressure, shear = np.abs(solution.boundary.traction_dofs.reshape(-1, 2, 2)[element].T)
    assert np.all(shear <= 0.3 * pressure + 1e-9)
