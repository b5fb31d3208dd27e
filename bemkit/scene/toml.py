"""Scene files: TOML in, `Scene` out, and back.

A `SceneError` lists all mistakes of a file; each line names the key, the value and the remedy.
"""

from __future__ import annotations

import tomllib
from dataclasses import fields, replace
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, Literal, cast

from bemkit.errors import InputError, printable
from bemkit.formulas import closest
from bemkit.scene.discretisation import Discretisation, Galerkin, MeshOptions
from bemkit.scene.registry import FILE_KINDS, RISING, SOLVERS
from bemkit.scene.scene import Scene
from bemkit.scene.serialisation import StructureError, structure
from bemkit.scene.unit_names import UnitNames
from bemkit.solvers.base import ContactSolver
from bemkit.solvers.fallbacks import Fallbacks

MAX_BYTES = 1_000_000

# the order of keys in files that are written, as a reader wants it
_SCENE_KEYS = (
    *("title", "description", "reference", "units", "thickness", "discretisation", "linear_solver", "solver"),
    *("load_factors", "steps", "symmetry", "law", "shape", "material", "body_forces", "far", "touching", "mesh"),
    *("parts", "bodies", "rigid", "contacts"),
)
_BODY_KEYS = ("shape", "material", "body_forces", "far", "placement", "copies", "discretisation", "mesh", "parts")
_RIGID_KEYS = ("obstacle", "centre", "x", "y", "turn", "force_x", "force_y", "moment")
_PART_KEYS = ("sides", "where", "condition")


class SceneError(InputError):
    """A scene that cannot be read, understood or written; each mistake is a line with key, value and remedy."""


def shipped_files(folder_name: str = "shipped") -> dict[str, Traversable]:
    """Return the shipped scene files by name, or those to start from, in the folder ``"new"``."""
    folder = resources.files("bemkit") / "scene" / folder_name
    files = sorted((file for file in folder.iterdir() if file.name.endswith(".toml")), key=lambda file: file.name)
    return {file.name.removesuffix(".toml"): file for file in files}


def shipped_scenes() -> dict[str, str]:
    """Return the titles of the shipped scenes by name."""
    return {name: tomllib.loads(file.read_text("utf-8"))["title"] for name, file in shipped_files().items()}


def load_scene(source: str | Path) -> Scene:
    """Read a scene file, or a scene that is shipped with bemkit.

    Parameters
    ----------
    source : str or Path
        Path of a TOML file, or the name of a shipped scene such as ``"paper-1"``.

    Raises
    ------
    SceneError
        If there is no such file or scene, or its content is not a valid scene.
    """
    shipped = shipped_files()
    name = printable(str(source))[:200] or "''"
    file: Traversable = shipped[str(source)] if str(source) in shipped else Path(source)
    try:
        with file.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except FileNotFoundError:
        names = list(shipped)
        raise SceneError(
            f"{name}: no such file or shipped scene: the shipped scenes are {', '.join(names)}{closest(name, names)}"
        ) from None
    except (OSError, ValueError) as error:  # ValueError: a null character in the path
        reason = getattr(error, "strerror", None) or str(error)
        raise SceneError(f"{name}: cannot be read ({reason}): give the path of a TOML file") from error
    if len(content) > MAX_BYTES:
        raise SceneError(f"{name}: larger than {MAX_BYTES} bytes: a scene file is a short text")
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        raise SceneError(f"{name}: not UTF-8 text: give a TOML file") from None
    return scene_from_toml(text, name=name, folder=None if str(source) in shipped else Path(source).parent)


def single_body(scene: Scene, name: str) -> Scene:
    """Return a scene, and refuse one of several bodies with a SceneError; the name is for the message."""
    if scene.shape is None:
        raise SceneError(f"{name}: there are {len(scene.placed_bodies)} bodies: only scenes of one body can do this")
    return scene


