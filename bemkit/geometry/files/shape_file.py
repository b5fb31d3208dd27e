"""Shapes from files of other programs: meshes and drawings."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from bemkit.errors import GeometryError, shown_path
from bemkit.geometry.curves import require_positive
from bemkit.geometry.files.chords import CORNER_ANGLE
from bemkit.geometry.files.strokes import Stroke, extent, join_strokes, named_loops
from bemkit.geometry.free_form.drawn import OutlineShape
from bemkit.geometry.outline import Outline

if TYPE_CHECKING:
    from bemkit.geometry.files.plane_mesh import PlaneMesh

GAP = 1e-5
"""Gaps between lines of a drawing that are closed, relative to its size."""
_GEOMETRIES = (".geo", ".step", ".stp", ".iges", ".igs")
_DRAWINGS = (".dxf", ".svg")


@dataclass(frozen=True)
class Drawn:
    """Content of a file.

    Parameters
    ----------
    strokes : list of Stroke
        In any order and sense.
    notes : list of str
        Notes on how it was read.
    unit : str
        Unit of length that the file states; empty if none.
    tolerance : float
        Distance of ends that are one point, relative to the size.
    """

    strokes: list[Stroke]
    notes: list[str]
    unit: str
    tolerance: float


@dataclass(frozen=True)
class ShapeFile(ABC):
    """A body in a file of another program; see `MeshFile` and `DrawingFile`."""

    file: str
    scale: float | None = None
    only: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "only", tuple(self.only))
        if self.scale is not None:
            require_positive("file", scale=self.scale)

    @abstractmethod
    def drawn(self, path: Path) -> Drawn:
        """Read the lines and curves of the file."""

    @cached_property
    def shape(self) -> OutlineShape:
        """Content of the file, in plain numbers.

        Raises
        ------
        GeometryError
            If a package is missing, the file cannot be read, or what it holds bounds no body in the plane.
        """
        path = Path(self.file)
        try:
            if not path.is_file():
                raise GeometryError("no such file: give the path of a mesh or drawing")
            return self._shape(self.drawn(path))
        except OSError as error:
            raise GeometryError(
                f"{shown_path(path)}: cannot be read ({error.strerror}): give a readable file"
            ) from error
        except GeometryError as error:
            raise GeometryError(f"{shown_path(path)}: {error}") from error

    def outline(self) -> Outline:
        """Return the outline of the body in the file, which is read once."""
        return self.shape.outline()

    def _shape(self, drawn: Drawn) -> OutlineShape:
        if not drawn.strokes:
            raise GeometryError("it is empty, without lines: draw a closed outline")
        loops, notes = join_strokes(drawn.strokes, drawn.tolerance * extent(drawn.strokes))
        factor = 1.0 if self.scale is None else self.scale
        if factor != 1.0:
            loops = [[stroke.mapped(lambda p: (factor * p[0], factor * p[1])) for stroke in loop] for loop in loops]
        unit = drawn.unit if self.scale is None else ""
        shape = OutlineShape(named_loops(loops), (*drawn.notes, *notes), unit)
        shape.outline()
        return shape


@dataclass(frozen=True)
class MeshFile(ShapeFile):
    """A body in a mesh or geometry file: gmsh's .msh and .geo, STEP, IGES, and the formats of meshio.

    Parameters
    ----------
    file : str
        Its path.
    scale : float, optional
        Factor of all coordinates of the file; default 1.
    only : tuple of str
        Names of the surfaces that are the body (physical groups); all if empty.
    corner_angle : float [degree]
        Straight pieces that turn by no more are chords of a smooth curve, and taken as that.

    Raises
    ------
    GeometryError
        If a number is out of range. What is wrong with the file is said when its outline is first asked for.
    """

    corner_angle: float = CORNER_ANGLE

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.corner_angle < 180.0:
            raise GeometryError(f"corner_angle is {self.corner_angle}: give degrees from 0 to less than 180")

    def drawn(self, path: Path) -> Drawn:
        """Read the lines, arcs and smooth curves that bound the body."""
        if is_drawing(path):
            raise GeometryError("it is a drawing: write kind = 'drawing' (DrawingFile in Python)")
        if path.suffix.lower() in _GEOMETRIES:
            from bemkit.geometry.files.gmsh_files import read_geometry

            strokes, notes = read_geometry(path, self.only, self.corner_angle)
            unit = "" if path.suffix.lower() == ".geo" else "mm"  # to which OpenCASCADE converts all others
            return Drawn(strokes, notes, unit, 1e-7)
        from bemkit.geometry.files.chords import note_on_curves, strokes_of
        from bemkit.geometry.files.plane_mesh import boundary_chains

        chains, notes = boundary_chains(_plane_mesh(path), self.only)
        strokes = [stroke for chain in chains for stroke in strokes_of(chain, self.corner_angle)]
        note = note_on_curves(strokes)
        return Drawn(strokes, [*notes, note] if note else notes, "", 1e-12)


@dataclass(frozen=True)
class DrawingFile(ShapeFile):
    """A body in a drawing: DXF or SVG.

    Parameters
    ----------
    file : str
        Its path.
    scale : float, optional
        Factor of all coordinates of the file; default 1.
    only : tuple of str
        Layers (DXF), ids or labels (SVG) of what is the outline; all if empty.
    tolerance : float, optional
        Gaps between lines, in the unit of the file, that are closed; by default 1e-5 of the size of the drawing.

    Raises
    ------
    GeometryError
        If a number is out of range. What is wrong with the file is said when its outline is first asked for.
    """

    tolerance: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tolerance is not None:
            require_positive("file", tolerance=self.tolerance)

    def drawn(self, path: Path) -> Drawn:
        """Read the lines and curves of the drawing."""
        ending = path.suffix.lower()
        if ending == ".dxf":
            from bemkit.geometry.files.dxf import read_dxf

            strokes, unit, notes = read_dxf(path, self.only)
        elif ending == ".svg":
            from bemkit.geometry.files.svg import read_svg

            strokes, unit = read_svg(path, self.only)
            notes = []
        else:
            raise GeometryError("it is not a drawing that bemkit reads: give .dxf or .svg, or write kind = 'mesh'")
        if self.tolerance is not None and strokes:
            return Drawn(strokes, notes, unit, self.tolerance / extent(strokes))
        return Drawn(strokes, notes, unit, GAP)


def is_drawing(path: str | Path) -> bool:
    """Return whether a file is a drawing, by the ending of its name."""
    return Path(path).suffix.lower() in _DRAWINGS


def _plane_mesh(path: Path) -> PlaneMesh:
    from bemkit.geometry.files.gmsh_files import read_with_gmsh, why_no_gmsh
    from bemkit.geometry.files.meshio_files import read_with_meshio

    if path.suffix.lower() != ".msh":
        return read_with_meshio(path)
    if not (reason := why_no_gmsh()):
        return read_with_gmsh(path)
    try:
        return read_with_meshio(path)
    except GeometryError as error:
        raise GeometryError(f"{error}; meshio read it because {reason}") from error
