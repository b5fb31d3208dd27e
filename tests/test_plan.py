"""The plan: what is needed, what is left out, and what fits."""

from __future__ import annotations

import dataclasses

import pytest

import bemkit.plan
from bemkit.contact.laws import Frictionless
from bemkit.contact.obstacle import HalfPlane
from bemkit.geometry.shapes import Disk, Rectangle
from bemkit.operators.material import Material
from bemkit.plan import TooLargeError, check_memory, free_rigid_motions, make_plan
from bemkit.scene import Clamped, Condition, Contact, MeshOptions, Part, PrescribedDisplacement, Roller, Scene
from bemkit.scenefile import load_scene, with_overrides


def needed(scene: Scene) -> dict[str, bool]:
    return {item.name: item.is_needed for item in make_plan(scene, scene.build_mesh()).items}


def block(*conditions: tuple[str, Condition]) -> Scene:
    parts = [Part("foundation", Contact(HalfPlane()), ("bottom",))]
    parts += [Part(side, condition, (side,)) for side, condition in conditions]
    return Scene(
        title="t", shape=Rectangle(2.0, 1.0), material=Material(1.0, 0.3), parts=tuple(parts), mesh=MeshOptions(24)
    )


@pytest.mark.parametrize(
    ("scene", "n_free"),
    [
        (block(), 3),
        (block(("right", Roller())), 1),
        (block(("top", PrescribedDisplacement(y=0.0))), 1),
        (block(("right", Roller()), ("top", Roller())), 0),
        (block(("right", Roller()), ("left", Roller())), 1),
        (block(("left", Clamped())), 0),
    ],
)
def test_rigid_motions_that_only_contact_holds_are_counted(scene: Scene, n_free: int) -> None:
    assert free_rigid_motions(scene, scene.build_mesh()) == n_free
    assert needed(scene)["rigid motions as unknowns"] == (n_free > 0)


def test_a_disc_on_rollers_all_round_may_still_turn() -> None:
    arcs = ("arc-1", "arc-2", "arc-3")
    parts = (Part("floor", Contact(HalfPlane()), ("arc-4",)), Part("ring", Roller(), arcs))
    scene = Scene(title="t", shape=Disk(1.0), material=Material(1.0, 0.3), parts=parts, mesh=MeshOptions(64))
    mesh = scene.build_mesh()
    assert free_rigid_motions(scene, mesh) == 1
    assert needed(scene)["quadrature on curved elements"]


def test_what_is_left_out_depends_on_the_scene() -> None:
    scene = load_scene("paper-1")
    constant = needed(scene)
    linear = needed(with_overrides(scene, discretisation="linear"))
    assert not constant["hypersingular operator"]
    assert linear["hypersingular operator"]
    assert constant["friction"]
    assert not needed(dataclasses.replace(scene, law=Frictionless()))["friction"]
    assert not constant["quadrature on curved elements"]


def test_every_item_has_a_reason_and_memory_grows_with_the_square() -> None:
    scene = load_scene("paper-1")
    small, large = (
        make_plan(changed, changed.build_mesh())
        for changed in (with_overrides(scene, elements=64), with_overrides(scene, elements=128))
    )
    assert all(item.reason for item in small.items)
    assert large.memory == pytest.approx(4 * small.memory, rel=0.1)  # contact nodes are shared out in whole numbers
    assert small.as_dict()["memory"] == small.memory


def test_what_does_not_fit_is_refused_before_it_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bemkit.plan, "_physical_memory", lambda: 1e9)
    scene = load_scene("paper-1")
    check_memory(scene)
    with pytest.raises(TooLargeError, match=r"mesh\.elements is 100000: .* this computer has 1 GB: use at most 2112"):
        check_memory(with_overrides(scene, elements=100_000))
