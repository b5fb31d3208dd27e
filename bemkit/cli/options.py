"""Options of several commands: changes of the scene, degrees, pictures, outputs, progress."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from functools import partial, wraps
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import click

from bemkit.cli.outputs import STDOUT, Content, Outputs, TableFile, TextFile, csv_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bemkit.results.solution import Solution
    from bemkit.scene.scene import Scene
    from bemkit.solvers.base import StepRecord
    from bemkit.studies.engine import Task
    from bemkit.studies.row_file import R
    from bemkit.table import Table


def degree_of(context: click.Context, parameter: click.Parameter, value: str | None) -> int | Literal["hp"] | None:
    """Return a polynomial degree, or the word for degrees that rise until an accuracy is reached."""
    if value is None:
        return None
    if value == "hp":
        return "hp"
    if not value.lstrip("+-").isdecimal():
        raise click.BadParameter(f"{value} is not a whole number: give one from 1 to 12, or hp", context, parameter)
    return int(value)


def pictures_of(context: click.Context, parameter: click.Parameter, value: str | None) -> tuple[str, ...] | None:
    """Return the names of pictures in an option, all of them known; None if it is not given."""
    if value is None:
        return None
    from bemkit.pictures.catalogue import find_picture
    from bemkit.pictures.files import ANIMATION

    names = tuple(name.strip() for name in value.split(",") if name.strip())
    return tuple(name if name == ANIMATION else find_picture(name).name for name in names)


def names_of(context: click.Context, parameter: click.Parameter, values: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names in an option that may be repeated and may hold several names with commas."""
    return tuple(name.strip() for value in values for name in value.split(",") if name.strip())


