"""Where ``bemkit run`` and ``bemkit show`` send a result; what writes it is loaded where it is wanted."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bemkit.results.outputs import JSON_START, Outputs, TextFile

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bemkit.results.assembly_solution import AssemblySolution
    from bemkit.results.solution import Solution


def result_outputs(
    json_file: str | None,
    csv_file: str | None,
    folder: str | None,
    table: str = "contact",
    what: tuple[str, ...] | None = None,
) -> Outputs[Solution | AssemblySolution]:
    """Return where the command line sends a solution, besides a result file."""
    if what is not None and folder is None:
        raise click.UsageError("--what names figures: add --plot DIR")
    if json_file is csv_file is folder is None:
        return Outputs()
    from bemkit.results.tables import CSV_STARTS, to_csv, to_json

    def as_json(solution: Solution | AssemblySolution) -> str:
        return to_json(solution) + "\n"

    def as_csv(solution: Solution | AssemblySolution) -> str:
        return to_csv(solution, table)

    def pictures(solution: Solution | AssemblySolution) -> Mapping[str, Figure]:
        from bemkit.pictures.catalogue import figures

        return figures(solution, what)

    texts = (
        TextFile(json_file, "JSON file", JSON_START, as_json),
        TextFile(csv_file, f"CSV file of the {table} table", CSV_STARTS[table], as_csv),
    )
    return Outputs(texts, folder, pictures, "deformation")


def result_target(output: str | None, inside: int) -> list[Path]:
    """Find out whether a result can be written in the format of its ending; return the file, if it is wanted."""
    if output is None:
        if inside:
            raise click.UsageError("--inside goes into a file: give -o with a name that ends in .vtu")
        return []
    from bemkit.results.export import format_of

    return [format_of(output, inside).check(Path(output))]
