"""A resultant force and moment on a part: balance, units, load steps, placed bodies, and what is refused."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.scene.load_history import with_scaled_loads
from bemkit.studies.stability.transform import with_turned_loads

STEEL = bk.Material(1e4, 0.3)
BASE = bk.Part("base", bk.Clamped(), ("bottom",))
FORCE = bk.Force(3.0, -4.0, 0.7)


def scene_of(condition, shape=None, side: str = "top", where=None) -> bk.Scene:
    return bk.Scene(
        title="Force",
        shape=shape or bk.Rectangle(2.0, 1.0),
        material=STEEL,
        parts=(BASE, bk.Part("load", condition, (side,), where)),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(elements=32),
    )


def reaction_of(solution) -> list[float]:
    """Return the force and the moment about the origin that the base takes."""
    (base,) = (force for force in solution.part_forces if force.name == "base")
    return [base.force_x, base.force_y, base.moment]


def expected(force: bk.Force, middle: tuple[float, float]) -> list[float]:
    x, y = middle
    return [-force.x, -force.y, -(force.moment + x * force.y - y * force.x)]


@pytest.mark.parametrize(
    ("shape", "side", "where", "middle", "tolerance"),
    [
        (None, "top", None, (1.0, 1.0), 1e-12),
        (None, "top", bk.Expression("x > 0.7"), (1.35, 1.0), 1e-12),
        # displacements of degree 2 follow a turn of an arc of a quarter of a right angle to 1e-3
        (bk.PlateWithHole(2.0, 2.0, 0.5), "hole", None, (1.0, 1.0), 2e-3),
    ],
)
def test_the_support_takes_the_resultant(shape, side, where, middle, tolerance) -> None:
    found = reaction_of(bk.run(scene_of(FORCE, shape, side, where)))
    assert found == pytest.approx(expected(FORCE, middle), rel=tolerance)


def test_a_force_without_moment_is_a_uniform_traction() -> None:
    points = np.array([[0.1, 1.0], [1.9, 1.0]])
    (load,) = (part.condition for part in scene_of(bk.Force(3.0, -4.0)).only.parts if part.name == "load")
    assert np.allclose(load.at(points, points), [[1.5, -2.0]], rtol=1e-14)


def test_a_placed_body_is_loaded_in_the_coordinates_of_the_scene() -> None:
    place = bk.Placement((3.0, 4.0), 30.0)
    body = bk.Body(
        name="block",
        shape=bk.Rectangle(2.0, 1.0),
        material=STEEL,
        parts=(BASE, bk.Part("load", FORCE, ("top",))),
        placement=place,
        mesh=bk.MeshOptions(elements=32),
    )
    assembly = bk.Scene(title="Forces", bodies=(body,), discretisation=bk.Galerkin(2))
    x, y = place.forward(np.array([[1.0, 1.0]]))[0].tolist()
    found = reaction_of(bk.run(assembly).bodies["block"])
    assert found == pytest.approx(expected(FORCE, (x, y)), rel=1e-11)  # round-off of moments
    copied = replace(assembly, bodies=(replace(body, copies=bk.GridCopies(columns=2, step=(5.0, 0.0))),))
    for copy, shift in zip(copied.placed_bodies, (0.0, 5.0), strict=True):
        load = copied.scene_of(copy).parts[1].condition
        middle = np.array([[x + shift, y]])
        assert np.allclose(load.at(middle, middle), [[1.5, -2.0]], rtol=1e-13)


def test_scaled_and_turned_loads() -> None:
    scene = scene_of(FORCE)
    half = reaction_of(bk.run(with_scaled_loads(scene, 0.5)))
    assert half == pytest.approx(0.5 * np.array(expected(FORCE, (1.0, 1.0))), rel=1e-12)
    plain = scene_of(bk.Force(3.0, -4.0))
    turned = reaction_of(bk.run(with_turned_loads(plain, np.pi / 2)))
    assert turned == pytest.approx(expected(bk.Force(4.0, 3.0), (1.0, 1.0)), rel=1e-12)


def test_the_file_keeps_the_force_and_takes_units_and_steps() -> None:
    scene = scene_of(FORCE)
    text = bk.scene_to_toml(scene)
    assert "moment = 0.7" in text
    assert bk.scene_from_toml(text) == scene
    assert pickle.loads(pickle.dumps(scene)) == scene
    units = 'units = { length = "mm", stress = "MPa" }\n'
    read = bk.scene_from_toml(units + text.replace("y = -4.0", 'y = "-4 kN/m"'))
    assert [part.condition for part in read.parts][1] == FORCE
    stepped = replace(scene, steps=(bk.Step(1.0, {"parts.load.condition.y": "-2 * t"}), bk.Step(2.0)))
    values = [reaction_of(step)[1] for step in bk.run([stepped])]
    assert values == pytest.approx([2.0, 2.0], rel=1e-12)


@pytest.mark.parametrize("value", ["1", float("nan"), True])
def test_what_is_not_a_number_is_refused(value) -> None:
    with pytest.raises(bk.InputError, match="give a finite number, the resultant on the whole part"):
        bk.Force(moment=value)