def scene_from_toml(text: str, *, name: str = "scene", folder: Path | None = None) -> Scene:
    """Turn TOML text into a scene.

    Parameters
    ----------
    text : str
    name : str
        Source of the text, for messages.
    folder : Path, optional
        Folder of mesh and drawing files. Without it the text may not name files.

    Raises
    ------
    SceneError
        If the text is not TOML, or not a valid scene.
    """
    if not isinstance(text, str):
        raise SceneError(f"{name} is {text!r}: give the text of a scene file; load_scene(path) reads one")
    try:
        table = tomllib.loads(text.removeprefix("\ufeff"))  # the byte order mark that some editors write
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{name}: not valid TOML: {printable(str(error))}") from None
    except (RecursionError, ValueError):  # ValueError: an integer of thousands of digits
        raise SceneError(f"{name}: not valid TOML: it is nested too deeply, or a number has too many digits") from None
    try:
        return scene_from_table(table, folder)
    except SceneError as error:
        mistakes = str(error).splitlines()
        if len(mistakes) > 1:
            mistakes = [f"{len(mistakes)} mistakes", *(f"  {mistake}" for mistake in mistakes)]
        raise SceneError(f"{name}: " + "\n".join(mistakes)) from error


def scene_from_table(table: dict[str, Any], folder: Path | None = None) -> Scene:
    """Turn the table that a TOML text holds into a scene; see `scene_from_toml`.

    Raises
    ------
    SceneError
        If it is not a valid scene; the message begins with the key.
    """
    table = _with_rising_degrees(_with_places_of_files(table, folder, ""))
    try:
        scene = structure(table, Scene, _units_of(table))
        if scene.steps:
            from bemkit.scene.load_history import load_steps

            _ = load_steps(scene)  # every change of a step is checked
    except StructureError as error:
        raise SceneError("\n".join(map(printable, error.mistakes))) from error
    except InputError as error:
        raise SceneError("\n".join(map(printable, str(error).splitlines()))) from error
    return scene


def _units_of(table: dict[str, Any]) -> UnitNames | None:
    """Return the units of a table and its thickness, None if there are none or their tables hold a mistake."""
    try:
        units = structure(table["units"], UnitNames) if "units" in table else None
        return units if units is None or "thickness" not in table else units.over_thickness(1.0)
    except InputError:  # found again, and named, with the other mistakes of the scene
        return None


def _with_rising_degrees(table: dict[str, Any]) -> dict[str, Any]:
    """Return a table in which the word for rising degrees is an option of the mesh."""
    mesh = table.get("mesh", {})
    if table.get("discretisation") != RISING or not isinstance(mesh, dict):
        return table
    return {**table, "discretisation": "quadratic", "mesh": {**mesh, "rising_degrees": True}}


def _with_places_of_files(table: dict[str, Any], folder: Path | None, path: str) -> dict[str, Any]:
    """Return a table of a scene whose shapes and profiles name their files from the folder of the scene."""
    located = dict(table)
    for name in ("bodies", "parts", "rigid"):
        if isinstance(entries := table.get(name), dict):
            located[name] = {
                key: _with_places_of_files(entry, folder, f"{path}{name}.{key}.") if isinstance(entry, dict) else entry
                for key, entry in entries.items()
            }
    for name in ("shape", "condition", "obstacle"):
        if isinstance(inner := table.get(name), dict):
            located[name] = _with_places_of_files(inner, folder, f"{path}{name}.")
    if table.get("kind") in FILE_KINDS and isinstance(file := table.get("file"), str):
        if folder is None:
            raise SceneError(
                f"{path}file: {printable(file)!r}: a text without a folder names no files: give the folder"
            )
        located["file"] = str(folder / file)
    return located


def scene_to_toml(scene: Scene) -> str:
    """Write a scene as TOML text, without keys that have their default value.

    Returns
    -------
    str
        Text from which `scene_from_toml` makes an equal scene.

    Raises
    ------
    SceneError
        If the scene holds a Python function, or an object of a class that scene files have no name for.
    """
    import tomli_w

    from bemkit.scene.written_tables import UnstructureError, unstructure

    try:
        table = unstructure(scene, keep_defaults=True)
    except UnstructureError as error:
        raise SceneError(str(error)) from error
    if scene.mesh.rising_degrees and scene.discretisation == Galerkin(2):
        table["discretisation"] = RISING
        del table["mesh"]["rising_degrees"]
    for body in table["bodies"]:
        body["parts"] = _named(body.get("parts", []), _PART_KEYS)
    keys_of = {"parts": _PART_KEYS, "bodies": _BODY_KEYS, "rigid": _RIGID_KEYS}
    table |= {name: _named(table[name], keys) for name, keys in keys_of.items()}
    if not scene.has_contact:  # nothing to be said about friction, and nothing to iterate
        del table["law"], table["solver"]
    return tomli_w.dumps(_ordered(table, _SCENE_KEYS), multiline_strings=True)


