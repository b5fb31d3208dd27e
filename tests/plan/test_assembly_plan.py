from dataclasses import replace

import bemkit as bk
from bemkit.contact.joined.sparse_form import sparse_solver_name
from bemkit.model.prepared import prepare
from bemkit.plan.plan import make_plan, plan_steps
from tests.runs.masonry import wall


def _contact_line(courses, per_course):
    items = {item.name: item for item in make_plan(wall(courses, per_course, push=False)).items}
    return items["contact system"].reason


def test_the_plan_says_how_the_contact_system_is_solved():
    assert "one dense matrix of relative displacements" in _contact_line(2, 3)
    assert f"a sparse system, factored in every step by {sparse_solver_name()}" in _contact_line(10, 10)


def test_contacts_that_the_mesh_does_not_resolve_are_skipped_with_a_warning():
    """The upper block stands on the left one, and on 1e-4 of the right one."""
    block = bk.Rectangle(1.0, 1.0)
    places = {"left": (0.0, 0.0), "right": (1.0, 0.0), "upper": (1e-4, 1.0)}
    steel = bk.Material(1.0, 0.3)
    bodies = tuple(
        bk.Body(name=name, shape=block, material=steel, placement=bk.Placement(at)) for name, at in places.items()
    )
    scene = bk.Scene(title="Blocks", bodies=bodies, touching=bk.Touching(1e-6), mesh=bk.MeshOptions(elements=16))
    prepared = prepare(scene)
    assert [rows.name for rows in prepared.rows] == ["left.right / right.left", "left.top / upper.bottom"]
    (warning,) = plan_steps([prepared]).warnings
    assert "'right.top / upper.bottom' is shorter than a hundredth of its elements and skipped" in warning.text


def test_plane_stress_on_plane_strain_is_a_warning():
    block, steel = bk.Rectangle(1.0, 1.0), bk.Material(1.0, 0.3)
    base = bk.Part("base", bk.Clamped(), ("bottom",))
    lower = bk.Body(name="lower", shape=block, material=steel, parts=(base,))
    upper = bk.Body(name="upper", shape=block, material=steel, placement=bk.Placement((0.0, 1.0)))
    scene = bk.Scene(
        title="Blocks",
        bodies=(lower, upper),
        contacts=(bk.ContactPair(("upper.bottom", "lower.top")),),
        mesh=bk.MeshOptions(elements=16),
    )
    assert not make_plan(scene).warnings
    plate = replace(upper, material=replace(steel, plane=bk.Plane.STRESS))
    (warning,) = make_plan(replace(scene, bodies=(lower, plate))).warnings
    assert "body 'lower' in plane strain" in warning.text
    assert "body 'upper' in plane stress" in warning.text
