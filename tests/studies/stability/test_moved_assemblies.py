"""Assemblies in other units, places, directions and orders: the same statuses after the same iterations."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import bemkit as bk
from bemkit.results.solution import Solution
from bemkit.studies.stability.similarity import Similarity
from tests.slow import slow_except

FRICTION = 0.25


def assembly(*, reflects: bool = False) -> bk.Scene:
    """Three blocks of unlike materials and meshes on a rigid floor, one of them on two, under weight and shear.

    Sides of a block are whole numbers of elements long, so that reflected blocks are divided alike.
    """
    sign = -1.0 if reflects else 1.0

    def block(name: str, left: float, bottom: float, width: float, modulus: float, **options: object) -> bk.Body:
        low, high = sorted((sign * left, sign * (left + width)))
        corners = ((low, bottom), (high, bottom), (high, bottom + 1.0), (low, bottom + 1.0))
        names = ("bottom", "left", "top", "right") if reflects else ("bottom", "right", "top", "left")
        return bk.Body(
            name=name,
            shape=bk.Polygon(corners, names),
            material=bk.Material(modulus, 0.3),
            body_forces=(bk.Gravity(1e-4, (0.0, -1.0)),),
            **options,  # type: ignore[arg-type]
        )

    floor = (bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), ("bottom",)),)
    load = bk.Part("load", bk.Traction(sign * 1.2e-4, -1e-3), ("top",))
    cohesive = bk.CohesiveCoulomb(FRICTION, cohesion=1e-5)
    return bk.Scene(
        title="Three blocks",
        bodies=(
            block("one", 0.0, 0.0, 1.0, 1.0, parts=floor, mesh=bk.MeshOptions(elements=28)),
            block("two", 1.01, 0.0, 1.2, 3.0, parts=floor, mesh=bk.MeshOptions(elements=44)),
            block("three", 0.3, 1.0, 1.5, 0.5, parts=(load,), mesh=bk.MeshOptions(elements=30)),
        ),
        contacts=(
            bk.ContactPair(("three.bottom", "one.top"), law=cohesive),
            bk.ContactPair(("three.bottom", "two.top")),
            bk.ContactPair(("one.right", "two.left"), gap=-0.0101, law=bk.Tresca(2e-5)),
        ),
        law=bk.Coulomb(FRICTION),
        discretisation=bk.Galerkin(2),
    )


@lru_cache
def plain() -> Solution:
    solution = bk.run(assembly())
    assert solution.is_converged
    assert len(set(solution.contact.status.tolist())) >= 3  # open, sticking and slipping nodes
    return solution


CHANGES = {
    "millimetres, MPa": Similarity(length=1e3, modulus=1e-6, stress=1e-6),
    "nanometres": Similarity(length=1e-9),
    "stresses 1e12": Similarity(modulus=1e12, stress=1e12),
    "shifted": Similarity(shift=(3.0, -7.0)),
    "turned by 90 degrees": Similarity(turn=90.0),
    "turned by 37 degrees": Similarity(turn=37.0),
    "everything": Similarity(length=1e-3, modulus=1e6, stress=1e6, turn=-130.0, shift=(0.02, 0.001)),
}


def assert_same(solution: Solution, length: float = 1.0, stress: float = 1.0, atol: float = 1e-11) -> None:
    """Compare with the plain solution; tractions of about 1e-3, certificates of 1e-9 of them."""
    reference, table, expected = plain(), solution.contact, plain().contact
    assert (solution.linear_solves, solution.outer_steps) == (reference.linear_solves, reference.outer_steps)
    np.testing.assert_array_equal(table.status, expected.status)
    np.testing.assert_allclose(table.sigma_n / stress, expected.sigma_n, atol=atol)
    np.testing.assert_allclose(table.sigma_t / stress, expected.sigma_t, atol=atol)
    np.testing.assert_allclose(table.u_t / length, expected.u_t, atol=atol)
    np.testing.assert_allclose(table.gap / length, expected.gap, atol=1e-13)
    assert solution.energy / (stress * length**2) == pytest.approx(reference.energy, rel=1e-8)


@pytest.mark.parametrize("name", slow_except(CHANGES, "everything"))
def test_same_statuses_after_the_same_iterations(name: str) -> None:
    change = CHANGES[name]
    solution = bk.run(change.apply(assembly()))
    assert_same(solution, change.length, change.stress)
    points = np.column_stack([plain().contact.x, plain().contact.y])
    places = np.column_stack([solution.contact.x, solution.contact.y])
    np.testing.assert_allclose(places, change.points(points), atol=1e-12 * (change.length + np.abs(change.shift).max()))
    forces, expected = (np.array([[one.force_x, one.force_y] for one in each.contacts]) for each in (solution, plain()))
    np.testing.assert_allclose(
        forces, change.stress * change.length * change.vectors(expected), atol=1e-11 * change.stress * change.length
    )


@pytest.mark.slow
def test_a_reflected_assembly_slips_the_other_way() -> None:
    solution = bk.run(assembly(reflects=True))
    assert (solution.linear_solves, solution.outer_steps) == (plain().linear_solves, plain().outer_steps)
    for contact in plain().contact.parts:
        own, expected = (each.contact.rows(contact) for each in (solution, plain()))
        np.testing.assert_array_equal(
            solution.contact.status[own], np.array([0, 1, 3, 2])[plain().contact.status[expected]][::-1]
        )
        np.testing.assert_allclose(solution.contact.sigma_n[own], plain().contact.sigma_n[expected][::-1], atol=1e-11)
        np.testing.assert_allclose(solution.contact.sigma_t[own], -plain().contact.sigma_t[expected][::-1], atol=1e-11)


@pytest.mark.slow
def test_bodies_and_sides_come_in_any_order() -> None:
    """Contacts that meet in a corner do not: of equally long ones the first has the multiplier there."""
    given = assembly()
    swapped = tuple(replace(pair, sides=pair.sides[::-1]) for pair in given.contacts)
    assert [pair.multipliers_on for pair in given.contacts] == [None] * 3
    solution = bk.run(replace(given, bodies=given.bodies[::-1], contacts=swapped))
    for pair in given.contacts:
        own = solution.contact.rows(" / ".join(pair.sides[::-1]))
        expected = plain().contact.rows(pair.name)
        np.testing.assert_array_equal(solution.contact.status[own], plain().contact.status[expected])
        np.testing.assert_allclose(solution.contact.sigma_n[own], plain().contact.sigma_n[expected], atol=1e-11)


@pytest.mark.slow
def test_multipliers_on_the_other_side_change_forces_by_the_discretisation_error() -> None:
    """Pressures are singular at corners: two per cent of the load with elements of an eighth of a side."""
    given = assembly()
    owners = [("three.bottom", "one.top"), ("three.bottom", "two.top"), ("one.right", "two.left")]
    for which in (0, 1):
        pairs = tuple(
            replace(pair, multipliers_on=sides[which]) for pair, sides in zip(given.contacts, owners, strict=True)
        )
        solution = bk.run(replace(given, contacts=pairs))
        assert solution.is_converged
        for contact, expected in zip(solution.contacts, plain().contacts, strict=True):
            assert contact.force_normal == pytest.approx(expected.force_normal, abs=3e-5)


@pytest.mark.slow
def test_copies_are_bodies_that_are_listed() -> None:
    def wall(*, is_copied: bool) -> bk.Scene:
        def brick(name: str, place: bk.Placement, copies: bk.GridCopies | None = None) -> bk.Body:
            return bk.Body(
                name=name,
                shape=bk.Rectangle(2.0, 1.0),
                material=bk.Material(1.0, 0.2),
                body_forces=(bk.Gravity(1e-4, (0.1, -1.0)),),
                placement=place,
                copies=copies,
                mesh=bk.MeshOptions(elements=18),
            )

        copies = bk.GridCopies(2, 2, (2.001, 1.0))
        bricks = (brick("brick", bk.Placement(), copies),)
        if not is_copied:
            bricks = tuple(brick(f"brick-{name}", place) for name, place in copies.placements().items())
        floor = bk.Body(
            name="floor",
            shape=bk.Rectangle(5.0, 1.0, (-0.5, -1.0)),
            material=bk.Material(10.0, 0.2),
            parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
            mesh=bk.MeshOptions(elements=30),
        )
        return bk.Scene(title="Wall", bodies=(*bricks, floor), touching=bk.Touching(1e-2), law=bk.Coulomb(0.4))

    copied, listed = (bk.run(wall(is_copied=flag)) for flag in (True, False))
    np.testing.assert_array_equal(copied.contact.status, listed.contact.status)
    assert copied.linear_solves == listed.linear_solves
    np.testing.assert_allclose(copied.contact.sigma_n, listed.contact.sigma_n, atol=1e-13)
    assert copied.work.single_layer.computed < listed.work.single_layer.computed


def test_forces_of_rigid_connections_stay_those_of_rigid_connections() -> None:
    load = bk.Part("load", bk.Force(1.0, -2.0, 0.5, is_rigid=True), ("top",))
    first, *others = assembly().bodies
    scaled = Similarity(length=2.0).apply(replace(assembly(), bodies=(replace(first, parts=(load,)), *others)))
    assert scaled.bodies[0].parts[0].condition == bk.Force(2.0, -4.0, 2.0, is_rigid=True)


def test_bodies_that_cannot_be_similar_are_refused() -> None:
    heated = bk.Heating(expansion=1e-5, temperature=bk.Expression("x"))
    bodies = tuple(replace(body, body_forces=(heated,)) for body in assembly().bodies)
    with pytest.raises(bk.InputError, match="is not a number: give one, fields are not turned"):
        Similarity(length=2.0).apply(replace(assembly(), bodies=bodies))
    with pytest.raises(bk.InputError, match=r"modulus is 2\.0 and stress 1\.0: give equal factors for several bodies"):
        Similarity(modulus=2.0).apply(assembly())
    with pytest.raises(bk.InputError, match=r"turn is 90\.0: a scene is turned if it lists its bodies"):
        Similarity(turn=90.0).apply(bk.load_scene("paper-1"))
