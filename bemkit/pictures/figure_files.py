"""Figures in files: .png, .svg, .pdf."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from bemkit.atomic_files import FILE_ENDINGS, OutputFileError, check_target, replacing
from bemkit.pictures.publication import fitted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURE_FORMATS = {".png": "Software", ".svg": "Date", ".pdf": "CreationDate"}
"""Formats by the ending of the file, with metadata that make equal pictures equal files."""


def write_figures(
    figures: Mapping[str, Figure], folder: Path, dots_per_inch: int = 150, width: float | None = None
) -> tuple[Path, ...]:
    """Write figures, by file names without ``.png``, each all or nothing, into a folder that is made if need be.

    Returns the paths.

    Raises
    ------
    OutputFileError
        If a file cannot be written.
    """
    make_folder(folder)
    targets = [check_target(folder / f"{name}.png") for name in figures]
    return tuple(
        write_figure(target, figure, dots_per_inch, width)
        for target, figure in zip(targets, figures.values(), strict=True)
    )


def write_figure(path: Path, figure: Figure, dots_per_inch: int = 150, width: float | None = None) -> Path:
    """Write a figure in the format that the ending names, all or nothing; see `FIGURE_FORMATS`, of a width `fitted`."""
    target, ending = check_target(path), path.suffix.lower()
    box = "tight" if width is None else fitted(figure, width)
    with replacing(target) as temporary:
        figure.savefig(
            temporary,
            dpi=dots_per_inch,
            format=ending[1:],
            metadata={FIGURE_FORMATS[ending]: None},
            bbox_inches=box,
            pad_inches=0.08,
        )
    return target


def check_figure_folder(folder: Path | None, figure: str = "figure") -> None:
    """Find out, before any work is done, whether figures can be drawn and written into a folder, by the name of one.

    Raises
    ------
    OutputFileError
    """
    if find_spec("matplotlib") is None:
        raise OutputFileError('figures need matplotlib: pip install "bemkit[plot]"')
    if folder is None:
        return
    if folder.exists() and not folder.is_dir():
        raise OutputFileError(f"{folder}: exists and is not a folder: choose another name for the figures")
    if folder.suffix.lower() in FILE_ENDINGS and not folder.exists():
        raise OutputFileError(
            f"{folder}: the ending {folder.suffix!r} is that of a file: give a folder, or for one picture of bemkit "
            f"plot a name that ends in {', '.join(FIGURE_FORMATS)}"
        )
    check_target(folder / f"{figure}.png" if folder.exists() else folder)


def make_folder(folder: Path) -> None:
    """Make a folder if it does not exist; OutputFileError if that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = f"the folder cannot be made ({error.strerror})"
        raise OutputFileError(f"{folder}: {reason}: give the name of a folder") from error
