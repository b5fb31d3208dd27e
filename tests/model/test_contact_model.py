"""Scenes as wholes: units, position, reflection and the seat of the origin change nothing but the units."""

from __future__ import annotations

import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import bemkit as bk
from bemkit.errors import NoResultError
from bemkit.model.prepared import prepare
from bemkit.testing import check_solution
from tests.slow import slow_except

ELEMENTS = [bk.Galerkin(1), bk.ConstantCollocation()]


def scene(
    length: float = 1.0, stress: float = 1.0, shift: tuple[float, float] = (0.0, 0.0), mirror: bool = False
) -> bk.Scene:
    """Example 1 with lengths in units of `length` and stresses in units of `stress`, moved and mirrored."""
    x, y = shift
    half_x, half_y = x + 0.5 * length, y + 0.5 * length
    wall, pushed = ("left", "right") if mirror else ("right", "left")
    return bk.Scene(
        title="example 1 in other units",
        shape=bk.Rectangle(length, length, corner=shift),
        material=bk.Material(1e4 * stress, 0.2),
        law=bk.Coulomb(0.5),
        mesh=bk.MeshOptions(96, bk.Algebraic(1.5)),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane(point=(x, y))), sides=("bottom",)),
            bk.Part("wall", bk.Roller(), sides=(wall,)),
            bk.Part("top", bk.Traction(y=-stress), ("top",), lambda x, y: x < half_x if mirror else x > half_x),
            bk.Part("side", bk.Traction(x=-stress if mirror else stress), (pushed,), lambda x, y: y > half_y),
        ),
    )


@pytest.mark.parametrize("discretisation", slow_except(ELEMENTS, ELEMENTS[1]))
@pytest.mark.parametrize(
    ("length", "stress", "shift"),
    [
        (1e-9, 1.0, (0.0, 0.0)),
        (1e9, 1e-12, (0.0, 0.0)),
        (1.0, 1e12, (0.0, 0.0)),
        (1e-3, 1e6, (5.0, -3.0)),
        (1.0, 1.0, (1e4, 1e4)),
    ],
)
def test_units_and_position_change_only_the_units(
    discretisation: object, length: float, stress: float, shift: tuple[float, float]
) -> None:
    base = bk.run(dataclasses.replace(scene(), discretisation=discretisation))
    other = bk.run(dataclasses.replace(scene(length, stress, shift), discretisation=discretisation))
    assert base.is_converged
    assert other.is_converged
    assert other.linear_solves == base.linear_solves
    np.testing.assert_array_equal(other.contact.status, base.contact.status)
    # the coordinates of a moved body carry eps |x| / L, a thousand times that reaches small displacements
    tolerance = 1e-11 + 1e3 * np.finfo(float).eps * np.hypot(*shift) / length
    for name, unit in (("u_n", length), ("u_t", length), ("sigma_n", stress), ("sigma_t", stress)):
        expected = getattr(base.contact, name)
        np.testing.assert_allclose(
            getattr(other.contact, name) / unit, expected, atol=tolerance * np.abs(expected).max()
        )
    assert other.energy / (stress * length**2) == pytest.approx(base.energy, rel=10 * tolerance)


@pytest.mark.parametrize("discretisation", [bk.Galerkin(1), bk.ConstantCollocation()])
def test_the_mirror_image_has_mirrored_results(discretisation: object) -> None:
    base = bk.run(dataclasses.replace(scene(), discretisation=discretisation))
    other = bk.run(dataclasses.replace(scene(mirror=True), discretisation=discretisation))
    assert other.linear_solves == base.linear_solves
    np.testing.assert_allclose(other.contact.sigma_n[::-1], base.contact.sigma_n, atol=1e-11)
    np.testing.assert_allclose(other.contact.sigma_t[::-1], -base.contact.sigma_t, atol=1e-11)
    assert other.force_tangential == pytest.approx(-base.force_tangential, rel=1e-11)


