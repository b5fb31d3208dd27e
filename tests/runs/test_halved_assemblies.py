"""Assemblies about symmetry lines: bodies that lines cross are halved, and answer as the whole ones do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.mortar.sides import ContactSide
from bemkit.errors import InputError
from bemkit.results.result_file import read_result, write_result
from bemkit.results.solution import Solution
from bemkit.scene.symmetry import AsymmetricSceneError
from bemkit.studies.stability.axes import find_axes
from bemkit.studies.stability.records import Verdict
from bemkit.studies.stability.sweep import sweep
from bemkit.testing.independent_check import violations_of

STEEL, SOFT = bk.Material(1.0, 0.3), bk.Material(0.5, 0.2)
ABOUT_X = bk.Symmetry(x=0.0)


def solved(assembly: bk.Scene) -> Solution:
    solution = bk.run(assembly)
    assert isinstance(solution, Solution)
    assert solution.is_converged, solution.message
    return solution


def blocks(**changes: object) -> bk.Scene:
    """A block pressed onto a wider one, and on its left a small one that is pushed inwards as well."""
    base, load = bk.Part("base", bk.Clamped(), ("bottom",)), bk.Part("load", bk.Traction(y=-1e-3), ("top",))
    push = bk.Part("push", bk.Traction(x=2e-5, y=-2e-4), ("top",))
    bodies = (
        bk.Body(
            name="lower",
            shape=bk.Rectangle(2.0, 1.0, (-1.0, -1.0)),
            material=STEEL,
            parts=(base,),
            mesh=bk.MeshOptions(elements=60),
        ),
        bk.Body(
            name="upper",
            shape=bk.Rectangle(1.0, 1.0, (-0.5, 0.0)),
            material=SOFT,
            parts=(load,),
            mesh=bk.MeshOptions(elements=40),
        ),
        bk.Body(
            name="left",
            shape=bk.Rectangle(0.3, 0.3),
            material=STEEL,
            parts=(push,),
            placement=bk.Placement((-0.9, 0.0)),
            mesh=bk.MeshOptions(elements=24),
        ),
    )
    pairs = tuple(bk.ContactPair((f"{name}.bottom", "lower.top")) for name in ("upper", "left"))
    half = bk.Scene(
        title="Blocks",
        bodies=bodies,
        contacts=pairs,
        law=bk.Coulomb(0.3),
        discretisation=bk.Galerkin(2),
        symmetry=ABOUT_X,
    )
    return replace(half, **changes)  # type: ignore[arg-type]


def both_halves() -> bk.Scene:
    """The same with the other small block, and no line."""
    half = blocks()
    push = bk.Part("push", bk.Traction(x=-2e-5, y=-2e-4), ("top",))
    right = replace(half.bodies[2], name="right", parts=(push,), placement=bk.Placement((0.6, 0.0)))
    pair = bk.ContactPair(("right.bottom", "lower.top"))
    return replace(half, symmetry=None, bodies=(*half.bodies, right), contacts=(*half.contacts, pair))


def test_half_of_the_bodies_answer_as_the_whole_ones() -> None:
    half, whole = solved(blocks()), solved(both_halves())
    assert half.n_elements == 30 + 20 + 24
    assert half.energy == pytest.approx(whole.energy / 2.0, rel=1e-9)
    # the same elements at singular corners are excluded; at the line second differences have no neighbour
    assert half.estimated_traction_error == pytest.approx(whole.estimated_traction_error, rel=1e-3)
    assert set(half.contact.status_words()) == {"stick"}  # also the node on the line, which has no friction to show
    for name in half.contact.parts:
        rows, of_whole = half.contact.rows(name), whole.contact.rows(name)
        places, order = whole.contact.x[of_whole], np.argsort(whole.contact.x[of_whole])
        for column in ("sigma_n", "sigma_t", "u_n"):
            expected = np.interp(half.contact.x[rows], places[order], getattr(whole.contact, column)[of_whole][order])
            # nodes are the same but for round-off; a node on the line carries no friction
            np.testing.assert_allclose(getattr(half.contact, column)[rows], expected, atol=1e-9)
    inside = np.array([[-0.3, -0.2], [0.3, -0.2]])
    fields = [bk.interior_fields(each.bodies["lower"]).stress(inside) for each in (half, whole)]
    np.testing.assert_allclose(fields[0], fields[1], atol=1e-10)
    check = violations_of(half)
    assert check.is_good, check


@pytest.mark.slow
def test_similar_halves_answer_alike_where_all_sticks() -> None:
    """Relative displacements are round-off, and differ: those of the bodies are what differences are measured by."""
    (row,) = sweep(blocks(), [replace(find_axes(["size"])[0], values=(1e-3,))])
    assert Verdict(row.verdict) is Verdict.RIGHT, row
    for name in ("turn", "position"):
        (axis,) = find_axes([name])
        assert "has a symmetry, so its bodies cannot be moved" in axis.reason_against(blocks())


def test_normals_at_a_line_are_those_of_the_whole_side() -> None:
    """A corner on the line: the image of the element that ends there takes part in the mean."""
    roof = bk.Polygon(
        ((-1.0, -1.0), (1.0, -1.0), (1.0, 0.0), (0.0, 0.5), (-1.0, 0.0)), ("floor", "right", "a", "b", "c")
    )
    part = bk.Part("roof", bk.Free(), ("a", "b"))
    scene = bk.Scene(title="x", shape=roof, material=STEEL, parts=(part,), mesh=bk.MeshOptions(elements=40))
    meshes = replace(scene, symmetry=ABOUT_X).build_mesh(), scene.build_mesh()
    sides = [ContactSide(bk.Galerkin(1).displacement_space(mesh), mesh.part("roof")) for mesh in meshes]
    at_apex = []
    for side in sides:
        rows, local = side.first_knots
        points = side.points(rows, side.knots)[np.arange(rows.size), local]
        at_apex.append(side.normals[np.argmax(points[:, 1])])
    np.testing.assert_allclose(at_apex, [[0.0, 1.0], [0.0, 1.0]], atol=1e-15)


@pytest.mark.slow
def test_halved_cylinders_on_meshes_that_follow_the_solution() -> None:
    whole = bk.load_scene("two-cylinders")
    assert isinstance(whole, bk.Scene)
    one, two = solved(replace(whole, symmetry=ABOUT_X)), solved(whole)
    assert one.n_elements < 0.75 * two.n_elements
    pressure = [each.contacts[0].peak_pressure for each in (one, two)]
    force = [each.contacts[0].force_normal for each in (one, two)]
    assert pressure[0] == pytest.approx(pressure[1], rel=3e-3)  # both to half a per cent in the energy
    assert 2.0 * force[0] == pytest.approx(force[1], rel=1e-4)
    # at the line both normals stand across it, and friction has nothing to do there
    assert np.abs(one.contact.sigma_t).max() < 1e-3 * pressure[0]


@pytest.mark.slow
def test_a_quarter_of_a_shrink_fit() -> None:
    """Two rings about both lines: a uniform pressure, in plane strain that of `references` of rings."""
    free = {"material": STEEL, "mesh": bk.MeshOptions(elements=96)}
    inner, outer = (
        bk.Body(
            name=name,
            shape=shape,
            parts=(bk.Part("fit", bk.Free(), tuple(f"{side}-{k}" for k in range(1, 5))),),
            **free,
        )
        for name, shape, side in (("inner", bk.Ring(0.5, 1.0), "outer"), ("outer", bk.Ring(1.0, 2.0), "inner"))
    )
    pair = bk.ContactPair(("inner.fit", "outer.fit"), gap=-1e-3)
    whole = bk.Scene(title="Rings", bodies=(inner, outer), contacts=(pair,), discretisation=bk.Galerkin(3))
    quarter = solved(replace(whole, symmetry=bk.Symmetry(x=0.0, y=0.0)))
    assert quarter.n_elements == 2 * 96 // 4
    pressures = -quarter.contact.sigma_n
    compliance = sum(
        ((1.0 - nu**2) / 1.0) * ((b**2 + a**2) / (b**2 - a**2) + sign * nu / (1.0 - nu))
        for (a, b), nu, sign in (((0.5, 1.0), 0.3, -1.0), ((1.0, 2.0), 0.3, 1.0))
    )
    np.testing.assert_allclose(pressures, 1e-3 / compliance, rtol=2e-4)  # cubic elements of 15 degrees


def test_files_hold_it(tmp_path: Path) -> None:
    half = blocks()
    assert bk.scene_from_toml(bk.scene_to_toml(half)) == half
    solution = solved(half)
    write_result(tmp_path / "half.h5", solution)
    again = read_result(tmp_path / "half.h5")
    assert isinstance(again, Solution)
    assert again.bodies["lower"].mesh.symmetry == ABOUT_X
    assert again.summary()["between_nodes"] == solution.summary()["between_nodes"]


def moved(number: int, **changes: object) -> tuple[bk.Body, ...]:
    bodies = list(blocks().bodies)
    bodies[number] = replace(bodies[number], **changes)  # type: ignore[arg-type]
    return tuple(bodies)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bodies": moved(2, placement=bk.Placement((0.6, 0.0)))}, "body 'left' lies beyond the symmetry line x = 0"),
        ({"bodies": moved(1, placement=bk.Placement((0.1, 0.0)))}, "body 'upper' has a placement, and x = 0 halves it"),
        (
            {
                "rigid": (bk.RigidBody(name="punch", obstacle=bk.RigidHalfPlane((0.0, 1.0), (0.0, -1.0))),),
                "contacts": (*blocks().contacts, bk.ContactPair(("upper.left", "punch"))),
            },
            "symmetry goes only with elastic bodies: remove it, or the rigid bodies",
        ),
    ],
)
def test_what_does_not_go_with_a_line_is_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        blocks(**changes)


def test_contacts_beside_a_line_are_found() -> None:
    found, listed = solved(blocks(touching=bk.Touching(1e-3), contacts=())), solved(blocks())
    assert {frozenset(pair.sides) for pair in found.scene.contacts} == {
        frozenset(pair.sides) for pair in listed.scene.contacts
    }
    assert found.force_normal == pytest.approx(listed.force_normal, rel=1e-12)
    np.testing.assert_allclose(np.sort(found.contact.sigma_n), np.sort(listed.contact.sigma_n), atol=1e-12)


def test_sides_that_touch_their_own_images_are_not_found_but_named() -> None:
    near = moved(2, placement=bk.Placement((-0.3004, 0.0)))
    alone = replace(blocks(), bodies=(near[0], near[2]), contacts=(), touching=bk.Touching(1e-3))
    with pytest.raises(
        InputError, match=r"side 'left\.right' faces its own image at the symmetry line x = 0, .* give it an"
    ):
        bk.run(alone)
    away = moved(2, placement=bk.Placement((-0.3006, 0.0)))
    assert solved(replace(alone, bodies=(away[0], away[2]))).force_normal > 0.0


def test_what_is_not_symmetric_is_refused() -> None:
    shear = bk.Part("load", bk.Traction(x=1e-4, y=-1e-3), ("top",))
    with pytest.raises(AsymmetricSceneError, match="the traction is"):
        bk.run(blocks(bodies=moved(1, parts=(shear,))))
    bodies = tuple(replace(body, mesh=None) for body in moved(1, parts=(shear,)))
    with pytest.raises(AsymmetricSceneError, match="the traction is"):
        bk.run(blocks(bodies=bodies, mesh=bk.MeshOptions(accuracy=0.1)))
    with pytest.raises(AsymmetricSceneError, match="its law is not symmetric about x = 0"):
        bk.run(blocks(law=bk.Coulomb(bk.Expression("0.3 + 0.1 * x"))))


def test_a_contact_beyond_the_line_is_refused_by_its_name() -> None:
    pad = bk.Part("pad", bk.Free(), ("top",), where=lambda x, y: x > 0.2)
    plate = moved(0, parts=(bk.Part("base", bk.Clamped(), ("bottom",)), pad))
    half = blocks(bodies=plate, contacts=(bk.ContactPair(("upper.bottom", "lower.pad")),))
    with pytest.raises(InputError, match=r"the side 'lower.pad' lies beyond .* \(x = 0\)"):
        bk.run(half)