def with_overrides(
    scene: Scene,
    *,
    elements: int | None = None,
    accuracy: float | None = None,
    discretisation: str | None = None,
    degree: int | Literal["hp"] | None = None,
    solver: str | None = None,
    rho: float | None = None,
) -> Scene:
    """Change a scene by the words and numbers of the command line; None changes nothing.

    Parameters
    ----------
    scene : Scene
    elements : int, optional
        Of several bodies those of each, also where bodies have options of their own.
    accuracy : float, optional
        Instead of a number of elements.
    discretisation, solver : str, optional
        Words as in scene files.
    degree : int or "hp", optional
        Of Galerkin elements, instead of a discretisation; "hp", as for a discretisation, rises until the accuracy is
        reached.
    rho : float, optional
        Penalty of the solver in units of E'/L; sets all penalties it has.

    Raises
    ------
    SceneError
        If a word is unknown, a number out of range, or the solver has no penalty.
    """
    if elements is not None and accuracy is not None:
        raise SceneError(f"elements is {elements} and accuracy is {accuracy}: give one of them, the other follows")
    if degree is not None and discretisation is not None:
        raise SceneError(f"degree is {degree} and discretisation is {discretisation}: give one of them")
    changes: dict[str, Any] = {}
    try:
        rises = scene.mesh.rising_degrees
        if RISING in (discretisation, degree):
            changes["discretisation"], rises = Galerkin(2), True
        elif discretisation is not None:
            changes["discretisation"], rises = structure(discretisation, cast(Any, Discretisation)), False
        elif degree is not None:
            changes["discretisation"], rises = Galerkin(cast(int, degree)), False
        if elements is not None:
            options = MeshOptions() if scene.mesh.elements is None else scene.mesh
            changes["mesh"] = replace(options, elements=elements)
        elif accuracy is not None:
            changes["mesh"] = MeshOptions(accuracy=accuracy, rising_degrees=rises)
        elif rises != scene.mesh.rising_degrees:
            changes["mesh"] = replace(scene.mesh, rising_degrees=rises)
        if solver is not None:
            changes["solver"] = structure(solver, cast(Any, ContactSolver))
        if rho is not None:
            changes["solver"] = _with_rho(changes.get("solver", scene.solver), rho)
        own: dict[str, Any] = {name: None for name in ("mesh", "discretisation") if name in changes}
        changes["bodies"] = tuple(replace(body, **own) for body in scene.bodies)
        return replace(scene, **changes)
    except ValueError as error:
        raise SceneError(printable(str(error))) from error


def _with_rho(solver: Any, rho: float) -> Any:
    if isinstance(solver, Fallbacks):
        return Fallbacks(tuple(_with_rho(each, rho) if _penalties(each) else each for each in solver.drivers))
    names = _penalties(solver)
    if not names:
        raise SceneError(f"rho is {rho}: the solver {SOLVERS.kind_of(solver)} has no penalty: remove rho")
    return replace(solver, **dict.fromkeys(names, rho))


def _penalties(solver: Any) -> list[str]:
    return [entry.name for entry in fields(solver) if entry.name in ("rho", "rho_n", "rho_t")]


def _ordered(table: dict[str, Any], keys: tuple[str, ...]) -> dict[str, Any]:
    return {key: table[key] for key in keys if table.get(key, "") not in ("", {}, [])}


def _named(tables: list[dict[str, Any]], keys: tuple[str, ...]) -> dict[str, Any]:
    return {table["name"]: _ordered(table, keys) for table in tables}
