"""Profiles of scene files: where their files are, units of their lengths, jumps at their seams."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.rough_profile import Profile
from bemkit.plan.plan import make_plan

SCENE = """
title = "rough"
units = { length = "mm", stress = "MPa" }
shape = { kind = "periodic-half-plane", period = 1.0 }
material = { youngs_modulus = "210 GPa", poisson_ratio = 0.3 }
far = { force_y = 100.0 }
mesh = { elements = 32 }
parts.zone.condition = { kind = "contact", obstacle = { kind = "profile", file = "profile.txt", period = 1.0 } }
"""


def write(folder: Path, tilt: float = 0.0) -> None:
    x = np.arange(64) / 64
    np.savetxt(folder / "profile.txt", np.column_stack([x, 1e-3 * np.cos(2.0 * np.pi * x) + tilt * x]))


def test_a_scene_file_names_its_profile_from_its_own_folder(tmp_path: Path) -> None:
    write(tmp_path)
    (tmp_path / "scene.toml").write_text(SCENE)
    (part,) = bk.load_scene(tmp_path / "scene.toml").only.contact_parts
    assert isinstance(part.condition, bk.Contact)
    assert isinstance(part.condition.obstacle, Profile)
    assert part.condition.obstacle.file == str(tmp_path / "profile.txt")
    with pytest.raises(
        bk.InputError, match=r"parts\.zone\.condition\.obstacle\.file: 'profile\.txt': a text without a"
    ):
        bk.scene_from_toml(SCENE)


def test_words_of_a_scene_file_level_and_filter(tmp_path: Path) -> None:
    write(tmp_path, tilt=1e-2)
    text = SCENE.replace('"profile.txt"', '"profile.txt", levelling = "ends", shortest_wavelength = "100 um"')
    (part,) = bk.scene_from_toml(text, folder=tmp_path).only.contact_parts
    assert isinstance(part.condition, bk.Contact)
    obstacle = part.condition.obstacle
    assert isinstance(obstacle, Profile)
    assert obstacle.shortest_wavelength == pytest.approx(0.1)
    assert obstacle.seam_jump == 0.0
    with pytest.raises(bk.InputError, match="'lin' is unknown: give one of none, line, ends; did you mean 'line'"):
        bk.scene_from_toml(text.replace("ends", "lin"), folder=tmp_path)


def test_the_jump_at_the_seam_is_warned_of_before_the_run(tmp_path: Path) -> None:
    write(tmp_path, tilt=1e-2)
    (warning,) = make_plan(bk.scene_from_toml(SCENE, folder=tmp_path)).warnings
    assert (warning.kind, warning.subject) == ("jump of profile", "zone")
    # from the last point, a 64th before the end, to the first
    jump = 1e-3 * (1.0 - np.cos(2.0 * np.pi / 64)) - 1e-2 * 63 / 64
    assert warning.number == pytest.approx(jump, rel=1e-12)
    assert f"jumps by {jump:.3g} mm at its seam, x = 0," in str(warning)
    smooth = SCENE.replace('"profile.txt"', '"profile.txt", shortest_wavelength = "100 um"')
    assert make_plan(bk.scene_from_toml(smooth, folder=tmp_path)).warnings == (warning,)
    write(tmp_path)
    assert make_plan(bk.scene_from_toml(SCENE, folder=tmp_path)).warnings == ()
