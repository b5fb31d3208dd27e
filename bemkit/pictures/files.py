"""Pictures in files: a folder of them, or one in the format that the ending names."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bemkit.atomic_files import OutputFileError, check_target
from bemkit.errors import InputError
from bemkit.pictures.animation import GIF, MP4, check_animation, save_animation
from bemkit.pictures.catalogue import figures, find_picture
from bemkit.pictures.figure_files import FIGURE_FORMATS, check_figure_folder, write_figure, write_figures
from bemkit.results.solution import Solution

LEAST_WIDTH = 50.0
"""Width [mm] of a picture that has room for its text."""
ANIMATION = "animation"
"""The one picture that moves; see `bemkit.pictures.animation`."""


def save_pictures(
    result: Solution | Sequence[Solution],
    place: str | Path,
    what: Sequence[str] | None = None,
    *,
    dots_per_inch: int = 150,
    width: float | None = None,
) -> tuple[Path, ...]:
    """Draw pictures of a result into a folder, or one picture into a file.

    Parameters
    ----------
    result : Solution, or a sequence of them
        The steps of a load history, for those that move; others show the last one.
    place : str or Path
        A folder, which is made if need be, for ``NAME.png`` of each picture; or a file that ends in ``.png``,
        ``.svg`` or ``.pdf``, for a picture that moves in ``.gif`` or ``.mp4``.
    what : sequence of str, optional
        Names from `bemkit.pictures.catalogue.PICTURES`, or ``"animation"``; by default those that suit the result.
    dots_per_inch : int
    width : float, optional [mm]
        For print, such as 85 for a column: all text in 7 points and no title, which belongs into the caption. Not of
        the animation.

    Raises
    ------
    InputError
        If a name is unknown, there is no such picture of the result, or the width is less than 50 mm.
    OutputFileError
        If the folder or a file cannot be written, or matplotlib is missing.
    """
    place = Path(place)
    if width is not None and not width >= LEAST_WIDTH:
        raise InputError(f"width is {width}: give {LEAST_WIDTH:g} mm or more")
    check_place(place, what)
    steps = result if isinstance(result, Sequence) else [result]
    if not steps:
        raise InputError("steps is empty: give the solutions of a load history")
    still = None if what is None else [name for name in what if name != ANIMATION]
    if place.suffix.lower() in (GIF, MP4):
        return (save_animation(place, steps),)
    if place.suffix.lower() in FIGURE_FORMATS:
        drawn = figures(steps[-1], still)
        if len(drawn) > 1:
            raise OutputFileError(f"{place}: one file for {len(drawn)} pictures: give a folder, or name one picture")
        return tuple(write_figure(place, figure, dots_per_inch, width) for figure in drawn.values())
    paths = write_figures(figures(steps[-1], still), place, dots_per_inch, width)
    return (
        paths if what is None or ANIMATION not in what else (*paths, save_animation(place / f"{ANIMATION}{GIF}", steps))
    )


def check_place(place: str | Path, what: Sequence[str] | None) -> list[Path]:
    """Find out, before any work is done, whether pictures are known and can be written; return the file, if it is one.

    Raises
    ------
    InputError
        If a name is unknown.
    OutputFileError
        If the place does not take them, or matplotlib is missing.
    """
    place = Path(place)
    for name in what or ():
        if name != ANIMATION:
            find_picture(name)
    check_figure_folder(None)
    ending = place.suffix.lower()
    if ending in (GIF, MP4):
        if what is not None and list(what) != [ANIMATION]:
            raise OutputFileError(f"{place}: only the picture 'animation' can be written to .gif or .mp4")
        return [check_animation(place)]
    if ending in FIGURE_FORMATS:
        if what is None or len(set(what)) != 1 or ANIMATION in what:
            raise OutputFileError(f"{place}: one file takes one picture: name one, or give a folder")
        return [check_target(place)]
    check_figure_folder(place)
    return []
