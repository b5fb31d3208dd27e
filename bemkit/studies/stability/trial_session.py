"""One call of ``bemkit stability --random``: solve random scenes, show the counts, keep the scenes that fail."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from bemkit.atomic_files import OutputFileError
from bemkit.cli.outputs import write_text
from bemkit.studies.stability.random_scenes import random_case
from bemkit.studies.stability.trials import Outcome, Trial, try_cases

_STYLES = {Outcome.WRONG: "bold red", Outcome.TRACEBACK: "bold red", Outcome.WARNED: "yellow", Outcome.NAMED: "cyan"}
_PLURALS = {
    Outcome.SUCCESS: "successes",
    Outcome.WARNED: "warned",
    Outcome.NAMED: "named failures",
    Outcome.WRONG: "wrong successes",
    Outcome.TRACEBACK: "tracebacks",
}


@dataclass(frozen=True)
class TrialSession:
    """What is asked of random scenes.

    Parameters
    ----------
    count, seed, first : int
        How many scenes, of which seed, from which one on.
    processes : int
    folder : str or None
        Where scenes that fail are kept as TOML; made if need be.
    is_live : bool
        Show on standard error how far it is.
    """

    count: int
    seed: int
    first: int
    processes: int
    folder: str | None
    is_live: bool

    def run(self) -> list[Trial]:
        """Solve and judge the scenes; failures are on the disk as soon as they are known.

        Raises
        ------
        OutputFileError
            If the folder cannot be made or written.
        """
        if self.folder is not None:
            _make_folder(Path(self.folder))
        indices = range(self.first, self.first + self.count)
        trials = []
        with self._progress() as progress:
            task = progress.add_task("random scenes", total=self.count)
            for trial in try_cases(self.seed, indices, processes=min(self.processes, self.count)):
                trials.append(trial)
                if self.folder is not None and trial.is_failure:
                    save_trial(trial, Path(self.folder))
                progress.advance(task)
        return trials

    @contextmanager
    def _progress(self) -> Iterator[Progress]:
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
        with Progress(*columns, console=Console(stderr=True), transient=True, disable=not self.is_live) as progress:
            yield progress


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputFileError(f"{folder}: cannot be made ({error.strerror}): give the name of a folder") from error


def save_trial(trial: Trial, folder: Path) -> None:
    """Write the scenes of a trial as TOML into a folder, headed by what was found."""
    lines = [f"{trial.outcome.value}: {trial.reason}", *trial.message.splitlines()]
    head = "".join(f"# {line}\n" for line in lines)
    for name, text in random_case(trial.seed, trial.index).files().items():
        write_text(str(folder / name), head + text)


def print_trials(trials: Sequence[Trial], console: Console | None = None) -> None:
    """Print how many scenes came to which end and why, and what to call for each that failed."""
    console = Console(highlight=False) if console is None else console
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("outcome", no_wrap=True)
    table.add_column("scenes", justify="right", no_wrap=True)
    table.add_column("why", overflow="fold")
    for outcome in Outcome:
        own = [trial for trial in trials if trial.outcome is outcome]
        reasons = Counter(trial.reason for trial in own if trial.reason)
        why = ", ".join(f"{reason.replace('_', ' ')} {count}" for reason, count in reasons.most_common())
        shows_why = outcome is not Outcome.WARNED
        table.add_row(Text(_PLURALS[outcome], _STYLES.get(outcome, "")), str(len(own)), why if shows_why else "")
    console.print(Text(f"{len(trials)} random scenes", style="bold"))
    console.print(table)
    for trial in [trial for trial in trials if trial.is_failure]:
        console.print(Text(f"{trial.outcome.value}: {trial.reason}: {trial.message.strip().splitlines()[-1]}"))
        console.print(Text(f"  bemkit stability --random 1 --seed {trial.seed} --first {trial.index} --save ."))
