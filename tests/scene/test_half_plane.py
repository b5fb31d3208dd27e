"""Scenes of half-planes: what they may say, what is refused, and that results keep everything."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.errors import GeometryError
from bemkit.geometry.outline import Outline, Side, Surface
from bemkit.runs.steps import run_on_mesh
from bemkit.scene.load_history import load_steps
from bemkit.studies.stability.case import Case
from bemkit.studies.stability.sweep import condition_number
from tests.slow import slow_only

PUNCH = bk.Scene(
    title="punch",
    shape=bk.ElasticHalfPlane(-1.0, 1.0),
    material=bk.Material(1.0, 0.3),
    law=bk.Coulomb(0.3),
    parts=(bk.Part("zone", bk.Contact(bk.Gap(bk.Expression("0.1 * x**2"))), where=bk.Expression("x < 0.5")),),
    far=bk.FarField(force_x=0.01, force_y=0.05, turn=0.0),
    mesh=bk.MeshOptions(elements=40),
)
ROUGH = replace(bk.load_scene("rough-surface"), mesh=bk.MeshOptions(elements=256))


@pytest.mark.parametrize("scene", [PUNCH, ROUGH], ids=lambda scene: scene.title)
def test_scenes_meshes_and_results_come_back_as_they_were(scene: bk.Scene, tmp_path: Path) -> None:
    assert bk.scene_from_toml(bk.scene_to_toml(scene)) == scene
    solution = bk.run(scene)
    assert solution.is_converged
    assert solution.work == solution.plan.work
    bk.write_result(tmp_path / "result.h5", solution)
    again = bk.read_result(tmp_path / "result.h5")
    for mesh in (again.mesh, pickle.loads(pickle.dumps(solution.mesh))):
        assert mesh.surface == scene.shape.outline().surface
        np.testing.assert_array_equal(mesh.nodes, solution.mesh.nodes)
    assert again.summary() == solution.summary()


@pytest.mark.parametrize("scene", [PUNCH, ROUGH], ids=lambda scene: scene.title)
def test_the_plan_says_what_is_left_out(scene: bk.Scene) -> None:
    items = {item.name: item for item in bk.make_plan(scene, scene.build_mesh()).items}
    assert items["flexibility of the surface"].is_needed
    assert not items["elements inside, around or below"].is_needed
    assert not items["supports"].is_needed
    assert items["exterior domain"].reason == "the body fills the half-plane below its surface"


def test_thirty_thousand_elements_fit_where_there_is_no_matrix() -> None:
    scene = replace(ROUGH, mesh=bk.MeshOptions(elements=32_768))
    assert bk.make_plan(scene, scene.build_mesh()).memory < 1e9


@pytest.mark.parametrize("n_steps", [1, 3])
def test_loads_far_away_follow_the_load_factors(n_steps: int) -> None:
    factors = tuple((np.arange(n_steps) + 1.0) / n_steps)
    solutions = bk.run([replace(PUNCH, load_factors=factors)])
    np.testing.assert_allclose([step.force_normal for step in solutions], np.array(factors) * 0.05)
    steps = load_steps(replace(PUNCH, load_factors=(0.5, 2.0)))
    assert [step.far for step in steps] == [
        bk.FarField(force_x=0.005, force_y=0.025, turn=0.0),
        bk.FarField(force_x=0.02, force_y=0.1, turn=0.0),
    ]
    with pytest.raises(bk.InputError, match="far drives other motions: change numbers only"):
        bk.run([PUNCH, replace(PUNCH, far=bk.FarField(force_y=0.05))])


def test_a_load_step_under_another_load_is_that_of_a_run_of_its_own() -> None:
    harder = replace(PUNCH, law=bk.Frictionless(), far=bk.FarField(force_x=0.0, force_y=0.1, turn=0.0, x=None))
    softer = replace(harder, far=bk.FarField(force_x=0.0, force_y=0.03, turn=0.0))
    _, second = bk.run([harder, softer])
    alone = run_on_mesh(softer)
    np.testing.assert_allclose(second.contact.sigma_n, alone.contact.sigma_n, atol=1e-9)
    np.testing.assert_allclose(second.contact.u_n, alone.contact.u_n, atol=1e-9)


@pytest.mark.parametrize("scene", slow_only([PUNCH, ROUGH], ROUGH), ids=lambda scene: scene.title)
def test_steps_change_what_acts_far_away(scene: bk.Scene) -> None:
    assert scene.far is not None
    sheared = bk.Step(2.0, {"far.force_x": "0.002 * (t - 1)"}, increments=2)
    pressed = replace(scene, far=replace(scene.far, force_x=0.0))
    history = bk.run([replace(pressed, steps=(bk.Step(1.0), sheared))])
    assert all(step.is_converged for step in history)
    np.testing.assert_allclose([-step.contacts[0].force_x for step in history], [0.0, 0.001, 0.002], atol=1e-12)


def test_displacement_and_force_tell_the_same_story() -> None:
    """What a force drives, driven by the displacement that it has caused."""
    pressed = replace(PUNCH, law=bk.Frictionless(), far=bk.FarField(x=0.0, force_y=0.05, turn=0.0))
    by_force = bk.run(pressed)
    # far from contact all that moves a node is the force at a distance, and the motion
    modulus, x = pressed.material.plane_modulus, by_force.boundary.points[:, 0]
    table = by_force.contact
    pressures = -table.sigma_n * table.weight
    node = int(np.argmax(x))
    sunk = 2.0 / (np.pi * modulus) * float(pressures @ np.log(np.abs(x[node] - table.x) / 2.0))
    motion = float(by_force.boundary.displacement[node, 1] - sunk)
    by_motion = bk.run(replace(pressed, far=bk.FarField(x=0.0, y=motion, turn=0.0)))
    # elements of a quarter of the contact half-width, the last of them free: 1e-3 of the logarithm
    assert by_motion.force_normal == pytest.approx(0.05, rel=1e-3)


def test_forces_far_away_act_on_a_single_element_too() -> None:
    """Its stiffness is zero, which made every force small: the half-plane ended at rest without touching."""
    part = bk.Part("zone", bk.Contact(bk.Gap(0.01)), where=bk.Expression("x > 0.4 and x < 0.8"))
    far = bk.FarField(force_x=1e-4, force_y=1e-3)
    scene = replace(PUNCH, parts=(part,), far=far, mesh=bk.MeshOptions(elements=5))
    solution = bk.run(scene)
    assert solution.is_converged
    assert solution.contact.n_contact == 1
    assert solution.force_normal == pytest.approx(1e-3, rel=1e-9)
    with pytest.raises(bk.InputError, match=r"slides the body to the right with 0\.0007 more than friction can hold"):
        bk.run(replace(scene, far=replace(far, force_x=1e-3)))


@pytest.mark.parametrize(
    ("where", "far", "named"),
    [
        ("x > 0.35", bk.FarField(force_y=1e-3, moment=3e-4), r"far\.force_y and far\.moment"),
        ("x > -0.1 and x < 0.1", bk.FarField(y=1e-3, moment=1e-5), r"far\.moment"),
    ],
)
def test_a_turn_that_a_single_element_does_not_resist_is_refused(where: str, far: bk.FarField, named: str) -> None:
    """Its stiffness is singular but for round-off, with which a half-plane under a force came to rest without any."""
    part = bk.Part("zone", bk.Contact(bk.Gap(0.0)), where=bk.Expression(where))
    scene = replace(PUNCH, parts=(part,), far=far, mesh=bk.MeshOptions(elements=3))
    with pytest.raises(bk.InputError, match=f"{named} drive the half-plane along a motion .* free: give the motion"):
        bk.run(scene)


def test_no_stiffness_has_no_condition_number() -> None:
    assert np.isnan(condition_number(ROUGH, Case(0.0, ROUGH)))
    assert np.isnan(condition_number(PUNCH, Case(0.0, PUNCH)))


@pytest.mark.parametrize(
    ("far", "message"),
    [
        ({"x": 1.0, "force_x": 1.0}, "x is 1.0 and force_x is 1.0: give one of them"),
        ({"moment": float("nan")}, "moment is nan: give a finite number"),
        ({"centre": (0.0, float("inf"))}, "centre is"),
    ],
)
def test_a_far_field_says_one_thing_of_each_motion(far: dict[str, object], message: str) -> None:
    with pytest.raises(bk.InputError, match=message):
        bk.FarField(**far)  # type: ignore[arg-type]


def test_shapes_and_meshes_that_are_no_half_plane() -> None:
    with pytest.raises(GeometryError, match=r"left is 1\.0, not below right, -1\.0"):
        bk.ElasticHalfPlane(1.0, -1.0)
    with pytest.raises(GeometryError, match="period"):
        bk.PeriodicHalfPlane(0.0)
    with pytest.raises(GeometryError, match="a half-plane has the sides bottom, right, top, left: give one straight"):
        Outline(bk.Rectangle(1.0, 1.0).outline().loops, surface=Surface())
    arc = bk.Disk(1.0).outline().loops[0][0]
    with pytest.raises(GeometryError, match="give one straight side"):
        Outline(((Side("arc", arc.curve),),), surface=Surface())
    line, bent = np.array([[2.0, 0.0], [1.0, 0.0], [0.0, 0.0]]), np.array([[2.0, 0.0], [1.0, 0.1], [0.0, 0.0]])
    elements = np.array([[0, 1], [1, 2]])
    with pytest.raises(GeometryError, match=r"node at \(1, 0\.1\) lies 0\.1 beside the line"):
        bk.BoundaryMesh(bent, elements, is_exterior=True, surface=Surface())
    with pytest.raises(GeometryError, match="a half-plane is an exterior without symmetry lines"):
        bk.BoundaryMesh(line, elements, surface=Surface())
    mesh = bk.BoundaryMesh(line, elements, is_exterior=True, surface=Surface())
    np.testing.assert_array_equal(mesh.refined(np.array([0])).nodes[:, 0], [2.0, 1.5, 1.0, 0.0])
    with pytest.raises(GeometryError, match="but for the first and the last one of a half-plane"):
        bk.BoundaryMesh(line, [[0, 1], [0, 2]], is_exterior=True, surface=Surface())
    with pytest.raises(GeometryError, match="the elements of a half-plane are not in order"):
        bk.BoundaryMesh(line, elements[::-1], is_exterior=True, surface=Surface())


def test_nothing_that_acts_inside_and_no_symmetry() -> None:
    with pytest.raises(bk.InputError, match="the body has no end"):
        replace(PUNCH, body_forces=(bk.Gravity(1.0, (0.0, -1.0)),))
    with pytest.raises(bk.InputError, match="exterior"):
        bk.run(replace(PUNCH, symmetry=bk.Symmetry(x=0.0)))


def test_nothing_holds_a_half_plane_that_is_driven_and_not_touched() -> None:
    free = replace(PUNCH, parts=(bk.Part("load", bk.Pressure(1.0)),), law=bk.Frictionless())
    with pytest.raises(bk.InputError, match="nothing holds the body"):
        bk.run(free)
    at_rest = bk.run(replace(free, far=None))
    assert at_rest.is_converged
    assert at_rest.boundary.displacement[:, 1].max() < 0.0


@pytest.mark.slow
def test_an_elastic_disk_on_an_elastic_half_plane() -> None:
    """As one body of an assembly a half-plane rests at the distance of its strip; Hertz with both moduli."""
    load = bk.Part("load", bk.PrescribedDisplacement(x=0.0, y=-0.02), ("arc-1", "arc-2"))
    disk = bk.Body(
        name="disk",
        shape=bk.Disk(1.0),
        material=bk.Material(1.0, 0.3),
        parts=(load,),
        placement=bk.Placement((0.0, 1.0)),
    )
    ground = bk.Body(name="ground", shape=bk.ElasticHalfPlane(-0.4, 0.4), material=bk.Material(1.0, 0.3))
    pairs = tuple(bk.ContactPair(("ground.surface", f"disk.arc-{quarter}")) for quarter in (3, 4))
    assembly = bk.Scene(title="disk", bodies=(disk, ground), contacts=pairs, mesh=bk.MeshOptions(elements=320))
    solution = bk.run(assembly)
    assert solution.is_converged, solution.message
    force = sum(contact.force_normal for contact in solution.contacts)
    half_width = 0.5 * sum(contact.contact_length for contact in solution.contacts)
    # 2 a / R = 0.1 of a disk that is not a half-plane, and elements of a twelfth of a
    assert half_width == pytest.approx(np.sqrt(8.0 * force / (np.pi * disk.material.plane_modulus)), rel=0.05)
