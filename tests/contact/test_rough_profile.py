"""Rough profiles: files that hold one and files that do not, and the statistics of those drawn at random."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.profile_file import ProfileError, read_profile
from bemkit.contact.profile_filters import Levelling
from bemkit.contact.rough_profile import ProfilePoints


def file_of(folder: Path, text: str) -> str:
    path = folder / "profile.csv"
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize(
    "text",
    [
        "x,height\n0.0,1.0\n1.0,3.0\n2.5,2.0\n",
        "# measured\n0.0; 1.0\n1.0; 3.0\n\n2.5; 2.0\n",
        "0.0 1.0\n1.0\t3.0\n2.5 2.0",
    ],
)
def test_two_columns_are_read(tmp_path: Path, text: str) -> None:
    read = read_profile(file_of(tmp_path, text))
    np.testing.assert_array_equal(read.x, [0.0, 1.0, 2.5])
    np.testing.assert_array_equal(read.heights, [1.0, 3.0, 2.0])


def test_the_highest_point_touches_and_beyond_the_ends_there_is_nothing(tmp_path: Path) -> None:
    file = file_of(tmp_path, "0,1\n1,3\n2.5,2\n")
    points = np.array([[-1.0, 0.0], [0.5, 0.0], [1.0, 0.0], [3.0, 0.0]])
    gap = bk.Profile(file, distance=0.25).gap(points, np.zeros_like(points))
    np.testing.assert_array_equal(gap, [np.inf, 1.25, 0.25, np.inf])
    periodic = bk.Profile(file, period=3.0).gap(points, np.zeros_like(points))
    np.testing.assert_allclose(periodic, [3.0 - (2.0 - 0.0 * 2.0) + 0.0, 1.0, 0.0, 2.0], atol=1.0)
    assert periodic[3] == pytest.approx(2.0)  # x = 3 is x = 0 again


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0,1\n1,nan\n2,3\n", r"line 2 is '1,nan': give two finite numbers"),
        ("0,1\n1,\n2,3\n", r"line 2 is '1,': give two finite numbers"),
        ("0,1\n1,2,3\n", r"line 2 is '1,2,3': give two finite numbers"),
        ("0,1\n1,up\n", r"line 2 is '1,up': give two finite numbers"),
        ("0,1\n2,3\n1,2\n", r"line 3: the position 1 comes after 2: sort the lines"),
        ("0,1\n1,3\n1,2\n", r"line 3: the position 1 comes after 1: sort the lines"),
        ("0,1\n1,3\n2,1\n3,1\n10,2\n", r"line 5: no points between 3 and 10, 7 usual steps: cut the profile"),
        ("# nothing\n0,1\n", r"has 1 points: give at least two lines"),
    ],
)
def test_what_is_no_profile_is_named_by_its_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ProfileError, match=message):
        bk.Profile(file_of(tmp_path, text))


def test_files_that_cannot_be_read_and_periods_too_short(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match=r"none\.csv: cannot be read \(No such file"):
        bk.Profile(str(tmp_path / "none.csv"))
    with pytest.raises(ProfileError, match=r"more than its period, 2\.0"):
        bk.Profile(file_of(tmp_path, "0,1\n1,3\n2.5,2\n"), period=2.0)
    with pytest.raises(ProfileError, match=r"is 2\.5 long, and no points are known up to its period, 10"):
        bk.Profile(file_of(tmp_path, "0,1\n1,3\n2.5,2\n"), period=10.0)
    with pytest.raises(ProfileError, match="row is 2, but the file is one profile: remove row"):
        bk.Profile(file_of(tmp_path, "0,1\n1,3\n"), row=2)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"distance": float("nan")}, "distance is nan: give a finite number"),
        ({"scale": -1.0}, "scale is -1.0: give a positive number"),
        ({"longest_wavelength": 0.0}, "longest_wavelength is 0.0: give a positive number"),
        ({"height_scale": 0.0}, "height_scale is 0.0: give a finite factor other than zero"),
        (
            {"shortest_wavelength": 0.8, "longest_wavelength": 0.08},
            "shortest_wavelength is 0.8: give less than longest_wavelength, 0.08",
        ),
    ],
)
def test_options_of_profiles_out_of_range_are_named(tmp_path: Path, changes: dict[str, float], message: str) -> None:
    with pytest.raises(bk.InputError, match=message):
        bk.Profile(file_of(tmp_path, "0,1\n1,3\n"), **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (((0.0, 1.0),), "points has 1 entries: give at least two finite points"),
        (((0.0, 1.0), (1.0, float("inf"))), "points has 2 entries: give at least two finite points"),
        (((0.0, 1.0), (2.0, 1.0), (1.0, 1.0)), r"points\[2\] is at x = 1 after 2: sort the points by x"),
    ],
)
def test_points_that_are_no_profile_are_named(points: tuple[tuple[float, float], ...], message: str) -> None:
    with pytest.raises(bk.InputError, match=message):
        ProfilePoints(points)


def test_scales_are_factors_of_positions_and_heights(tmp_path: Path) -> None:
    profile = bk.Profile(file_of(tmp_path, "0,1\n1,3\n"), scale=10.0, height_scale=0.1).profile
    assert profile.points == ((0.0, 1.0), (10.0, 3.0))


def test_a_profile_is_levelled_before_its_period_begins_again(tmp_path: Path) -> None:
    file = file_of(tmp_path, "0,1\n1,3\n2,2\n3,4\n")
    ends = bk.Profile(file, period=4.0, levelling=Levelling.ENDS).profile
    np.testing.assert_allclose(ends.columns[1], [0.0, 1.0, -1.0, 0.0], atol=1e-15)
    assert ends.seam_jump == 0.0


@pytest.mark.parametrize("file", ["surface.sdf", "scan.txt"])
def test_files_of_instruments_need_an_extra(tmp_path: Path, without: Callable[..., None], file: str) -> None:
    (tmp_path / file).write_bytes(b"\xff\x00binary" if file == "surface.sdf" else b"a\0b")
    without("SurfaceTopography")
    with pytest.raises(ProfileError, match=r'need SurfaceTopography: pip install "bemkit\[surface\]"'):
        bk.Profile(str(tmp_path / file))


def rough(**changes: object) -> bk.SelfAffineProfile:
    given = {"period": 2.0, "rms_height": 1e-3, "hurst": 0.7, "roll_off": 0.5, "cut_off": 0.01, "seed": 4}
    return bk.SelfAffineProfile(**(given | changes))  # type: ignore[arg-type]


def test_a_self_affine_profile_has_its_statistics() -> None:
    profile = rough()
    x, heights = profile.points
    assert heights.std() == pytest.approx(1e-3, rel=1e-12)
    spectrum = np.abs(np.fft.rfft(heights))[1:] ** 2
    flat, falling = spectrum[:4], spectrum[4:200]
    np.testing.assert_allclose(flat, flat[0])
    waves = np.arange(5, 201)
    slope = np.polyfit(np.log(waves), np.log(falling), 1)[0]
    assert slope == pytest.approx(-1.0 - 2.0 * 0.7, rel=1e-6)
    assert spectrum[200:].max() < 1e-20 * flat[0]
    assert np.gradient(heights, x).std() == pytest.approx(profile.rms_slope, rel=0.02)  # differences of a 16th wave


def test_the_same_seed_gives_the_same_profile_on_any_points() -> None:
    x = np.linspace(0.0, 2.0, 4001)
    np.testing.assert_array_equal(rough().heights(x), rough().heights(x))
    assert np.abs(rough().heights(x) - rough(seed=5).heights(x)).max() > 1e-3
    np.testing.assert_allclose(rough().heights(x + 2.0), rough().heights(x), atol=1e-12)
    gap = rough(distance=0.5).gap(np.stack([x, 0.0 * x], axis=1), np.zeros((x.size, 2)))
    assert gap.min() == pytest.approx(0.5, abs=1e-5)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"period": -1.0}, "period is -1.0: give a positive length"),
        ({"rms_height": 0.0}, "rms_height is 0.0: give a positive length"),
        ({"cut_off": float("inf")}, "cut_off is inf: give a positive length"),
        ({"hurst": 1.2}, "hurst is 1.2: give a number from 0 to 1"),
        ({"roll_off": 3.0}, "roll_off is 3.0: give a wavelength from cut_off, 0.01, to period, 2.0"),
        ({"cut_off": 1e-7}, "cut_off is 1e-07: give at least a millionth of the period"),
        ({"seed": -1}, "seed is -1: give a whole number"),
        ({"distance": float("inf")}, "distance is inf: give a finite number"),
    ],
)
def test_numbers_out_of_range_are_named(changes: dict[str, object], message: str) -> None:
    with pytest.raises(bk.InputError, match=message):
        rough(**changes)


def test_a_profile_from_a_file_is_the_surface_of_a_scene(tmp_path: Path) -> None:
    """The same surface drawn at random and by way of a file, on the points of the elements."""
    profile = rough(period=1.0)
    x = (np.arange(1024) + 0.5) / 1024
    np.savetxt(tmp_path / "rough.txt", np.stack([x, profile.heights(x)], axis=1))
    text = """
        title = "rough"
        shape = {{ kind = "periodic-half-plane", period = 1.0 }}
        material = {{ youngs_modulus = 1.0, poisson_ratio = 0.3 }}
        law = {{ kind = "coulomb", friction_coefficient = 0.3 }}
        far = {{ force_x = 0.001, force_y = 0.01 }}
        mesh = {{ elements = 1024 }}
        [parts.zone]
        condition = {{ kind = "contact", obstacle = {obstacle} }}
    """
    scenes = [
        bk.scene_from_toml(text.format(obstacle=obstacle), folder=tmp_path)
        for obstacle in (
            '{ kind = "profile", file = "rough.txt", period = 1.0 }',
            '{ kind = "self-affine", period = 1.0, rms_height = 1e-3, hurst = 0.7, roll_off = 0.5, cut_off = 0.01, '
            "seed = 4 }",
        )
    ]
    one, other = map(bk.run, scenes)
    assert one.is_converged
    assert other.is_converged
    # the file knows the height on the elements alone, so that its highest point is a little lower
    np.testing.assert_array_equal(one.contact.status, other.contact.status)
    np.testing.assert_allclose(one.contact.sigma_n, other.contact.sigma_n, atol=1e-6)
    # what is written holds the points, and needs the file no more
    (tmp_path / "rough.txt").unlink()
    again = bk.scene_from_toml(bk.scene_to_toml(scenes[0])).only.parts[0].condition
    assert isinstance(again, bk.Contact)
    points = np.column_stack([one.contact.x, one.contact.y])
    np.testing.assert_array_equal(again.obstacle.gap(points, points), one.contact.gap)