def file_of(ending: str) -> Callable[[click.Context, click.Parameter, str | None], str | None]:
    """Return a check that a file in an option does not have the ending of another kind of file, such as a scene."""

    def checked(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
        if value is None:
            return None
        from bemkit.atomic_files import FILE_ENDINGS

        if Path(value).suffix.lower() in FILE_ENDINGS - {ending}:
            words = f"{value} has the ending of another kind of file: give a name that ends in {ending}"
            raise click.BadParameter(words, context, parameter)
        return value

    return checked


_CHANGES = MappingProxyType(
    {
        "settings": click.option(
            "--set",
            "settings",
            multiple=True,
            metavar="KEY=VALUE",
            help="Change the scene at a key of its file; repeatable.",
        ),
        "elements": click.option("--elements", type=int, metavar="N", help="Number of boundary elements."),
        "accuracy": click.option(
            "--accuracy", type=float, metavar="E", help="Refine until the estimated relative error is below E."
        ),
        "discretisation": click.option(
            "--discretisation", metavar="NAME", help="Elements: hp, quadratic, linear or constant."
        ),
        "degree": click.option(
            "--degree", metavar="P|hp", callback=degree_of, help="Galerkin elements of degree P, or hp refinement."
        ),
        "solver": click.option("--solver", metavar="NAME", help="Such as augmented-lagrangian."),
        "rho": click.option("--rho", type=float, metavar="R", help="Penalty of the solver [E'/L]."),
    }
)
"""Options that change a scene, by the names of `with_overrides`, and settings."""


def changes_scene(*names: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a command options that change its scene, by their names in `_CHANGES`.

    In place of their values the command has an argument ``load``: the name of a scene or its file -> the changed scene.
    """

    def decorated(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def changed(**given: Any) -> Any:
            changes = {name: given.pop(name) for name in names}
            return command(load=partial(_loaded, changes), **given)

        for name in reversed(names):
            changed = _CHANGES[name](changed)
        return changed

    return decorated


def _loaded(changes: Mapping[str, Any], scene: str) -> Scene:
    from bemkit.scene.toml import load_scene, with_overrides

    chosen, overrides = load_scene(scene), dict(changes)
    if settings := overrides.pop("settings", ()):
        from bemkit.scene.keys import with_settings

        chosen = with_settings(chosen, settings)
    return with_overrides(chosen, **overrides)


rows_option = click.option(
    "-o", "--output", metavar="FILE", help="Write the rows: .csv, .json, .md, .h5, or .jsonl, which resumes."
)
json_option = click.option(
    "--json",
    "json_file",
    metavar="FILE",
    callback=file_of(".json"),
    help="Write numbers as JSON; - is standard output.",
)
csv_option = click.option(
    "--csv", "csv_file", metavar="FILE", callback=file_of(".csv"), help="Write the table as CSV; - is standard output."
)
markdown_option = click.option(
    "--markdown", metavar="FILE", callback=file_of(".md"), help="Write the table as Markdown; - is standard output."
)
plot_option = click.option("--plot", "folder", metavar="DIR", help="Draw figures into the folder DIR.")
what_option = click.option(
    "--what", metavar="NAME,...", callback=pictures_of, help="Pictures to draw; bemkit plot --help lists them."
)
inside_option = click.option(
    "--inside", type=int, default=0, metavar="N", help="Stress inside on N points across, in a .vtu."
)
quiet_option = click.option("-q", "--quiet", is_flag=True, help="Print only errors.")


def outputs_of(
    json_file: str | None,
    csv_file: str | None,
    folder: str | None,
    table: str = "contact",
    what: tuple[str, ...] | None = None,
) -> Outputs[Solution]:
    """Return the outputs of a solution that the command line asks for, besides a result file."""
    if what is not None and folder is None:
        raise click.UsageError("--what names figures: add --plot DIR")
    if json_file is csv_file is folder is None:
        return Outputs()
    from bemkit.results.tables import table_of, to_json

    def pictures(solution: Solution) -> Mapping[str, Figure]:
        from bemkit.pictures.catalogue import figures

        return figures(solution, what if what is None else [name for name in what if name != "animation"])

    texts = TextFile(json_file, to_json), csv_of(csv_file, partial(table_of, table=table))
    return Outputs(texts, folder, pictures, "deformation")


def names_of_scenes(scenes: Sequence[str], *, writes: bool) -> list[str]:
    """Return the names for the outputs of each scene; empty for a single scene.

    Parameters
    ----------
    scenes : sequence of str
        Files or names of scenes.
    writes : bool
        Whether there are outputs, which would overwrite each other if two scenes had one name.
    """
    names = [Path(scene).stem if Path(scene).suffix.lower() == ".toml" else scene for scene in scenes]
    for name in names if writes else ():
        if names.count(name) > 1:
            raise click.UsageError(f"two scenes are called {name!r}, and so would be their outputs: rename one")
    return names if len(scenes) > 1 else [""]


def place_of(place: str | None, name: str) -> str | None:
    """Return the file of an output, with the name of its scene before the ending where there are several."""
    if place is None or not name:
        return place
    if place == STDOUT:
        raise click.UsageError("- is standard output, which takes one scene: give a file, or run one scene")
    path = Path(place)
    return str(path.with_name(f"{path.stem}-{name}{path.suffix}"))


def result_target(output: str | None, inside: int) -> list[Path]:
    """Return the file of ``-o``, checked for its ending; ``--inside`` goes with it."""
    if output is None:
        if inside:
            raise click.UsageError("--inside goes into a file: give -o with a name that ends in .vtu")
        return []
    from bemkit.results.export import format_of

    return [format_of(output, inside).check(Path(output))]


def write_animation(solution: Solution, folder: str | None, what: tuple[str, ...] | None) -> None:
    """Write the load steps of a solution as a moving picture into the folder of its figures, if it is named."""
    if folder is None or "animation" not in (what or ()):
        return
    from bemkit.pictures.animation import save_animation

    save_animation(Path(folder) / "animation.gif", solution.each_step())


def study_output(target: str | None, table: Callable[[Content], Table]) -> tuple[str | None, TableFile[Content]]:
    """Return the file of ``-o`` for finished rows, .jsonl, and that for the whole table."""
    keeps_rows = target is not None and target.lower().endswith(".jsonl")
    return (target, TableFile(None, table)) if keeps_rows else (None, TableFile(target, table))


def reserve(paths: Iterable[Path]) -> None:
    """Keep files, if any, for this process until the command ends; see `bemkit.atomic_files.reserved`."""
    if files := list(paths):
        from bemkit.atomic_files import reserved

        click.get_current_context().with_resource(reserved(files))


def is_watched(quiet: bool) -> bool:
    """Whether a person looks at standard error and wants to see progress there."""
    return not quiet and sys.stderr.isatty()


def shown_progress(quiet: bool) -> AbstractContextManager[Callable[[StepRecord], None] | None]:
    """Return the progress display of a command; nothing without a terminal."""
    if not is_watched(quiet):
        return nullcontext()
    from bemkit.cli.progress import live_progress

    return live_progress()


class StudyProgress(ExitStack):
    """Shows the preparation of a study in a ``with`` statement, and then its tasks."""

    def __init__(self, quiet: bool) -> None:
        super().__init__()
        self._is_live = is_watched(quiet)
        self.enter_context(shown_progress(quiet))

    def compute(
        self, tasks: Sequence[Task[R]], name: str, *, processes: int = 1, cluster: str | None = None
    ) -> Iterator[R]:
        """Return records as they are ready; see `bemkit.cli.progress.compute_with_progress`."""
        from bemkit.cli.progress import compute_with_progress

        self.close()  # its bar takes the place of the first
        return compute_with_progress(tasks, name, is_live=self._is_live, processes=processes, cluster=cluster)
