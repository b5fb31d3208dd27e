"""Body forces in scenes: words, wrong input, load factors, transforms, symmetry."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import bemkit as bk
from bemkit.errors import InputError
from bemkit.scene.load_history import load_steps
from bemkit.scene.symmetry import find_symmetry
from bemkit.scene.toml import SceneError, scene_from_toml, scene_to_toml
from bemkit.studies.stability.transform import AffineMap, transformed_scene, with_turned_loads

FORCES = (
    bk.Gravity(2400.0, is_constant=True),
    bk.Rotation(7800.0, 3.0, (1.0, 2.0)),
    bk.Heating(1.2e-5, bk.Expression("20 + 5 * x")),
)


def scene(*forces: Any, **changes: Any) -> bk.Scene:
    given: dict[str, Any] = {
        "title": "block",
        "shape": bk.Rectangle(2.0, 4.0),
        "material": bk.Material(1.0, 0.3),
        "parts": (bk.Part("floor", bk.Clamped(), sides=("bottom",)),),
        "mesh": bk.MeshOptions(12),
    }
    return bk.Scene(body_forces=forces, **(given | changes))


def test_scene_files_hold_body_forces_both_ways() -> None:
    given = scene(*FORCES)
    text = scene_to_toml(given)
    assert text.count("[[body_forces]]") == 3
    assert scene_from_toml(text) == given
    assert "body_forces" not in scene_to_toml(scene())


WRONG_WORDS = [
    ("kind = 'gravity'\ndensity = 0.0", r"body_forces\[0\]: density is 0.0: give a positive, finite number"),
    ("kind = 'gravity'", r"body_forces\[0\]\.density: missing: add density = "),
    (
        "kind = 'weight'",
        r"body_forces\[0\]\.kind: unknown body force 'weight': the known ones are gravity, rotation, heat",
    ),
    ("kind = 'heating'\nexpansion = 1e-5\ntemperature = 'x > 1'", "is a condition"),
]


@pytest.mark.parametrize(("table", "message"), WRONG_WORDS)
def test_wrong_tables_are_explained(table: str, message: str) -> None:
    text = scene_to_toml(scene()) + f"\n[[body_forces]]\n{table}\n"
    with pytest.raises(SceneError, match=message):
        scene_from_toml(text)


WRONG: list[tuple[Callable[[], object], str]] = [
    (lambda: bk.Gravity(-1.0), "density is -1.0: give a positive, finite number"),
    (lambda: bk.Gravity(math.inf), "density is inf: give a positive, finite number"),
    (lambda: bk.Gravity(1.0, (0.0, math.nan)), r"acceleration is \(0.0, nan\): give finite numbers"),
    (lambda: bk.Rotation(0.0, 1.0), "density is 0.0"),
    (lambda: bk.Rotation(1.0, math.inf), "angular_velocity is inf: give finite numbers"),
    (lambda: bk.Rotation(1.0, 1.0, (math.inf, 0.0)), r"centre is \(inf, 0.0\): give finite numbers"),
    (lambda: bk.Heating(math.nan, 1.0), "expansion is nan: give finite numbers"),
    (lambda: bk.Heating(1.0, math.inf), "temperature = inf is not finite"),
    (
        lambda: scene(FORCES[0], shape=bk.ExteriorOf(bk.Disk(1.0)), parts=(bk.Part("hole", bk.Clamped()),)),
        "but the body has no end: nothing holds its infinite weight",
    ),
    (lambda: load_steps(scene(FORCES[1], load_factors=(1.0, -0.5))), "load factor -0.5 of a rotation"),
]


@pytest.mark.parametrize(("make", "message"), WRONG)
def test_wrong_forces_are_named(make: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


def force_of(given: bk.Scene, points: Any) -> Any:
    return sum(force.force_at(points) for force in given.body_forces if not isinstance(force, bk.Heating))


def strain_of(given: bk.Scene, points: Any) -> Any:
    return sum(force.strain_at(points) for force in given.body_forces if isinstance(force, bk.Heating))


def test_load_factors_multiply_what_is_not_constant() -> None:
    points = np.random.default_rng(1).normal(size=(5, 2))
    loose = scene(*(dataclasses.replace(force, is_constant=False) for force in FORCES), load_factors=(1.0, 0.25))
    fixed = scene(*(dataclasses.replace(force, is_constant=True) for force in FORCES), load_factors=(1.0, 0.25))
    for field in (force_of, strain_of):
        np.testing.assert_allclose(field(load_steps(loose)[1], points), 0.25 * field(loose, points), rtol=1e-14)
        np.testing.assert_array_equal(field(load_steps(fixed)[1], points), field(fixed, points))


def test_transforms_scale_forces_like_stresses_over_lengths() -> None:
    points = np.random.default_rng(2).normal(size=(5, 2))
    floor = bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",))
    given, affine = scene(*FORCES, parts=(floor,)), AffineMap((3.0, 3.0), (0.5, -2.0))
    moved = transformed_scene(given, affine, stress=10.0, modulus=7.0)
    there = affine.forward(points)
    np.testing.assert_allclose(force_of(moved, there), 10.0 / 3.0 * force_of(given, points), rtol=1e-12)
    np.testing.assert_allclose(strain_of(moved, there), 10.0 / 7.0 * strain_of(given, points), rtol=1e-12)


def test_turned_loads_turn_the_weight() -> None:
    (turned, *rest) = with_turned_loads(scene(*FORCES), math.radians(90.0)).body_forces
    assert isinstance(turned, bk.Gravity)
    np.testing.assert_allclose(turned.acceleration, [9.81, 0.0], atol=1e-14)
    assert tuple(rest) == FORCES[1:]


ASYMMETRIC = [
    (bk.Gravity(1.0, (0.1, -1.0)), "body force"),
    (bk.Rotation(1.0, 1.0, (0.0, 0.0)), "body force"),
    (FORCES[2], "thermal strain"),
]


@pytest.mark.parametrize(("force", "name"), ASYMMETRIC)
def test_forces_across_a_symmetry_line_are_refused(force: Any, name: str) -> None:
    given = scene(force, symmetry=bk.Symmetry(x=1.0))
    with pytest.raises(ValueError, match=f"not symmetric about .*: the {name} is"):
        given.build_mesh()
    assert find_symmetry(scene(force).only) is None


@pytest.mark.parametrize(
    "force",
    [bk.Gravity(1.0), bk.Rotation(1.0, 1.0, (1.0, 0.0)), bk.Heating(1.0, bk.Expression("y + (x - 1)**2 - y**2"))],
)
def test_forces_along_a_symmetry_line_are_symmetric(force: Any) -> None:
    assert find_symmetry(scene(force).only) == bk.Symmetry(x=1.0)
    assert scene(force, symmetry=bk.Symmetry(x=1.0)).build_mesh().n_elements < 12
