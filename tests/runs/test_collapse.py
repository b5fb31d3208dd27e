"""Largest load factors of walls and columns: those of rigid blocks, whatever the mesh."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import bemkit as bk
from bemkit.scene.toml import shipped_files
from tests.runs.rigid_limit import collapse_factor, courses
from tests.slow import slow_except

BOND = [[1.0, 1.0, 1.0], [0.5, 1.0, 1.0, 0.5]]
HALVES, WHOLES = [0.5, 1.0, 1.0, 1.0, 1.0, 0.5], [1.0] * 5
WINDOW = [1.0, 0.5, -1.0, 0.5, 1.0], [0.5, 1.0, -1.0, 1.0, 0.5]
TWO_WINDOWS = [1.0, -1.0, 1.0, -1.0, 1.0], [0.5, 0.5, -1.0, 0.5, 0.5, -1.0, 0.5, 0.5]
NARROW = [0.5, 1.0, 1.0, 0.5], [1.0] * 3
OPENING = [[1.0, -1.0, 1.0], [0.5, 0.5, -1.0, 0.5, 0.5], [1.0, -1.0, 1.0], [0.5, 0.5, -1.0, 0.5, 0.5], [1.0, -1.0, 1.0]]

FERRIS_AND_TIN_LOI = {  # patterns and associative factors of examples 1 to 5 [FerrisTinLoi2001]
    0.643: [HALVES, WHOLES] * 3,
    0.580: [HALVES, WHOLES] * 5,
    0.404: [
        *([1.0] * 4, [0.5, 1.0, 1.0, 1.0, 0.5], [1.0] * 4),
        *(WINDOW[1], WINDOW[0], WINDOW[1], WINDOW[0], WINDOW[1]),
        *([1.0] * 4, [0.5, 1.0, 1.0, 1.0, 0.5], [1.0] * 4),
    ],
    0.332: [
        *(HALVES, WHOLES, HALVES),
        *(TWO_WINDOWS[0], TWO_WINDOWS[1], TWO_WINDOWS[0], TWO_WINDOWS[1], TWO_WINDOWS[0]),
        *(HALVES, WHOLES, HALVES),
    ],
    0.240: [
        *(NARROW[0], NARROW[1], NARROW[0], *OPENING),
        *(NARROW[0], NARROW[1], NARROW[0], *OPENING, NARROW[0], NARROW[1], NARROW[0]),
    ],
}


def first_of_top(blocks: np.ndarray) -> int:
    """Return which block is pushed: the first one of the uppermost course."""
    return int(np.argmax(blocks[:, 3]))


def assembly_of(
    blocks: np.ndarray, friction: float, elements: int, *, turn: float = 0.0, push: bool = False
) -> bk.Scene:
    """Return rectangular blocks on ground, of weight one; what grows is a force to the right.

    The force is on all blocks and as large as their weight, or a pressure of one on the left end of the
    uppermost course.
    The whole is turned about the origin.
    """
    place = bk.Placement((0.0, 0.0), turn)
    down, right = ((float(x), float(y)) for x, y in place.turned(np.array([[0.0, -1.0], [1.0, 0.0]])))
    up = (-down[0], -down[1])
    weight = bk.Gravity(1.0, down, is_constant=True)
    forces = (weight,) if push else (weight, bk.Gravity(1.0, right))
    ground, pushed = (
        bk.Part("ground", bk.Contact(bk.RigidHalfPlane((0.0, 0.0), up)), ("bottom",)),
        bk.Part("push", bk.Pressure(1.0), ("left",)),
    )
    bodies = tuple(
        bk.Body(
            name=f"block {number}",
            shape=bk.Rectangle(x1 - x0, y1 - y0),
            material=bk.Material(1e4, 0.2),
            parts=(ground,) * (y0 == 0.0) + (pushed,) * (push and number == first_of_top(blocks)),
            body_forces=forces,
            placement=place.after(bk.Placement((x0, y0))),
            mesh=bk.MeshOptions(elements=elements),
        )
        for number, (x0, y0, x1, y1) in enumerate(blocks.tolist())
    )
    return bk.Scene(title="Blocks", bodies=bodies, touching=bk.Touching(1e-3), law=bk.Coulomb(friction))


def factor_of(blocks: np.ndarray, friction: float, *, push: bool = False) -> float:
    """Return the factor of the same blocks by the independent programme."""
    sizes = blocks[:, 2:] - blocks[:, :2]
    dead, live = np.zeros((len(blocks), 3)), np.zeros((len(blocks), 3))
    dead[:, 1] = -sizes.prod(axis=1)
    if push:
        top = first_of_top(blocks)
        live[top, 0] = sizes[top, 1]
    else:
        live[:, 0] = sizes.prod(axis=1)
    return collapse_factor(blocks, friction, dead, live)


STACK = np.array([[0.0, 0.0, 1.0, 1.0], [0.1, 1.0, 1.1, 1.7], [-0.2, 1.7, 0.9, 2.9], [0.3, 2.9, 0.8, 3.2]])
ARCADE = np.array(
    [[0.0, 0.0, 1.0, 3.0], [4.0, 0.0, 5.0, 3.0], [-0.2, 3.0, 2.3, 3.8], [2.3, 3.0, 5.2, 3.8], [1.0, 3.8, 3.5, 4.5]]
)
OWN = {
    "column that tips": (courses([[1.0]] * 5, 1.0, 1.0), 0.7, False),
    "column that slides": (courses([[1.0]] * 2, 2.0, 0.5), 0.3, False),
    "crooked stack": (STACK, 0.65, False),
    "crooked stack pushed": (STACK, 0.9, True),
    "short wall": (courses(BOND * 2, 2.0, 1.0), 0.65, False),
    "tall wall": (courses(BOND * 4, 1.5, 1.0), 0.6, False),
    "tall wall pushed": (courses(BOND * 3, 1.5, 1.0), 0.9, True),
    "wall with a window": (courses([*BOND, [1.0, -1.0, 1.0], *BOND], 2.0, 0.8), 0.65, False),
    "joints of a thousandth": (courses([[1.001, 1.0], [1.0, 1.001]] * 2, 1.0, 1.2), 0.65, False),
    "stack bond": (courses([[1.0, 1.0, 1.0]] * 4, 1.0, 0.7), 0.4, False),
    "arcade": (ARCADE, 0.65, False),
}


@pytest.mark.parametrize(
    ("name", "elements"),
    slow_except(
        product(OWN, (4, 11, 24)),
        *((name, 4) for name in ("column that tips", "column that slides")),
        *(("crooked stack", 11), ("crooked stack pushed", 4)),
    ),
)
def test_the_factor_is_that_of_rigid_blocks_whatever_the_mesh(name: str, elements: int) -> None:
    blocks, friction, push = OWN[name]
    expected = factor_of(blocks, friction, push=push)
    assert expected > 0.01
    for turn in (0.0, 25.0):
        found = bk.largest_load_factor(assembly_of(blocks, friction, elements, turn=turn, push=push))
        assert found == pytest.approx(expected, rel=1e-6)  # accuracy of linear programmes


@pytest.mark.slow
@pytest.mark.parametrize("factor", FERRIS_AND_TIN_LOI)
def test_walls_of_ferris_and_tin_loi_have_their_associative_factors(factor: float) -> None:
    blocks = courses(FERRIS_AND_TIN_LOI[factor], 4.0, 1.75)
    assert bk.largest_load_factor(assembly_of(blocks, 0.65, 4)) == pytest.approx(factor, rel=2e-3)


COULOMB = {0.643: 0.640, 0.580: 0.563, 0.404: 0.356, 0.332: 0.264, 0.240: 0.215}
"""Coulomb factors of the same walls by their associative ones [FerrisTinLoi2001]."""


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "expected"), COULOMB.items())
def test_the_coulomb_factor_of_ferris_and_tin_loi_is_bracketed(factor: float, expected: float) -> None:
    found = bk.coulomb_load_factor(assembly_of(courses(FERRIS_AND_TIN_LOI[factor], 4.0, 1.75), 0.65, 4))
    assert found.factor == pytest.approx(expected, abs=6e-4)  # three printed digits
    assert found.associative == pytest.approx(factor, abs=6e-4)
    assert 0.98 * found.factor <= found.held < found.factor  # at most 2 % wide
    assert 0.98 * found.factor <= found.smallest <= found.factor < found.associative


@pytest.mark.slow
def test_coulomb_and_associative_factors_agree_where_one_motion_is_possible() -> None:
    """Two columns that slide or tip alone, and a block with cohesion 0.3 on a length of 2."""
    for name, expected in (("column that slides", 0.3), ("column that tips", 0.2)):
        blocks, friction, _ = OWN[name]
        found = bk.coulomb_load_factor(assembly_of(blocks, friction, 4))
        assert found.factor == pytest.approx(expected, rel=1e-6)  # accuracy of linear programmes
        assert found.smallest == pytest.approx(expected, rel=1e-6)
        assert found.held == pytest.approx(0.99 * expected, rel=1e-5)
    block = assembly_of(np.array([[0.0, 0.0, 2.0, 1.0]]), 0.0, 7, push=True)
    found = bk.coulomb_load_factor(replace(block, law=bk.CohesiveCoulomb(0.4, 0.3)))
    assert found.factor == pytest.approx(1.4, rel=1e-6)


def test_coulomb_factors_without_bound_and_what_is_refused() -> None:
    block = assembly_of(np.array([[0.0, 0.0, 2.0, 1.0]]), 0.5, 4)
    assert bk.coulomb_load_factor(replace(block, bodies=(replace(block.bodies[0], body_forces=()),))).factor == np.inf
    with pytest.raises(bk.InputError, match="a friction law has a cap: "):
        bk.coulomb_load_factor(replace(block, law=bk.CohesiveCoulomb(0.9, 0.0, 0.25)))
    rising = (bk.Gravity(1.0, (0.0, 1.0), is_constant=True), bk.Gravity(1.0, (1.0, 0.0)))
    with pytest.raises(bk.InputError, match="no contact tractions can balance the constant load"):
        bk.coulomb_load_factor(replace(block, bodies=(replace(block.bodies[0], body_forces=rising),)))
    with pytest.raises(bk.InputError, match="no state of collapse was found: use largest_load_factor"):
        bk.coulomb_load_factor(block, most_programmes=0)


def test_a_block_that_overhangs_a_table_tips_about_its_edge() -> None:
    """A load on the right end of a block whose middle is 0.3 inside of the edge, between two nodes."""
    table = bk.RigidPolygon(((-2.0, 0.0), (1.3, 0.0), (1.3, -1.0), (-2.0, -1.0)))
    block = bk.Body(
        name="block",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(1.0, 0.2),
        parts=(
            bk.Part("foot", bk.Contact(table), ("bottom",)),
            bk.Part("load", bk.Traction(0.0, -1.0), ("right",)),
        ),
        body_forces=(bk.Gravity(1.0, (0.0, -1.0), is_constant=True),),
    )
    assembly = bk.Scene(title="Overhang", bodies=(block,), law=bk.Coulomb(0.5))
    for elements in (6, 35):
        found = bk.largest_load_factor(replace(assembly, mesh=bk.MeshOptions(elements=elements)))
        assert found == pytest.approx(2.0 * 0.3 / 0.7, rel=1e-6)


def test_friction_that_needs_no_pressure_counts_by_the_length_of_a_joint() -> None:
    """A block of weight 2 on a length of 2: cohesion 0.3 and friction 0.4 hold 1.4, a cap of 0.25 holds 0.5."""
    blocks = np.array([[0.0, 0.0, 2.0, 1.0]])
    for law, held in (
        (bk.CohesiveCoulomb(0.4, 0.3), 1.4),
        (bk.Tresca(0.25), 0.5),
        (bk.CohesiveCoulomb(0.9, 0.0, 0.25), 0.5),
    ):
        assembly = replace(assembly_of(blocks, 0.0, 7, push=True), law=law)
        assert bk.largest_load_factor(assembly) == pytest.approx(held, rel=1e-6)


def test_a_rigid_punch_slides_off_under_what_friction_holds() -> None:
    base = bk.Body(
        name="base",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("foot", bk.Clamped(), ("bottom",)),),
    )
    square = bk.RigidPolygon(((0.53, 1.0), (1.5, 1.0), (1.5, 1.5), (0.53, 1.5)))
    punch = bk.RigidBody(name="punch", obstacle=square, centre=(1.0, 1.0), force_y=-0.01, force_x=0.001, moment=0.0)
    assembly = bk.Scene(
        title="Punch",
        bodies=(base,),
        rigid=(punch,),
        contacts=(bk.ContactPair(("base.top", "punch")),),
        law=bk.Coulomb(0.3),
    )
    assert bk.largest_load_factor(assembly) == np.inf  # all of its load grows, and friction 0.3 holds 0.003
    heavier = replace(punch, force_x=0.0031)
    assert bk.largest_load_factor(replace(assembly, rigid=(heavier,))) == pytest.approx(0.0, abs=1e-6)


def test_round_off_between_equal_factors_of_collapse_is_no_contradiction() -> None:
    """The uppermost course of the wall of bemkit new, three blocks of 0.08 m^2, pushed by 0.8 kN."""
    wall = bk.scene_from_toml(shipped_files("new")["wall"].read_text("utf-8"))
    found = bk.coulomb_load_factor(wall)
    assert found.factor == pytest.approx(0.6 * 3 * 0.08 * 1.8 * 9.81 / 0.8, rel=1e-6)


def test_a_block_under_a_ceiling_slides_without_dilation_though_forces_can_wedge_it() -> None:
    """Weight 2 and friction 0.4 hold 0.8 unless the ceiling presses; sliding that dilates is impossible."""
    block = assembly_of(np.array([[0.0, 0.0, 2.0, 1.0]]), 0.4, 4, push=True)
    (body,) = block.bodies
    ceiling = bk.Part("ceiling", bk.Contact(bk.RigidHalfPlane((0.0, 1.0), (0.0, -1.0))), ("top",))
    found = bk.coulomb_load_factor(replace(block, bodies=(replace(body, parts=(*body.parts, ceiling)),)))
    assert found.associative == np.inf
    assert found.factor == pytest.approx(0.8, rel=1e-6)
    assert found.smallest == pytest.approx(0.8, rel=1e-6)
