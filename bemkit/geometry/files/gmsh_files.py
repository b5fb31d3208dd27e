"""Meshes and geometries through gmsh's own package: .msh of every version, .geo, STEP and IGES."""

from __future__ import annotations

import importlib.util
import re
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import current_thread, main_thread
from typing import Any

import numpy as np

from bemkit.errors import GeometryError, printable
from bemkit.geometry.files.chords import ChordLoop, fitted_strokes, strokes_of
from bemkit.geometry.files.plane_mesh import CellBlock, PlaneMesh, in_plane
from bemkit.geometry.files.strokes import Stroke, check_only

_N_SAMPLES = 129
"""Number of points of a curve of a geometry, with its ends: a cubic spline through them is as accurate as most
files."""
_CORNERS = {"Line": 2, "Triangle": 3, "Quadrilateral": 4}
_CALLS = re.compile(
    rb"\b(System|SystemCall|NonBlockingSystemCall|OnelabRun|OnelabRunClient|UnlinkFile|DeleteFile|RenameFile|CreateDir|"
    rb"Merge|MergeFile|MergeWithBoundingBox|Include|ShapeFromFile|Open|Save|Print|Plugin|NonBlocking\w*)\b"
)
_NAMES = re.compile(rb"\$PhysicalNames\s(.*?)\$EndPhysicalNames", re.DOTALL)
_MOST_HEAD = 1_000_000
_COMMENTS = re.compile(rb"//[^\n]*|/\*.*?\*/", re.DOTALL)


def why_no_gmsh() -> str:
    """Return why gmsh's package cannot be used, and the remedy; empty if it can."""
    if importlib.util.find_spec("gmsh") is None:
        return 'gmsh is not installed: pip install "bemkit[mesh]"'
    try:
        import gmsh  # noqa: F401
    except (OSError, ImportError) as error:  # its wheel needs libraries of the desktop
        return f"gmsh cannot be loaded ({printable(str(error))}): install that library, such as libglu1-mesa"
    return ""


def read_with_gmsh(path: Path) -> PlaneMesh:
    """Read a plane mesh from a .msh file.

    Raises
    ------
    GeometryError
        If gmsh is missing or cannot read the file, or the file holds no plane mesh.
    """
    with path.open("rb") as stream:
        if not stream.read(100).lstrip().startswith(b"$"):  # gmsh would run anything else as a .geo file
            raise GeometryError("it cannot be read: a .msh file begins with $MeshFormat: export it again")
    with _opened(path) as gmsh:
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        if not len(tags):
            raise GeometryError("it is empty, without nodes: mesh the surface (gmsh -2) and save it")
        if any(
            len(each) for _, entity in gmsh.model.getEntities(3) for each in gmsh.model.mesh.getElements(3, entity)[1]
        ):
            raise GeometryError("it holds a three-dimensional mesh: bemkit solves plane problems; give a plane mesh")
        position = np.zeros(int(max(tags)) + 1, np.intp)
        position[tags] = np.arange(len(tags))
        blocks = [block for dimension in (1, 2) for block in _blocks(gmsh, dimension, position)]
        return PlaneMesh(in_plane(np.asarray(coordinates).reshape(-1, 3)), tuple(blocks), _listed_names(path))


def _blocks(gmsh: Any, dimension: int, position: Any) -> Iterator[CellBlock]:
    for _, entity in gmsh.model.getEntities(dimension):
        name = _name(gmsh, dimension, entity)
        kinds, elements, nodes = gmsh.model.mesh.getElements(dimension, entity)
        for kind, own, own_nodes in zip(kinds, elements, nodes, strict=True):
            title, _, order, n_nodes, _, _ = gmsh.model.mesh.getElementProperties(kind)
            cells = position[np.asarray(own_nodes, dtype=np.intp)].reshape(-1, n_nodes)
            curves = np.full(len(own), entity if dimension == 1 else 0, np.intp)
            yield CellBlock(_CORNERS[title.split()[0]], order, cells, (name,) * len(own), curves)


def _listed_names(path: Path) -> tuple[str, ...]:
    """Return the names of groups in the head of a .msh file, where gmsh itself forgets those without cells."""
    with path.open("rb") as stream:
        section = _NAMES.search(stream.read(_MOST_HEAD))
    names = re.findall(rb'"([^"\n]*)"', section[1]) if section else []
    return tuple(printable(name.decode("utf-8", "replace")) for name in names)


