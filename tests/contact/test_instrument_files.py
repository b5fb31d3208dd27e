"""Profiles from files of instruments, alone and in scenes: together, for to import their reader takes two seconds."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.profile_file import ProfileError, read_profile
from bemkit.contact.rough_profile import Profile
from tests.contact.test_profile_filters import X, wave
from tests.scene.test_profiles import SCENE


@pytest.fixture(scope="module")
def topography() -> ModuleType:
    return pytest.importorskip("SurfaceTopography")


def test_an_instrument_file_is_read_in_metres(topography: ModuleType, tmp_path: Path) -> None:
    scan = topography.UniformLineScan(wave(0.25), 1000.0, unit="um")
    scan.to_netcdf(str(tmp_path / "scan.nc"))
    read = read_profile(tmp_path / "scan.nc")
    assert read.unit == "m"
    np.testing.assert_allclose(read.x, 1e-3 * X, rtol=1e-12)
    np.testing.assert_allclose(read.heights, 1e-6 * wave(0.25), atol=1e-12 * 1e-6)
    with pytest.raises(ProfileError, match="row is 0, but the file is one profile"):
        read_profile(tmp_path / "scan.nc", row=0)


def test_a_row_of_a_map_of_an_instrument_is_a_profile(topography: ModuleType, tmp_path: Path) -> None:
    heights = np.random.default_rng(2).random((8, 5))
    topography.Topography(heights, (2.0, 1.0), unit="mm").to_netcdf(str(tmp_path / "map.nc"))
    read = read_profile(tmp_path / "map.nc", row=3)
    np.testing.assert_allclose(read.x, 1e-3 * 2.0 / 8 * np.arange(8), rtol=1e-12)
    np.testing.assert_allclose(read.heights, 1e-3 * heights[:, 3], rtol=1e-12)
    for row in (None, 5):
        with pytest.raises(ProfileError, match=f"row is {row}: the file is a map of 8 x 5 heights: give the row"):
            read_profile(tmp_path / "map.nc", row)


def test_instrument_files_that_cannot_be_read_are_named(topography: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "none.sur").write_bytes(b"\xff\x00\x01nothing")
    with pytest.raises(ProfileError, match=r"none\.sur: SurfaceTopography cannot read it .*: export it as text"):
        read_profile(tmp_path / "none.sur")
    heights = np.ma.masked_less(wave(0.25), -0.9)
    topography.UniformLineScan(heights, 1.0, unit="mm").to_netcdf(str(tmp_path / "holes.nc"))
    with pytest.raises(ProfileError, match=f"{np.count_nonzero(heights.mask)} of 1000 heights are unknown"):
        read_profile(tmp_path / "holes.nc")


def test_the_unit_of_an_instrument_must_be_that_of_the_scene(topography: ModuleType, tmp_path: Path) -> None:
    heights = 1e-3 * np.cos(2.0 * np.pi * np.arange(64) / 64)
    topography.UniformLineScan(heights, 1.0, unit="mm").to_netcdf(str(tmp_path / "scan.nc"))
    text = SCENE.replace("profile.txt", "scan.nc")
    with pytest.raises(bk.InputError, match=r"up to its period, 1\.0: .*; the file is in 'm', and scale converts it"):
        bk.scene_from_toml(text, folder=tmp_path)
    text = text.replace(", period = 1.0 } }", " } }")
    with pytest.raises(
        bk.InputError, match=r"is 'mm', but the file of the profile of part 'zone' is in 'm': give it scale = 1000"
    ):
        bk.scene_from_toml(text, folder=tmp_path)
    scaled = bk.scene_from_toml(text.replace('"scan.nc"', '"scan.nc", scale = 1000.0'), folder=tmp_path)
    (part,) = scaled.only.contact_parts
    assert isinstance(part.condition, bk.Contact)
    assert isinstance(part.condition.obstacle, Profile)
    np.testing.assert_allclose(part.condition.obstacle.heights(np.arange(4) / 4), [1e-3, 0.0, -1e-3, 0.0], atol=1e-12)