def test_an_interference_or_a_prescribed_motion_alone_sets_the_scale() -> None:
    block = dataclasses.replace(scene(), law=bk.Frictionless())
    wall = block.parts[1]
    pushed = bk.Part("top", bk.PrescribedDisplacement(y=-1e-3), sides=("top",))
    floor = bk.Part("floor", bk.Contact(bk.RigidHalfPlane(point=(0.0, 0.0))), sides=("bottom",))
    oedometric = 1e4 * 0.8 / (1.2 * 0.6)
    left = bk.Part("left", bk.Roller(), sides=("left",))
    solution = bk.run(dataclasses.replace(block, parts=(floor, wall, pushed, left)))
    np.testing.assert_allclose(solution.contact.sigma_n, -1e-3 * oedometric, rtol=1e-10)
    raised = bk.Part("floor", bk.Contact(bk.RigidHalfPlane(point=(0.0, 1e-3))), sides=("bottom",))
    held = bk.Part("top", bk.Roller(), sides=("top",))
    squeezed = bk.run(dataclasses.replace(block, parts=(raised, wall, held, left)))
    np.testing.assert_allclose(squeezed.contact.sigma_n, -1e-3 * oedometric, rtol=1e-10)


def test_pressure_acts_against_the_normal_on_every_side() -> None:
    block = scene()
    parts = (block.parts[0], *(bk.Part(side, bk.Pressure(2.0), sides=(side,)) for side in ("right", "top", "left")))
    solution = bk.run(dataclasses.replace(block, parts=parts, law=bk.Coulomb(0.5), discretisation=bk.Galerkin(1)))
    assert solution.force_normal == pytest.approx(2.0, rel=1e-12)
    assert solution.force_tangential == pytest.approx(0.0, abs=1e-10)


@pytest.mark.parametrize("discretisation", [bk.Galerkin(1), bk.Galerkin(2), bk.ConstantCollocation()])
def test_a_body_in_contact_all_round(discretisation: object) -> None:
    shrunk = bk.Scene(
        title="disk in a cavity that is too small",
        shape=bk.Disk(1.0),
        material=bk.Material(1e4, 0.3),
        law=bk.Coulomb(0.5),
        parts=(bk.Part("all", bk.Contact(bk.RigidCavity((0.0, 0.0), 0.999))),),
        discretisation=discretisation,  # type: ignore[arg-type]
        mesh=bk.MeshOptions(60),
    )
    solution = bk.run(shrunk)
    assert solution.is_converged
    assert solution.contact.status_words() == ["stick"] * solution.contact.n_contact
    # p = E delta / (R (1 + nu) (1 - 2 nu)); elements of 6 degrees are wrong by about their angle squared, 0.011
    np.testing.assert_allclose(solution.contact.sigma_n, -1e4 * 1e-3 / (1.3 * 0.4), rtol=0.01)


def test_several_scenes_can_run_on_an_executor() -> None:
    block = dataclasses.replace(scene(), mesh=bk.MeshOptions(40))
    scenes = [dataclasses.replace(block, law=bk.Coulomb(s)) for s in (0.1, 0.3)]
    with ThreadPoolExecutor(2) as pool:
        parallel = list(pool.map(bk.run, scenes))
    in_turn = [bk.run(each) for each in scenes]
    assert [s.force_tangential for s in parallel] == pytest.approx([s.force_tangential for s in in_turn], rel=1e-13)
    assert parallel[0].force_tangential != pytest.approx(parallel[1].force_tangential)


def test_an_impossible_scene_among_others_fails_alone() -> None:
    block = dataclasses.replace(scene(), mesh=bk.MeshOptions(40))
    lifted = dataclasses.replace(block, parts=(*block.parts[:2], bk.Part("top", bk.Traction(y=0.05), sides=("top",))))
    stopped = dataclasses.replace(
        block, discretisation=bk.ConstantCollocation(), mesh=bk.MeshOptions(240), linear_solver=bk.MatrixFree(1e-10, 1)
    )
    with ThreadPoolExecutor(2) as pool:
        first, second, third, fourth = [pool.submit(bk.run, each) for each in (block, lifted, stopped, block)]
        assert first.result().is_converged
        with pytest.raises(bk.BemkitError, match="the load"):
            second.result()
        with pytest.raises(NoResultError, match="after 1 step of GMRES"):
            third.result()
        assert fourth.result().is_converged


