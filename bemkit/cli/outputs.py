"""Where the command line sends a solution: result file, JSON, CSV and figures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from bemkit.atomic_files import OutputFileError
from bemkit.results.outputs import JSON_START, STDOUT, TextFile, check_figures
from bemkit.results.solution import Solution
from bemkit.results.tables import CSV_STARTS, to_csv, to_json


@dataclass(frozen=True)
class Outputs:
    """What is asked for; each may be left out.

    Parameters
    ----------
    result : Path or None
        HDF5 file.
    json, csv : str or None
        File names, or ``"-"`` for standard output.
    table : str
        Which table the CSV holds, see `bemkit.results.tables.to_csv`.
    plots : Path or None
        Folder for figures.
    """

    result: Path | None = None
    json: str | None = None
    csv: str | None = None
    table: str = "contact"
    plots: Path | None = None

    @property
    def uses_stdout(self) -> bool:
        """Whether standard output is taken by data, so that nothing else may be printed there."""
        return STDOUT in (self.json, self.csv)

    @property
    def _texts(self) -> tuple[TextFile[Solution], TextFile[Solution]]:
        kind, start = f"CSV file of the {self.table} table", CSV_STARTS[self.table]
        return (
            TextFile(self.json, "JSON file", JSON_START, lambda solution: to_json(solution) + "\n"),
            TextFile(self.csv, kind, start, lambda solution: to_csv(solution, self.table)),
        )

    def check(self) -> list[Path]:
        """Find out, before any work is done, whether everything can be written.

        Returns
        -------
        list of Path
            The files, to be reserved.

        Raises
        ------
        OutputFileError
            If a file or folder cannot be written, something of another kind stands in the way, two outputs go to one
            place, or a package for figures is missing.
        """
        if self.result == Path(STDOUT):
            raise OutputFileError("- is standard output, which cannot take a binary result: give a file name")
        targets: list[Path] = []
        if self.result is not None:
            from bemkit.results.result_file import check_result_target

            targets.append(check_result_target(self.result))
        for text in self._texts:
            targets += text.check()
        if len(set(targets)) < len(targets) or self.json == self.csv == STDOUT:
            shown = ", ".join(str(place) for place in (self.result, self.json, self.csv) if place is not None)
            raise OutputFileError(f"two outputs go to the same place ({shown}): give each its own")
        if self.plots is not None:
            check_figures(self.plots, "deformation")
        return targets

    def write(self, solution: Solution) -> None:
        """Write everything that is wanted.

        Raises
        ------
        OutputFileError
            If something cannot be written.
        SceneError
            If the scene cannot be part of a result file.
        """
        if self.result is not None:
            from bemkit.results.result_file import write_result

            write_result(self.result, solution)
        for text in self._texts:
            text.write(solution)
        if self.plots is not None:
            from bemkit.results.figures import save_figures

            save_figures(solution, self.plots)
