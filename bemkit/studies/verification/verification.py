"""Solve problems with known answers at several resolutions and compare."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path

import numpy as np

from bemkit.errors import InputError
from bemkit.formulas import closest
from bemkit.results.solution import Solution
from bemkit.studies.engine import Attempt, Task, attempt, compute
from bemkit.studies.verification.case import Case, Quantity
from bemkit.studies.verification.cases import CASES
from bemkit.studies.verification.records import FILE, Verification, VerificationRecord, rows_of
from bemkit.version import __version__

LABELS = {"version": __version__}


@dataclass(frozen=True)
class Comparison:
    """All quantities of a case at one resolution: what one task computes."""

    key: tuple[str, float]
    records: tuple[VerificationRecord, ...]


Run = Callable[[Sequence[Task[Comparison]]], Iterable[Comparison]]


def verify(
    names: Sequence[str] = (),
    *,
    quick: bool = False,
    run: Run = compute,
    file: str | Path | None = None,
    cases: Mapping[str, Callable[[], Case]] = CASES,
) -> Verification:
    """Compare results with closed forms and other known solutions.

    Parameters
    ----------
    names : sequence of str
        Of cases, with ``*`` for any letters; all by default.
    quick : bool
        Skip the finest resolutions.
    run : callable (tasks) -> records
        `bemkit.studies.engine.compute`, or with a progress bar `compute_with_progress`.
    file : str or Path, optional
        File (JSON Lines, .jsonl) that gets each record as soon as it exists; its records are not computed again.
    cases : mapping of str to callable
        The known cases, by default all of bemkit; each is made when it is needed.

    Raises
    ------
    InputError
        If a name fits no case.
    OutputFileError, RowFileError
        If the file cannot be written or read, or is of another version of bemkit.
    """
    chosen = {name: cases[name]() for name in selected(names, tuple(cases))}
    keys: dict[Task[Comparison], set[Hashable]] = {}
    for name, case in chosen.items():
        for resolution in case.resolutions[: case.n_quick if quick else None]:
            task = Task((name, resolution), f"{name}, {resolution:g}", partial(compare, name, case, resolution))
            keys[task] = {(name, quantity.name, resolution) for quantity in case.quantities}

    def computed(finished: Mapping[Hashable, VerificationRecord]) -> Iterator[VerificationRecord]:
        comparisons = run([task for task in keys if not keys[task] <= finished.keys()])
        return (record for comparison in comparisons for record in comparison.records if record.key not in finished)

    wanted = set[Hashable]().union(*keys.values())
    records = FILE.completed(file, LABELS, computed)
    return Verification(rows_of(chosen, {key: record for key, record in records.items() if key in wanted}))


def selected(names: Sequence[str], known: tuple[str, ...]) -> tuple[str, ...]:
    """Return the known names that fit one of the names given, all if none is; InputError for a name that fits none."""
    for name in names:
        if not any(fnmatchcase(each, name) for each in known):
            raise InputError(f"{name!r} is not a case: the cases are {', '.join(known)}{closest(name, known)}")
    return tuple(each for each in known if not names or any(fnmatchcase(each, name) for name in names))


def compare(name: str, case: Case, resolution: float) -> Comparison:
    """Solve a case at one resolution and compare all its quantities."""
    found: Attempt = attempt(lambda: case.solve(case.scene, resolution))
    solution = found.solution
    records = []
    for quantity in case.quantities:
        value, message = np.nan, found.message
        if solution is not None and solution.is_certified:
            value, message = _measured(quantity, solution)
        error = quantity.error(value)
        records.append(
            VerificationRecord(
                case=name,
                quantity=quantity.name,
                resolution=resolution,
                n_elements=0 if solution is None else solution.n_elements,
                value=value,
                error=error if np.isfinite(error) else np.inf,
                seconds=found.seconds,
                message=message,
            )
        )
    return Comparison((name, resolution), tuple(records))


def _measured(quantity: Quantity, solution: Solution) -> tuple[float, str]:
    """Return the measured value, or nan and a message: a wrong solution may lack the zones that are compared."""
    try:
        return float(quantity.measure(solution)), ""
    except (LookupError, ArithmeticError, ValueError) as error:
        return np.nan, f"the solution lacks what is compared ({type(error).__name__}: {error})"
