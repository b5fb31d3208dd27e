"""Load histories as moving pictures."""

from __future__ import annotations

import dataclasses
import subprocess
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib import rc_context
from PIL import Image

import bemkit as bk
from bemkit.atomic_files import OutputFileError
from bemkit.pictures import save_animation
from bemkit.scene.toml import with_overrides

FACTORS = (0.4, 1.0)


@pytest.fixture(scope="module")
def steps() -> tuple[bk.Solution, ...]:
    scene = with_overrides(bk.load_scene("paper-1"), elements=40, discretisation="linear")
    return bk.run([dataclasses.replace(scene, load_factors=FACTORS)])


def test_no_step_is_refused() -> None:
    with pytest.raises(bk.InputError, match="steps is empty"):
        save_animation("a.gif", [])


def test_the_animation_has_a_picture_of_each_step(steps: tuple[bk.Solution, ...], tmp_path: Path) -> None:
    path = save_animation(tmp_path / "square.gif", steps, steps_per_second=5)
    with Image.open(path) as film:
        assert film.n_frames == len(FACTORS)  # type: ignore[attr-defined]
        assert film.info["duration"] == 200
        pictures = []
        for number in range(len(FACTORS)):
            film.seek(number)
            pictures.append(np.asarray(film.convert("L"), dtype=float))
    assert all(np.abs(one - two).max() > 100.0 for one, two in pairwise(pictures))
    assert save_animation(path, steps[:1]) == path  # replaced
    assert [each.name for each in tmp_path.iterdir()] == ["square.gif"]


def test_the_encoder_of_the_package_makes_an_mp4_with_a_picture_of_each_step(
    steps: tuple[bk.Solution, ...], tmp_path: Path
) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    with rc_context({"animation.ffmpeg_path": "no-such-program"}):  # none of the system
        path = save_animation(tmp_path / "square.mp4", steps, steps_per_second=5)
    assert [each.name for each in tmp_path.iterdir()] == ["square.mp4"]
    decode = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "gray", "-"]
    film = subprocess.run(decode, capture_output=True, check=True)
    assert b"Video: h264" in film.stderr
    assert b" 5 fps" in film.stderr
    pictures = np.frombuffer(film.stdout, np.uint8).reshape(-1, 448, 512).astype(float)
    assert len(pictures) == len(FACTORS)
    assert all(np.abs(one - two).max() > 100.0 for one, two in pairwise(pictures))


def test_animations_that_cannot_be_written_are_refused(
    steps: tuple[bk.Solution, ...], tmp_path: Path, without: Callable[..., None]
) -> None:
    without("imageio_ffmpeg")
    for name, message in (
        ("a.avi", "unknown ending of a moving picture: choose .gif or .mp4"),
        ("a.mp4", r"\.mp4 needs an encoder: pip install \"bemkit\[movie\]\", or choose \.gif"),
    ):
        with pytest.raises(OutputFileError, match=message), rc_context({"animation.ffmpeg_path": "no-such-program"}):
            save_animation(tmp_path / name, steps)
    with pytest.raises(bk.InputError, match="steps_per_second is 0: give a whole number from 1 to 60"):
        save_animation(tmp_path / "a.gif", steps, steps_per_second=0)
