"""Load histories as moving pictures: the deformed bodies step by step."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory

from bemkit.atomic_files import OutputFileError, check_target, replacing
from bemkit.errors import InputError
from bemkit.pictures.deformation import draw_deformation
from bemkit.pictures.drawing import new_figure
from bemkit.pictures.magnification import magnification
from bemkit.pictures.plane import joined_frame, set_frame
from bemkit.pictures.shown import shown
from bemkit.results.solution import Solution

GIF, MP4 = ".gif", ".mp4"
_DOTS_PER_INCH = 80
_MARGIN = 0.15
"""Margin for loads and supports around the bodies, relative to the longer side."""


def save_animation(path: str | Path, steps: Sequence[Solution], *, steps_per_second: int = 3) -> Path:
    """Write a moving picture of the deformed bodies over the steps of a load history.

    Displacements of all steps are enlarged by the same factor: the smallest factor of all steps.

    Parameters
    ----------
    path : str or Path
        Ends in ``.gif``, or in ``.mp4`` where the encoder ffmpeg is installed, or the package imageio-ffmpeg with one.
    steps : sequence of Solution
        As `bemkit.run` returns them for a sequence of scenes.
    steps_per_second : int

    Raises
    ------
    InputError
        If there is no step, or the speed is not from 1 to 60.
    OutputFileError
        If the ending is unknown, the encoder is missing, or the file cannot be written.
    """
    if not steps:
        raise InputError("steps is empty: give the solutions of a load history")
    if not 1 <= steps_per_second <= 60:
        raise InputError(f"steps_per_second is {steps_per_second}: give a whole number from 1 to 60")
    target = check_animation(path)
    from matplotlib import rc_context
    from matplotlib.animation import FFMpegWriter, PillowWriter

    writer = (PillowWriter if target.suffix.lower() == GIF else FFMpegWriter)(fps=steps_per_second)
    scenes = [shown(step) for step in steps]
    factor = min(magnification(scene) for scene in scenes)
    loops = [loop for scene in scenes for body in scene.bodies for loop in body.outlines(factor)]
    frame = joined_frame(scenes[0].frame.T, *loops)
    figure = new_figure(6.4, 5.6)
    encoder = rc_context({"animation.ffmpeg_path": _encoder() or ""})
    with TemporaryDirectory() as folder, replacing(target) as temporary, encoder:
        film = Path(folder) / target.name
        with writer.saving(figure, str(film), dpi=_DOTS_PER_INCH):
            for number, step in enumerate(steps, start=1):
                figure.clear()
                axes = draw_deformation(step, figure.add_subplot(), factor=factor)
                axes.set_title(f"{step.title}\nstep {number} of {len(steps)}", parse_math=False)
                set_frame(axes, frame, margin=_MARGIN)
                writer.grab_frame()
        temporary.write_bytes(film.read_bytes())
    return target


def check_animation(path: str | Path) -> Path:
    """Check that an animation can be written, and return its path; OutputFileError if not."""
    target = Path(path)
    if target.suffix.lower() not in (GIF, MP4):
        raise OutputFileError(f"{target}: unknown ending of a moving picture: choose .gif or .mp4")
    if target.suffix.lower() == MP4 and _encoder() is None:
        raise OutputFileError(f'{target}: .mp4 needs an encoder: pip install "bemkit[movie]", or choose .gif')
    return check_target(target)


def _encoder() -> str | None:
    """Return the program ffmpeg of the system, or else that of the package imageio-ffmpeg; None without both."""
    from matplotlib import rcParams

    found = which(str(rcParams["animation.ffmpeg_path"]))
    if found is None and find_spec("imageio_ffmpeg") is not None:
        import imageio_ffmpeg

        with suppress(RuntimeError):  # a package for a system without one of its own
            found = str(imageio_ffmpeg.get_ffmpeg_exe())
    return found