def test_a_body_that_nothing_holds_is_an_error_with_a_remedy() -> None:
    block = scene()
    lifted = (*block.parts[:2], bk.Part("top", bk.Traction(y=0.05), sides=("top",)))
    with pytest.raises(ValueError, match=r"the load .* hold"):
        bk.run(dataclasses.replace(block, parts=lifted))


def test_the_unit_of_stress_is_that_of_the_largest_overlap():
    """An overlap of 1e-3 of the body strains it by as much, a thousand times what a small load does; a gap does not."""
    plain = scene()
    for gap, expected in ((-1e-3, 1e-3), (1e-3, 1e-5)):
        floor = bk.Part("floor", bk.Contact(bk.RigidHalfPlane(point=(0.0, -gap))), sides=("bottom",))
        load = bk.Part("top", bk.Traction(y=-1e-5 * plain.material.plane_modulus), sides=("top",))
        loaded = dataclasses.replace(plain, parts=(floor, load))
        mesh = loaded.build_mesh()
        # lengths in diameters of the unit square
        units = prepare(loaded, mesh).units
        strain = units.stress / units.modulus
        assert strain == pytest.approx(expected / mesh.diameter if gap < 0.0 else expected, rel=1e-12)


@pytest.mark.parametrize("bound", [0.003, np.full(41, 0.003)], ids=["number", "list"])
def test_given_friction_does_not_act_where_the_boundary_faces_away(bound: object) -> None:
    """A punch without friction at its own nodes would hang on given friction beside it, which has another direction."""
    block = bk.Body(
        name="block",
        shape=bk.Rectangle(4.0, 1.0, (-2.0, -1.0)),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
        mesh=bk.MeshOptions(100),
    )
    square = bk.RigidPolygon(((-0.8, 0.0), (0.8, 0.0), (0.8, 1.0), (-0.8, 1.0)))
    solution = bk.run(
        bk.Scene(
            title="punch",
            bodies=(block,),
            rigid=(bk.RigidBody(name="punch", obstacle=square, force_x=0.002, force_y=-0.006),),
            contacts=(bk.ContactPair(("block.top", "punch"), law=bk.Tresca(bound)),),
        )
    )
    assert solution.is_converged
    table = solution.contact
    faces_away = np.isinf(table.gap)
    assert faces_away.any()
    assert not table.sigma_t[faces_away].any()
    assert table.sigma_n @ table.weight == pytest.approx(-0.006, rel=1e-9)  # whole, without friction beside the punch
    check_solution(solution)


def test_the_whole_boundary_of_a_disc_faces_a_block_and_a_rigid_plane() -> None:
    block = bk.Body(
        name="block",
        shape=bk.Rectangle(4.0, 1.0, (-2.0, -1.0)),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
    )
    disc = bk.Body(name="disc", shape=bk.Disk(1.0, (0.0, 1.0)), material=bk.Material(2.0, 0.3))
    plane = bk.RigidBody(name="plane", obstacle=bk.RigidHalfPlane((0.0, 2.0), (0.0, -1.0)), y=-0.05)
    forces = []
    for lower, upper in (("*", "*"), ("arc-3, arc-4", "arc-1, arc-2")):
        pairs = bk.ContactPair(("block.top", f"disc.{lower}")), bk.ContactPair((f"disc.{upper}", "plane"))
        scene = bk.Scene(title="disc", bodies=(block, disc), rigid=(plane,), contacts=pairs, mesh=bk.MeshOptions(80))
        solution = bk.run(dataclasses.replace(scene, law=bk.Coulomb(0.3)))
        check_solution(solution)
        forces.append(solution.rigid["plane"].force_y)
    assert forces[0] == pytest.approx(forces[1], rel=1e-9)