def read_geometry(path: Path, only: Sequence[str], corner_angle: float) -> tuple[list[Stroke], list[str]]:
    """Read the curves that bound the surfaces of a .geo, STEP or IGES file.

    Parameters
    ----------
    path : Path
    only : sequence of str
        Physical names of the surfaces that are the body; all surfaces if empty.
    corner_angle : float [degree]
        See `bemkit.geometry.files.chords`.

    Raises
    ------
    GeometryError
        If gmsh is missing or cannot read the file, the geometry is not plane, or a .geo file calls commands.
    """
    if path.suffix.lower() == ".geo":
        _check_calls(path)
    with _opened(path) as gmsh:
        if gmsh.model.getEntities(3):
            raise GeometryError(
                "it holds a solid: bemkit solves plane problems; give the face that is its cross-section"
            )
        surfaces = [tag for _, tag in gmsh.model.getEntities(2)]
        names = {tag: _name(gmsh, 2, tag) for tag in surfaces}
        check_only(only, sorted({*names.values()} - {""}), "the names of its surfaces")
        chosen = [(2, tag) for tag in surfaces if not only or names[tag] in only]
        curves = gmsh.model.getBoundary(chosen, oriented=False) if chosen else gmsh.model.getEntities(1)
        if not curves:
            raise GeometryError("it is empty, without curves: draw a closed outline")
        sampled = [(_sampled(gmsh, tag), _name(gmsh, 1, tag)) for _, tag in curves]
    plane = in_plane(np.concatenate([points for points, _ in sampled]))
    strokes: list[Stroke] = []
    for k, (points, name) in enumerate(sampled):
        own = plane[k * _N_SAMPLES : k * _N_SAMPLES + len(points)]
        strokes += _strokes(own, name, corner_angle)
    notes = ["its curves that are not lines and arcs are splines through 129 of their points"]
    is_free = any(type(stroke.side).__name__ == "SplineTo" for stroke in strokes)
    return strokes, notes if is_free else []


def _sampled(gmsh: Any, tag: int) -> Any:
    (low,), (high,) = gmsh.model.getParametrizationBounds(1, tag)
    return np.asarray(gmsh.model.getValue(1, tag, np.linspace(low, high, _N_SAMPLES).tolist())).reshape(-1, 3)


def _strokes(points: Any, name: str, corner_angle: float) -> list[Stroke]:
    size = np.ptp(points, axis=0).max()
    if np.abs(points[0] - points[-1]).max() > 1e-9 * size:
        return fitted_strokes(points, name)
    n = len(points) - 1
    loop = ChordLoop(points[:-1], (name,) * n, np.zeros(n, bool), np.zeros(n, bool), np.ones(n, bool))
    return strokes_of(loop, corner_angle)


def _name(gmsh: Any, dimension: int, tag: int) -> str:
    """Return the first physical name of an entity, ``physical-5`` for a number without a name, empty for none."""
    groups = gmsh.model.getPhysicalGroupsForEntity(dimension, tag)
    return (gmsh.model.getPhysicalName(dimension, groups[0]) or f"physical-{groups[0]}") if len(groups) else ""


def _check_calls(path: Path) -> None:
    """Refuse a .geo file, which gmsh runs as a program, where it calls others or reads and writes files."""
    found = _CALLS.search(_COMMENTS.sub(b"", path.read_bytes()))
    if found:
        raise GeometryError(
            f"it says {found[0].decode()}: .geo files that call programs or other files are refused; save its mesh "
            "or its geometry with gmsh and give that"
        )


def _initialise(gmsh: Any) -> None:
    """Start gmsh, which would let a pipe that breaks end the whole process from then on, without a word."""
    number = getattr(signal, "SIGPIPE", None)
    before = None if number is None else signal.getsignal(number)
    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    if number is not None and before is not None and current_thread() is main_thread():
        signal.signal(number, before)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a file as a model of gmsh of its own, and leave gmsh as it was."""
    if reason := why_no_gmsh():
        raise GeometryError(reason)
    import gmsh

    was_there = bool(gmsh.isInitialized())
    if not was_there:
        _initialise(gmsh)
    before = gmsh.model.getCurrent() if was_there else ""
    speaks = gmsh.option.getNumber("General.Terminal")
    gmsh.option.setNumber("General.Terminal", 0)
    try:
        try:
            gmsh.model.add(f"bemkit {path.name}")
            gmsh.merge(str(path))  # where opening would clear the models there are
        except Exception as error:  # gmsh's own class of all its errors
            raise GeometryError(f"gmsh cannot read it ({printable(str(error))}): export it again") from error
        yield gmsh
    finally:
        gmsh.option.setNumber("General.Terminal", speaks)
        if was_there:
            gmsh.model.remove()
            gmsh.model.setCurrent(before)
        else:
            gmsh.finalize()
