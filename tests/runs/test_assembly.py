"""Several bodies: patches, weights, cylinders, an arch that stands and falls, histories."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import bemkit as bk
from bemkit.errors import InputError
from bemkit.model.contacts import OverlapError
from bemkit.results.solution import Solution
from bemkit.runs.adaptive import run_adaptive
from bemkit.runs.steps import UnsolvableSceneError
from tests.slow import slow_except

STEEL = bk.Material(1.0, 0.3)
SHEAR = 0.2
"""Beside the pressure one: less than friction 0.5 can hold."""


def patch(degree: int, elements: tuple[int, int] = (28, 44), turn: float = 0.0) -> bk.Scene:
    """Two squares on each other under a pressure of one and a shear, the lower one held as the exact field moves.

    Both stresses are uniform: u = (nu (1 + nu) x + 2 (1 + nu) tau y, -(1 - nu^2) y) / E.
    """
    nu = STEEL.poisson_ratio
    gradient = np.array([[nu * (1 + nu), 2 * (1 + nu) * SHEAR], [0.0, nu**2 - 1]])
    stress = np.array([[0.0, SHEAR], [SHEAR, -1.0]])
    turned = bk.Placement(turn=turn)
    rotation = turned.rotation
    gradient, stress = rotation @ gradient @ rotation.T, rotation @ stress @ rotation.T

    def load(name: str, normal: tuple[float, float]) -> bk.Part:
        x, y = (stress @ rotation @ np.array(normal)).tolist()
        return bk.Part(f"load {name}", bk.Traction(x, y), (name,))

    def given(row: int) -> object:
        return lambda x, y: gradient[row, 0] * x + gradient[row, 1] * y

    sides = (load("left", (-1.0, 0.0)), load("right", (1.0, 0.0)))
    base = bk.Part("base", bk.PrescribedDisplacement(given(0), given(1)), ("bottom",))  # type: ignore[arg-type]
    shape = bk.Rectangle(1.0, 1.0)
    lower = bk.Body(
        name="lower",
        shape=shape,
        material=STEEL,
        parts=(base, *sides),
        placement=turned,
        mesh=bk.MeshOptions(elements=elements[1]),
    )
    upper = bk.Body(
        name="upper",
        shape=shape,
        material=STEEL,
        parts=(load("top", (0.0, 1.0)), *sides),
        placement=turned.after(bk.Placement((0.0, 1.0))),
        mesh=bk.MeshOptions(elements=elements[0]),
    )
    return bk.Scene(
        title="Patch",
        bodies=(lower, upper),
        contacts=(bk.ContactPair(("upper.bottom", "lower.top")),),
        law=bk.Coulomb(0.5),
        discretisation=bk.Galerkin(degree),
    )


def test_a_body_that_touches_nothing_is_solved_beside_the_others() -> None:
    """Held by supports of its own, under a load of its own, between the others in the list."""
    pair = patch(2)
    parts = (bk.Part("base", bk.Clamped(), ("bottom",)), bk.Part("load", bk.Traction(y=-1.0), ("top",)))
    lone = bk.Body(
        name="lone",
        shape=bk.Rectangle(1.0, 1.0),
        material=STEEL,
        parts=parts,
        placement=bk.Placement((7.0, 0.0)),
        mesh=bk.MeshOptions(elements=24),
    )
    solution = bk.run(replace(pair, bodies=(pair.bodies[0], lone, pair.bodies[1])))
    assert solution.is_converged
    np.testing.assert_allclose(solution.contact.sigma_n, -1.0, atol=1e-10)
    scene = bk.Scene(
        title="lone",
        shape=lone.shape,
        material=STEEL,
        parts=parts,
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(elements=24),
    )
    alone = bk.run(scene)
    # round-off of a stiffness condensed to nothing, and of a load that is scaled by that of all bodies
    expected = alone.boundary.displacement
    np.testing.assert_allclose(solution.bodies["lone"].boundary.displacement, expected, atol=1e-11)
    assert solution.bodies["lone"].energy == pytest.approx(alone.energy, rel=1e-11)


@pytest.mark.parametrize("degree", [1, 2, 4])
@pytest.mark.parametrize("turn", slow_except([0.0, 33.0], 33.0))
def test_uniform_pressure_and_shear_pass_a_joint_of_meshes_that_do_not_match(degree: int, turn: float) -> None:
    """Also an inclined one, whose upper body is a turned copy of its own mesh."""
    solution = bk.run(patch(degree, turn=turn))
    assert solution.is_converged
    # round-off of bodies of condition 1e3 to 1e4; a mortar that is not exact leaves 5 to 30 %
    np.testing.assert_allclose(solution.contact.sigma_n, -1.0, atol=1e-10)
    np.testing.assert_allclose(solution.contact.sigma_t, -SHEAR, atol=1e-10)
    (contact,) = solution.contacts
    assert contact.contact_length == pytest.approx(1.0, rel=1e-12)
    tractions = solution.bodies["upper"].boundary.traction[solution.bodies["upper"].mesh.part("bottom")]
    others = solution.bodies["lower"].boundary.traction[solution.bodies["lower"].mesh.part("top")]
    assert np.abs(tractions - tractions[0]).max() < 1e-9
    np.testing.assert_allclose(others, -tractions[0] + 0.0 * others, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("degree", "turn"), list(product((2, 4), (0.0, 33.0))))
def test_nine_blocks_pass_the_patch(degree: int, turn: float) -> None:
    """Three by three, every block with another number of elements, under two pressures and a shear, held below.

    The strains of a uniform stress are ``((1 + nu) sigma - nu (1 + nu) tr(sigma) I) / E``.
    """
    placed, nu = bk.Placement(turn=turn), STEEL.poisson_ratio
    turned = placed.rotation
    stress = turned @ np.array([[-0.6, SHEAR], [SHEAR, -1.0]]) @ turned.T
    strain = (1.0 + nu) * (stress - nu * np.trace(stress) * np.eye(2))
    base = bk.PrescribedDisplacement(*((lambda x, y, row=row: row[0] * x + row[1] * y) for row in strain))
    normals = {"left": (-1.0, 0.0), "right": (1.0, 0.0), "top": (0.0, 1.0)}
    loads = {name: bk.Traction(*(stress @ turned @ normal).tolist()) for name, normal in normals.items()}
    counts = np.random.default_rng(0).permutation(np.arange(12, 48, 4))
    blocks = []
    for k in range(9):
        column, row = k % 3, k // 3
        outer = {"left": column == 0, "right": column == 2, "top": row == 2}
        conditions = {side: loads[side] for side, is_outer in outer.items() if is_outer}
        if row == 0:
            conditions["bottom"] = base
        blocks.append(
            bk.Body(
                name=f"block {k}",
                shape=bk.Rectangle(1.0, 1.0),
                material=STEEL,
                parts=tuple(bk.Part(side, condition, (side,)) for side, condition in conditions.items()),
                placement=placed.after(bk.Placement((float(column), float(row)))),
                mesh=bk.MeshOptions(elements=int(counts[k])),
            )
        )
    wall = bk.Scene(
        title="Nine blocks",
        bodies=tuple(blocks),
        touching=bk.Touching(1e-6),
        law=bk.Coulomb(0.5),
        discretisation=bk.Galerkin(degree),
    )
    solution = bk.run(wall)
    assert solution.is_converged
    assert len(solution.contacts) == 12
    normal = solution.contact_directions
    tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    for found, along in ((solution.contact.sigma_n, normal), (solution.contact.sigma_t, tangent)):
        exact = np.einsum("nc,cd,nd->n", along, stress, normal)
        np.testing.assert_allclose(found, exact, atol=1e-10)  # round-off, condition 1e4


def test_columns_between_smooth_walls_settle_under_their_weight() -> None:
    """One on the other: pressures, settlements and reactions of `references-bodies`, exact for quadratic elements."""

    def column(name: str, bottom: float, height: float, modulus: float, nu: float, weight: float) -> bk.Body:
        return bk.Body(
            name=name,
            shape=bk.Rectangle(1.0, height),
            material=bk.Material(modulus, nu),
            parts=(bk.Part("walls", bk.Roller(), ("left", "right")),),
            placement=bk.Placement((0.0, bottom)),
            body_forces=(bk.Gravity(weight, (0.0, -1.0)),),
            mesh=bk.MeshOptions(elements=24),
        )

    lower = column("lower", 0.0, 1.5, 2.0, 0.2, 2.0)
    lower = replace(lower, parts=(*lower.parts, bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), ("bottom",))))
    upper = column("upper", 1.5, 1.0, 1.0, 0.3, 1.0)
    pair = bk.ContactPair(("upper.bottom", "lower.top"))
    solution = bk.run(bk.Scene(title="Columns", bodies=(lower, upper), contacts=(pair,), discretisation=bk.Galerkin(2)))
    between, floor = solution.contacts
    assert (between.force_y, floor.force_y) == pytest.approx((1.0, 4.0), rel=1e-12)  # sums of fifty numbers
    rows = solution.contact.rows("lower.floor")
    np.testing.assert_allclose(solution.contact.sigma_n[rows], -4.0, atol=1e-10)
    for name, top, settlement in (("lower", 1.5, 1.6875), ("upper", 2.5, 2.05892857142857)):
        boundary = solution.bodies[name].boundary
        at_top = boundary.points[:, 1] > top - 1e-9
        np.testing.assert_allclose(boundary.displacement[at_top, 1], -settlement, atol=1e-10)


@pytest.mark.slow
def test_two_cylinders_are_those_of_hertz() -> None:
    """To 0.2 % at an accuracy of 0.3 %; the finite cylinders themselves differ from Hertz by 1e-4."""
    solution = bk.run(replace(bk.load_scene("two-cylinders"), mesh=bk.MeshOptions(accuracy=3e-3)))
    assert solution.is_converged
    (contact,) = solution.contacts
    half_width = np.sqrt(4.0 * contact.force_normal / np.pi)  # R = 1/2, E* = 1/2
    peak = 2.0 * contact.force_normal / (np.pi * half_width)
    assert contact.contact_length / 2.0 == pytest.approx(half_width, rel=2e-3)
    assert contact.peak_pressure == pytest.approx(peak, rel=2e-3)
    # alike bodies in the mean of both normals: no shear; with the normals of one it is 4 to 11 % of the peak
    assert np.abs(solution.contact.sigma_t).max() < 1e-3 * peak
    assert 0.0 < solution.estimated_error < 3e-3


@pytest.mark.slow
def test_meshes_follow_the_solution_on_both_sides() -> None:
    assembly = replace(bk.load_scene("two-cylinders"), mesh=bk.MeshOptions(accuracy=0.02))
    solutions = run_adaptive(assembly)
    assert len(solutions) > 1
    for body in solutions[-1].bodies.values():
        near = np.abs(body.mesh.centres[:, 0]) < 0.05
        assert body.mesh.lengths[near].max() < 0.05 * body.mesh.lengths[~near].max()
    assert solutions[-1].linear_solves > solutions[0].linear_solves


@pytest.mark.slow
def test_an_accuracy_out_of_reach_is_said() -> None:
    assembly = replace(bk.load_scene("two-cylinders"), mesh=bk.MeshOptions(accuracy=1e-6, most_elements=60))
    solution = bk.run(assembly)
    assert solution.status is bk.Status.ACCURACY_NOT_REACHED
    assert "more than 60 elements a body would be needed" in solution.message
    assert solution.is_certified
    assert not solution.is_converged


@pytest.mark.parametrize("play", slow_except([0.0, -1e-3], -1e-3))
def test_what_nothing_feels_turns_where_it_slips_least(play: float) -> None:
    """A pin without friction in the hole of a plate that is pulled: its turn does not depend on how it was drawn."""
    turns = []
    rim, hole = (bk.Part(name, bk.Free(), tuple(f"{side}-{k}" for k in range(1, 5))) for name, side in RIMS.items())
    base, pull = bk.Part("base", bk.Clamped(), ("bottom",)), bk.Part("pull", bk.Traction(1e-3, 0.0), ("right",))
    plate = bk.Body(
        name="plate",
        shape=bk.PlateWithHole(1.5, 1.0, 0.3),
        material=bk.Material(1.0, 0.3),
        parts=(hole, base, pull),
        mesh=bk.MeshOptions(elements=60),
    )
    pair = bk.ContactPair(("pin.rim", "plate.hole"), interference=-play)
    for turn in (0.0, 13.0):
        pin = bk.Body(
            name="pin",
            shape=bk.Disk(0.3 - play),
            material=bk.Material(1.0, 0.3),
            parts=(rim,),
            placement=bk.Placement((0.75, 0.5), turn),
            mesh=bk.MeshOptions(elements=40),
        )
        assembly = bk.Scene(title="Pin", bodies=(plate, pin), contacts=(pair,), law=bk.Frictionless())
        solution = bk.run(assembly)
        assert solution.is_converged
        boundary = solution.bodies["pin"].boundary
        arm = boundary.points - boundary.points.mean(axis=0)
        moved = boundary.displacement - boundary.displacement.mean(axis=0)
        turns.append(float(np.sum(arm[:, 0] * moved[:, 1] - arm[:, 1] * moved[:, 0]) / np.sum(arm**2)))
    assert turns[0] == pytest.approx(turns[1], rel=2e-3)  # of two meshes of 40 elements; 40 % apart as responses come


RIMS = {"rim": "arc", "hole": "hole"}


def arch(n: int, thickness: float) -> bk.Scene:
    """A semicircle of mean radius 1 of n wedges under their weight, springings on a rigid floor."""
    angle, inner, outer = 180.0 / n, 1.0 - thickness / 2.0, 1.0 + thickness / 2.0
    end = bk.Placement(turn=angle)
    low, high = ((float(x), float(y)) for x, y in end.forward(np.array([[inner, 0.0], [outer, 0.0]])))
    wedge = bk.Polygon(((inner, 0.0), (outer, 0.0), high, low), ("before", "back", "after", "front"))
    common = {
        "shape": wedge,
        "material": bk.Material(1e5, 0.2),
        "body_forces": (bk.Gravity(1.0, (0.0, -1.0)),),
        "mesh": bk.MeshOptions(elements=40),
    }

    def on_floor(side: str) -> tuple[bk.Part, ...]:
        return (bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), (side,)),)

    bodies = (
        bk.Body(name="first", parts=on_floor("before"), **common),
        bk.Body(name="stone", placement=end, copies=bk.CircleCopies(n - 2, angle), **common),
        bk.Body(name="last", parts=on_floor("after"), placement=bk.Placement(turn=180.0 - angle), **common),
    )
    return bk.Scene(title="Arch", bodies=bodies, touching=bk.Touching(1e-3), law=bk.Coulomb(0.7))


@pytest.mark.slow
def test_an_arch_stands_where_limit_analysis_says_so() -> None:
    """15 blocks: 0.106265824 of the mean radius; hinges of finite pressure cost less than 2 % of it."""
    solution = bk.run(arch(15, 1.02 * 0.106265824))
    assert solution.is_converged
    weight = 15 * solution.bodies["first"].mesh.area
    floors = [one.force_y for one in solution.contacts if one.name.endswith("floor")]
    assert floors == pytest.approx([weight / 2.0, weight / 2.0], rel=1e-9)  # symmetric; round-off of a mechanism


def test_an_arch_that_is_too_thin_falls_by_name() -> None:
    with pytest.raises(UnsolvableSceneError, match=r"bodies 'first', 'stone-1', .* and \d+ more"):
        bk.run(arch(15, 0.98 * 0.106265824))


def test_steps_follow_each_other_and_slip_is_remembered() -> None:
    """Press, then shear by less than friction holds: all sticks, and the shear is what was added."""
    pressed = patch(2)
    upper = pressed.bodies[1]

    def under(shear: float) -> bk.Scene:
        load = bk.Part("load top", bk.Traction(shear, -1.0), ("top",))
        free = tuple(part for part in upper.parts if part.name != "load top")
        sides = tuple(replace(part, condition=bk.Traction(0.0, np.sign(part.condition.y) * shear)) for part in free)
        return replace(pressed, bodies=(pressed.bodies[0], replace(upper, parts=(load, *sides))))

    steps = bk.run([under(0.0), under(0.1), under(SHEAR)])
    assert [step.is_converged for step in steps] == [True] * 3
    assert steps[0].contacts[0].force_tangential == pytest.approx(0.0, abs=1e-12)
    assert steps[1].contacts[0].force_tangential == pytest.approx(-0.1, rel=1e-10)
    assert steps[2].contacts[0].force_tangential == pytest.approx(-SHEAR, rel=1e-10)
    assert steps[2].contacts[0].largest_slip < 1e-12


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"shift": (0.0, 0.9)}, OverlapError, "the bodies overlap by 0.1 at"),
        ({"shift": (0.0, 5.0)}, ValueError, "contact 'upper.bottom / lower.top': the sides at"),
        ({"side": "upper.left"}, ValueError, "body 'upper': discretise: parts 'load left' and 'left' overlap on side"),
        ({"side": "upper.top", "parts": ()}, ValueError, "choose sides whose outward normals point at each other"),
    ],
)
def test_bodies_that_cannot_touch_so_are_named(change: dict[str, object], error: type[Exception], message: str) -> None:
    assembly = patch(1, (12, 12))
    upper = assembly.bodies[1]
    if "shift" in change:
        upper = replace(upper, placement=bk.Placement(change["shift"]))  # type: ignore[arg-type]
    if "parts" in change:
        upper = replace(upper, parts=())
    pair = bk.ContactPair((str(change.get("side", "upper.bottom")), "lower.top"))
    changed = replace(assembly, bodies=(assembly.bodies[0], upper), contacts=(pair,))
    with pytest.raises(error) as caught:
        bk.run(changed)
    assert message in str(caught.value)


def test_an_interference_that_is_given_is_pressed_together() -> None:
    """The middle of the joint of two squares that overlap by d, held at their far ends: strain d / 2 in each."""
    assembly = patch(2)
    clamp = bk.Part("base", bk.PrescribedDisplacement(y=0.0), ("bottom",))
    corner = bk.Part("side", bk.Roller(), ("left",))
    lower = replace(assembly.bodies[0], parts=(clamp, corner))
    upper = replace(assembly.bodies[1], parts=(replace(clamp, sides=("top",)), corner))
    drawn = replace(upper, placement=bk.Placement((0.0, 1.0 - 1e-3)))
    results = []
    for body, pair in (
        (upper, bk.ContactPair(("upper.bottom", "lower.top"), gap=-1e-3)),
        (drawn, bk.ContactPair(("upper.bottom", "lower.top"), interference=2e-3)),
    ):
        solution = bk.run(replace(assembly, bodies=(lower, body), contacts=(pair,), law=bk.Frictionless()))
        assert solution.is_converged
        results.append(solution.contact.sigma_n)
    expected = -STEEL.plane_modulus * 1e-3 / 2.0
    np.testing.assert_allclose(results[0], expected, rtol=1e-9)
    np.testing.assert_allclose(results[1], expected, rtol=1e-9)


def test_what_goes_with_one_body_alone_is_refused() -> None:
    with pytest.raises(bk.InputError, match="mesh is given for 2 bodies: give a mesh for each by its name"):
        bk.run(patch(1), mesh=bk.discretise(bk.Rectangle(1.0, 1.0).outline(), n_elements=8))  # type: ignore[call-overload]
    with pytest.raises(bk.InputError, match="mesh names 'cake': the bodies are "):
        bk.run(patch(1), mesh={"cake": bk.discretise(bk.Rectangle(1.0, 1.0).outline(), n_elements=8)})
    with pytest.raises(bk.InputError, match="scene is an empty sequence"):
        bk.run([])
    with pytest.raises(bk.InputError, match="no two bodies are in contact: list contacts"):
        bk.run(replace(patch(1), contacts=()))


@pytest.mark.slow
def test_what_one_side_feels_the_other_gives_back() -> None:
    """Forces of both sides of a contact, integrated over their own elements, to round-off; so of every block."""
    solution = bk.run(replace(bk.load_scene("two-cylinders"), mesh=bk.MeshOptions(elements=60)))
    upper, lower = ({force.name: force for force in body.part_forces}["tip"] for body in solution.bodies.values())
    (contact,) = solution.contacts
    assert upper.force_y == pytest.approx(contact.force_y, rel=1e-12)
    assert lower.force_y == pytest.approx(-contact.force_y, rel=1e-12)
    wall = bk.Scene(
        title="Three blocks",
        bodies=tuple(
            bk.Body(
                name=name, shape=bk.Rectangle(2.0, 1.0), material=STEEL, parts=parts,
                body_forces=(bk.Gravity(1.0, (0.0, -1.0)),), placement=bk.Placement(place),
                mesh=bk.MeshOptions(elements=24),
            )
            for name, place, parts in (
                ("left", (0.0, 0.0), (bk.Part("floor", bk.Clamped(), ("bottom",)),)),
                ("right", (2.0, 0.0), (bk.Part("floor", bk.Clamped(), ("bottom",)),)),
                ("top", (1.0, 1.0), ()),
            )
        ),
        touching=bk.Touching(1e-6),
        law=bk.Coulomb(0.5),
    )  # fmt: skip
    solution = bk.run(wall)
    (bottom,) = (force for force in solution.bodies["top"].part_forces if force.name == "bottom")
    assert bottom.force_y == pytest.approx(2.0, rel=1e-12)  # its weight, on two blocks that share its lower side


@pytest.mark.parametrize("degree", slow_except([1, 2, 4], 1, 4))
@pytest.mark.parametrize("multipliers_on", ["upper.bottom", "lower.top"])
def test_forces_are_passed_on_whole_where_a_partner_ends_inside_an_element(degree: int, multipliers_on: str) -> None:
    """On the elements of both sides as at the nodes; the moment is that of the load, 1 at the middle x = 0.83."""
    lower, upper = (
        bk.Body(
            name=name,
            shape=bk.Rectangle(width, 1.0),
            material=STEEL,
            parts=(part,),
            placement=bk.Placement(place),
            mesh=bk.MeshOptions(elements=26),
        )
        for name, width, part, place in (
            ("lower", 2.0, bk.Part("base", bk.Clamped(), ("bottom",)), (0.0, 0.0)),
            ("upper", 1.0, bk.Part("load", bk.Traction(0.0, -1.0), ("top",)), (0.33, 1.0)),
        )
    )
    pair = bk.ContactPair(("upper.bottom", "lower.top"), multipliers_on=multipliers_on)
    solution = bk.run(
        bk.Scene(title="Offset", bodies=(lower, upper), contacts=(pair,), discretisation=bk.Galerkin(degree))
    )
    sides = {"upper.bottom": 1.0, "lower.top": -1.0}
    (contact,) = solution.contacts
    assert contact.force_y == pytest.approx(sides["upper.bottom"], rel=1e-12)  # on the first side of its name
    assert contact.moment == pytest.approx(0.83 * sides["upper.bottom"], rel=1e-10)
    for name, expected in sides.items():
        body, side = name.split(".")
        (force,) = (force for force in solution.bodies[body].part_forces if force.name == side)
        assert force.force_y == pytest.approx(expected, rel=1e-12)  # sums of fifty numbers
        # constant tractions on linear elements know the moment to the square of the length of one
        assert force.moment == pytest.approx(0.83 * expected, rel=0.05 if degree == 1 else 1e-10)


def test_a_body_whose_energy_can_be_negative_is_named() -> None:
    """A slit that closes, by constant elements longer than its lips are thick: they push back the wrong way."""
    names = ("bottom", "right low", "lip low", "root", "lip high", "right high", "top", "left")
    corners = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.48), (0.3, 0.48), (0.3, 0.52), (1.0, 0.52), (1.0, 1.0), (0.0, 1.0))
    split = bk.Body(
        name="split",
        shape=bk.Polygon(corners, names),
        material=bk.Material(1.0, 0.4999),
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)), bk.Part("load", bk.Traction(y=-0.001), ("top",))),
        mesh=bk.MeshOptions(elements=9),
    )
    pair = bk.ContactPair(("split.lip low", "split.lip high"), gap=-0.041)
    solution = bk.run(
        bk.Scene(title="Split", bodies=(split,), contacts=(pair,), discretisation=bk.ConstantCollocation())
    )
    assert solution.status is bk.Status.NEGATIVE_ENERGY
    assert "body 'split'" in solution.message


def _between_soft_ones(ratio: float) -> Solution:
    """Two bodies on each other, so many times stiffer than those below and above them, pressed and sheared."""
    foot, load = bk.Part("foot", bk.Clamped(), ("bottom",)), bk.Part("top", bk.Traction(x=2e-3, y=-1e-2), ("top",))
    given = (("a", 1.0, (foot,)), ("b", ratio, ()), ("c", ratio, ()), ("d", 1.0, (load,)))
    bodies = tuple(
        bk.Body(
            name=name,
            shape=bk.Rectangle(1.0, 0.5),
            material=bk.Material(modulus, 0.3),
            parts=parts,
            placement=bk.Placement((0.0, 0.5 * number)),
        )
        for number, (name, modulus, parts) in enumerate(given)
    )
    contacts = tuple(bk.ContactPair((f"{low}.top", f"{high}.bottom")) for low, high in ("ab", "bc", "cd"))
    mesh = bk.MeshOptions(elements=40)
    return bk.run(bk.Scene(title="Stiff", bodies=bodies, contacts=contacts, law=bk.Coulomb(0.3), mesh=mesh))


@pytest.mark.slow
def test_stiff_bodies_between_soft_ones_touch_each_other() -> None:
    """They travel so far with the soft ones that round-off of the way is a force: responses are refined."""
    stiff, stiffer = _between_soft_ones(1e6), _between_soft_ones(1e8)
    assert stiff.is_converged, stiff.message
    assert stiffer.is_converged, stiffer.message
    # of the soft bodies, which see no difference but 1e-6 of the strains
    for part in ("a.top / b.bottom", "c.top / d.bottom"):
        one, other = (each.contact.sigma_n[each.contact.rows(part)] for each in (stiff, stiffer))
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-5 * np.abs(one).max())


@pytest.mark.slow
def test_round_off_of_a_long_way_is_refined_on_graded_meshes() -> None:
    """A plate moves fifty times as far to its pin as both deform; its support carries more than the contact."""
    elastic = bk.Material(1.0, 0.3)
    hold = bk.Part("hold", bk.PrescribedDisplacement(0.0, 0.0), ("arc-1",), lambda x, y: x > 0.9)
    pull = bk.Part("pull", bk.PrescribedDisplacement(0.0051, 0.0), ("left",))
    scene = bk.Scene(
        title="Pin",
        discretisation=bk.Galerkin(2),
        bodies=(
            bk.Body(name="pin", shape=bk.Disk(0.995), material=elastic, parts=(hold,)),
            bk.Body(
                name="plate",
                shape=bk.PlateWithHole(4.0, 5.0, 1.0, corner=(-2.0, -2.5)),
                material=elastic,
                parts=(pull,),
            ),
        ),
        contacts=(bk.ContactPair(("pin.arc-2, arc-3", "plate.hole-2, hole-3")),),
        mesh=bk.MeshOptions(elements=60, grading=bk.Geometric(0.3, 4)),
    )
    assert bk.run(scene).certificate.force_imbalance < 1e-11  # a hundredth of the tolerance of solves


def test_names_of_touching_contacts_say_which_side_has_the_multipliers() -> None:
    parts = {
        "lower": bk.Part("floor", bk.Clamped(), ("bottom",)),
        "upper": bk.Part("press", bk.Pressure(1e3), ("top",)),
    }
    blocks = tuple(
        bk.Body(
            name=name, shape=bk.Rectangle(1.0, 1.0), material=STEEL, parts=(part,),
            placement=bk.Placement((0.0, height)), mesh=bk.MeshOptions(elements=16),
        )
        for height, (name, part) in enumerate(parts.items())
    )  # fmt: skip
    for name in ("lower.top / upper.bottom", "upper.bottom / lower.top"):
        touching = bk.Touching(1e-6, names=(name,))
        solution = bk.run(bk.Scene(title="Two blocks", bodies=blocks, touching=touching, law=bk.Frictionless()))
        ((found, sides),) = solution.contact_sides.items()
        assert found == name == " / ".join(".".join(side) for side in sides)
    wrong = bk.Touching(1e-6, names=("lower.top / upper.base",))
    with pytest.raises(
        InputError, match=r"touching.names has 'lower.top / upper.base': give 'side / side' of the free"
    ):
        bk.run(bk.Scene(title="Two blocks", bodies=blocks, touching=wrong, law=bk.Frictionless()))
