"""Where contact tractions have no bound: which corners, how fast they grow there, and what estimates make of it."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.reference import sampled_fields
from bemkit.reference.compare import SamplePoints
from bemkit.results.solution import Solution
from bemkit.results.wedge import FREE, HELD, ROLLER, JoinedWedge, WedgeSide, joined_exponent, leading_exponent
from bemkit.solvers.active_sets import NodeStatus
from tests.scenes import paper
from tests.slow import slow_only

BLOCK = bk.Scene(
    title="block",
    shape=bk.Rectangle(1.0, 0.5),
    material=bk.Material(1.0, 0.3),
    law=bk.Coulomb(0.3),
    parts=(
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("top", bk.PrescribedDisplacement(x=2e-3, y=-1e-2), sides=("top",)),
    ),
    discretisation=bk.Galerkin(4),
    mesh=bk.MeshOptions(elements=40),
)
SLIDES, STICKS = 0.712937, 0.711173
"""Exponents at right angles, for outward slip and for none; see `tests/results/test_wedge.py`."""


@lru_cache
def solved(accuracy: float, coefficient: float = 0.3) -> bk.Solution:
    law, mesh = bk.Coulomb(coefficient), bk.MeshOptions(accuracy=accuracy, rising_degrees=True)
    solution: bk.Solution = bk.run(replace(BLOCK, law=law, discretisation=bk.Galerkin(2), mesh=mesh))
    return solution


def exponents(scene: bk.Scene) -> list[tuple[float, float]]:
    """Return the coordinate x and the exponent of each singular corner, to six digits."""
    return [(corner.x, round(corner.exponent, 6)) for corner in bk.run(scene).singular_corners]


def with_part(name: str, part: bk.Part, scene: bk.Scene = BLOCK) -> bk.Scene:
    """Return a scene with a part replaced, or added."""
    return replace(scene, parts=(*(each for each in scene.parts if each.name != name), part))


@pytest.mark.parametrize(
    "elements", slow_only([bk.ConstantCollocation(), bk.Galerkin(2), bk.Galerkin(4)], bk.Galerkin(4))
)
def test_corners_of_a_block_that_slides_or_sticks(elements: bk.ConstantCollocation | bk.Galerkin) -> None:
    """At both of them the block slides outwards, as far as elements are short enough to tell; or it sticks."""
    scene = replace(BLOCK, discretisation=elements, mesh=bk.MeshOptions(elements=160))
    assert exponents(scene) == [(0.0, SLIDES), (1.0, SLIDES)]
    assert exponents(replace(scene, law=bk.Coulomb(2.0))) == [(0.0, STICKS), (1.0, STICKS)]


@pytest.mark.parametrize(
    "scene",
    [
        replace(BLOCK, law=bk.Frictionless()),
        replace(BLOCK, law=bk.Tresca(1e-3)),  # whose bound does not rise with the pressure
        paper(
            1, bk.Galerkin(4), bk.MeshOptions(elements=40)
        ),  # contact opens on the left, and meets a roller on the right
    ],
    ids=["frictionless", "tresca", "paper-1"],
)
def test_where_tractions_stay_bounded_there_are_none(scene: bk.Scene) -> None:
    assert bk.run(scene).singular_corners == ()


def test_half_of_a_symmetric_block_has_one() -> None:
    parts = (BLOCK.parts[0], bk.Part("top", bk.PrescribedDisplacement(y=-1e-2), sides=("top",)))
    assert exponents(replace(BLOCK, symmetry=bk.Symmetry(x=0.5), parts=parts)) == [(0.0, SLIDES)]


def test_the_end_of_a_part_that_is_pressed_is_the_edge_of_a_punch() -> None:
    """The floor goes on, but the part ends inside of the side."""
    part = bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",), where=lambda x, y: x < 0.5)
    found = exponents(with_part("floor", part, replace(BLOCK, law=bk.Frictionless())))
    assert found == [(0.5, 0.5)]


@pytest.mark.parametrize(
    ("condition", "given"),
    [
        (bk.Clamped(), HELD),
        (bk.Roller(), ROLLER),
        (bk.PrescribedDisplacement(x=0.0), ROLLER),  # along the normal
        (bk.PrescribedDisplacement(y=0.0), WedgeSide(holds_tangent=True)),
        (bk.Traction(x=-1e-4), FREE),
    ],
    ids=["clamped", "roller", "normal", "tangent", "loaded"],
)
def test_what_is_given_beside_the_contact_decides(condition: bk.Clamped, given: WedgeSide) -> None:
    pressed = with_part("top", bk.Part("top", bk.Traction(y=-1e-2), sides=("top",)))
    solution = bk.run(with_part("side", bk.Part("side", condition, sides=("right",)), pressed))
    last = NodeStatus(int(solution.contact.status[-2]))
    contact = {NodeStatus.STICK: HELD, NodeStatus.SLIP_FORWARD: WedgeSide(True, friction=0.3)}.get(last, FREE)
    expected = leading_exponent(round(0.5 * np.pi, 6), given, contact, solution.scene.material.kappa)
    found = {corner.x: corner.exponent for corner in solution.singular_corners}
    assert found.get(1.0) == (expected if contact is not FREE else None)


def test_displacements_at_an_angle_to_the_boundary_are_not_judged() -> None:
    shape = bk.Polygon(((0.0, 0.0), (1.0, 0.0), (1.1, 0.5), (0.0, 0.5)), side_names=("bottom", "right", "top", "left"))
    pressed = with_part("top", bk.Part("top", bk.Traction(y=-1e-2), sides=("top",)), replace(BLOCK, shape=shape))
    for side, places in ((bk.Traction(), [0.0, 1.0]), (bk.PrescribedDisplacement(x=0.0), [0.0])):
        found = exponents(with_part("side", bk.Part("side", side, sides=("right",)), pressed))
        assert [x for x, _ in found] == places


def pressures(solution: bk.Solution, s: FloatArray) -> FloatArray:
    return sampled_fields(solution, [SamplePoints("floor", s, np.ones_like(s))]).sigma_n


@pytest.mark.slow
@pytest.mark.parametrize("coefficient", [0.3, 2.0])
def test_pressures_grow_as_the_exponents_say(coefficient: float) -> None:
    """Over two decades, to a thousandth: further in are the last elements, further out other terms matter."""
    solution = solved(1e-6, coefficient)
    distance = np.geomspace(1e-5, 1e-3, 9)
    for corner in solution.singular_corners:
        s = distance if corner.x == 0.0 else 1.0 - distance
        slope = np.polyfit(np.log(distance), np.log(-pressures(solution, s)), 1)[0]
        assert slope == pytest.approx(corner.exponent - 1.0, abs=1e-3)


def l2_errors(solution: bk.Solution, exact: bk.Solution) -> tuple[float, float]:
    """Return the relative error of both contact tractions in L2, on the elements that count and on all."""
    ends = np.geomspace(1e-10, 0.5, 400)
    edges = np.unique(np.concatenate([[0.0], ends, 1.0 - ends, *(t.s + 0.1 * ends for t in exact.transitions), [1.0]]))
    weight = np.diff(edges[edges <= 1.0])
    places = [SamplePoints("floor", edges[edges <= 1.0][:-1] + 0.5 * weight, weight)]
    mine, true = sampled_fields(solution, places), sampled_fields(exact, places)
    squared = weight * ((mine.sigma_n - true.sigma_n) ** 2 + (mine.sigma_t - true.sigma_t) ** 2)
    size = float(weight @ (true.sigma_n**2 + true.sigma_t**2))
    counts = np.isin(solution.mesh.part("floor"), solution.places.elements(""))
    element = np.searchsorted(np.cumsum(solution.mesh.lengths[solution.mesh.part("floor")]), places[0].s)
    return float(np.sqrt(squared[counts[element]].sum() / size)), float(np.sqrt(squared.sum() / size))


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", [1e-2, 1e-3, 1e-4, 1e-5])
def test_what_is_asked_for_is_reached_but_at_the_corners(accuracy: float) -> None:
    """The estimate holds to a factor of 3; at the corners errors in L2 stay above a few per mille."""
    solution, exact = solved(accuracy), solved(0.05 * accuracy)
    counted, everywhere = l2_errors(solution, exact)
    assert solution.is_converged
    assert solution.estimated_traction_error is not None
    assert 0.4 <= solution.estimated_traction_error / counted <= 3.0
    assert counted <= 1.2 * accuracy
    assert everywhere >= 4e-3
    assert abs(solution.energy / exact.energy - 1.0) <= accuracy**2


@pytest.mark.slow
def test_six_digits_take_few_elements() -> None:
    solution = solved(1e-6)
    assert solution.is_converged
    assert solution.n_elements <= 150


def test_what_is_left_out_is_near_the_corners_and_told() -> None:
    solution = solved(1e-4)
    assert solution.n_elements <= 120
    lengths, floor = solution.mesh.lengths, solution.mesh.part("floor")
    left_out = np.setdiff1d(floor, solution.places.elements(""))
    assert set(left_out.tolist()) == {k for corner in solution.singular_corners for k in corner.elements}
    assert left_out.size > 2
    assert lengths[left_out].sum() <= 2e-3
    for corner in solution.singular_corners:
        assert not (corner.before and corner.after)
        ((tip, following),) = corner.beside(solution.mesh)
        assert following in solution.places.elements("")
        assert lengths[list(corner.elements)].sum() + lengths[following] > 1e-3
        assert np.abs(solution.mesh.centres[tip] - (corner.x, corner.y)).max() == pytest.approx(0.5 * lengths[tip])
    told = [text for text in map(str, solution.warnings) if "tractions are singular" in text]
    assert len(told) == 2
    assert "at (0, 0) (r^-0.29)" in told[0]
    assert solution.summary()["singular_corners"] == [corner.as_dict() for corner in solution.singular_corners]
    kinds = [
        [warning.kind for warning in bk.run(replace(BLOCK, discretisation=discretisation)).warnings]
        for discretisation in (bk.Galerkin(2), bk.ConstantCollocation())
    ]
    assert [each.count("singular contact traction") for each in kinds] == [2, 0]


def test_short_elements_at_a_corner_belong_to_it_and_long_ones_do_not() -> None:
    """A first mesh has its only layer there, which is longer than a thousandth of the part."""
    coarse = bk.run(BLOCK)
    assert [len(corner.elements) for corner in coarse.singular_corners] == [1, 1]
    assert all(coarse.mesh.lengths[list(corner.elements)].sum() > 1e-2 for corner in coarse.singular_corners)


def stack() -> bk.Scene:
    """A narrow block on a wide one, pressed and pushed: edges in the middle, corners on the floor."""
    lower = bk.Body(
        name="lower",
        shape=bk.Rectangle(1.0, 0.5),
        material=bk.Material(1.0, 0.3),
        parts=(BLOCK.parts[0], bk.Part("table", bk.Free(), sides=("top",))),
    )
    load = bk.Part("load", bk.Traction(x=2e-3, y=-1e-2), sides=("top",))
    foot = bk.Part("foot", bk.Free(), sides=("bottom",))
    shape = bk.Rectangle(0.4, 0.4, corner=(0.3, 0.5))
    upper = bk.Body(name="upper", shape=shape, material=bk.Material(1.0, 0.3), parts=(foot, load))
    pair = bk.ContactPair(sides=("upper.foot", "lower.table"))
    return bk.Scene(title="stack", bodies=(lower, upper), contacts=(pair,), law=bk.Coulomb(0.3))


@lru_cache
def stacked(accuracy: float) -> Solution:
    mesh = bk.MeshOptions(accuracy=accuracy, rising_degrees=True)
    solution: Solution = bk.run(replace(stack(), discretisation=bk.Galerkin(2), mesh=mesh))
    return solution


@pytest.mark.slow
def test_bodies_of_an_assembly_leave_out_corners_and_edges() -> None:
    """Corners on the rigid floor and edges that press into another body are known by their exponents."""
    solution = stacked(1e-3)
    assert solution.is_converged
    assert solution.n_elements <= 150
    corners = solution.places.corners
    # the lower block lifts on the left, and the upper one slides outwards on the right
    edge = joined_exponent(
        JoinedWedge(round(0.5 * np.pi, 6), 1.8, 1.0), JoinedWedge(np.pi, 1.8, 1.0), WedgeSide(True, friction=0.3)
    )
    assert [(corner.x, round(corner.exponent, 6)) for corner in corners["lower"][:1]] == [(1.0, SLIDES)]
    for corner, partner in ((corners["lower"][1], "upper"), (corners["upper"][0], "lower")):
        assert (corner.x, corner.y, corner.partner) == (pytest.approx(0.7), 0.5, partner)
        assert corner.exponent == pytest.approx(edge, abs=1e-9)
    assert [len(corners[name]) for name in ("lower", "upper")] == [2, 1]
    for name, body in solution.bodies.items():
        near = {k for corner in corners[name] for k in corner.elements}
        parts = np.concatenate(
            [body.mesh.part(part) for part in {"lower": ("floor", "table"), "upper": ("foot",)}[name]]
        )
        left_out = set(parts.tolist()) - set(solution.places.elements(name).tolist())
        assert near < left_out
        x = body.mesh.centres[sorted(left_out - near), 0]
        assert np.abs(np.abs(x - 0.5) - 0.2).max() < 0.01
    told = [text for text in map(str, solution.warnings) if "tractions are singular" in text]
    assert told[0].startswith("Body 'lower': Contact tractions are singular at (1, 0)")
    assert told[1].startswith("Bodies 'lower' and 'upper': Contact tractions are singular at (0.7, 0.5) (r^-0.36)")
    assert len(told) == 2  # the corner between both bodies is one
    assert [corner["body"] for corner in solution.summary()["singular_corners"]] == ["lower", "lower", "upper"]


@pytest.mark.slow
def test_bodies_of_an_assembly_reach_four_digits() -> None:
    solution = stacked(1e-4)
    assert solution.is_converged
    assert solution.n_elements <= 200


def test_corners_of_bodies_whose_law_depends_on_slip_are_known_at_obstacles_alone() -> None:
    law, mesh = bk.SlipWeakening(0.3, 0.2, 1.0), bk.MeshOptions(elements=12)
    solution = bk.run(replace(stack(), law=law, mesh=mesh, steps=(bk.Step(time=1.0),)))
    assert solution.is_converged
    assert [(corner.x, corner.partner) for corner in solution.singular_corners] == [(1.0, "")]
