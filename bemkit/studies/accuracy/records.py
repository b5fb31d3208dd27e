"""Records of an error study, their files, and what follows from several of them: orders and Pareto fronts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.reference.compare import MEASURES
from bemkit.scene.registry import RISING
from bemkit.studies.row_file import RowFile
from bemkit.table import Column, Table, column

N_FITTED = 3
"""Number of meshes, the finest ones, to which an order is fitted."""
N_EXPONENTIAL = 4
"""Number of meshes to which an exponential rate is fitted: three fit both curves nearly equally well."""
EQUALITY_TOLERANCE = 1e-6
"""Relative difference below which errors are equal: solvers agree on a state to their tolerances only."""
STAGES = ("mesh", "assemble", "condense", "solve", "recover")


@dataclass(frozen=True)
class ErrorRecord:
    """One row of an error study: errors are relative, see `bemkit.reference.errors_of`, nan unless certified."""

    discretisation: str = column("element type")
    map: str = column("Steklov-Poincare operator")
    meshes: str = column("sequence of meshes")
    solver: str = column("nonlinear solver")
    size: float = column("number of elements, or requested accuracy of adaptive meshes", format="g")
    status: str = column("of the solver in small letters, or refused")
    elements: int = column("number of elements")
    unknowns: int = column("displacements of all nodes")
    contact_nodes: int = column("number of contact nodes")
    linear_solves: int = column("number of linear solves")
    outer_steps: int = column("steps of the nonlinear solver")
    seconds: float = column("run time, median over the repetitions; nan if not measured", "s", ".3f")
    seconds_mesh: float = column("of the mesh", "s", ".3f")
    seconds_assemble: float = column("of assembly", "s", ".3f")
    seconds_condense: float = column("of condensation", "s", ".3f")
    seconds_solve: float = column("of the contact problem", "s", ".3f")
    seconds_recover: float = column("of the fields", "s", ".3f")
    peak_memory: float = column("largest memory of arrays and objects, in a run of its own", "byte", ".3g")
    estimated_error: float = column("in the energy norm, as the solution estimates it; nan for collocation", "", ".1e")
    energy: float = column("error of the elastic energy", "", ".1e")
    sigma_n: float = column("error of normal contact tractions", "", ".1e")
    sigma_t: float = column("error of tangential contact tractions", "", ".1e")
    displacement: float = column("error of displacements", "", ".1e")
    force_normal: float = column("error of the normal contact force", "", ".1e")
    force_tangential: float = column("error of the tangential contact force", "", ".1e")
    transitions: float = column("error of the points where the status changes", "", ".1e")
    message: str = column("why there is no result, or why an accuracy was not reached")

    @property
    def is_certified(self) -> bool:
        """Whether there is a certified result, even if it misses the accuracy."""
        return self.status in ("converged", "accuracy_not_reached")

    @property
    def series(self) -> tuple[str, str, str]:
        """Key of the records that differ only in the size of the mesh."""
        return self.discretisation, self.meshes, self.solver

    @property
    def key(self) -> tuple[str, str, str, float]:
        """Key of a record in its study."""
        return *self.series, self.size


def by_series(records: Iterable[ErrorRecord]) -> list[list[ErrorRecord]]:
    """Group records that follow each other and differ only in their meshes."""
    return [list(group) for _, group in groupby(records, key=lambda record: record.series)]


@dataclass(frozen=True)
class Rate:
    """How fast an error falls with the number n of unknowns: like n**-value, or like exp(-value sqrt(n))."""

    value: float
    is_exponential: bool = False

    def __str__(self) -> str:
        if not np.isfinite(self.value):
            return "-"
        return f"exp(-{self.value:.2g}√n)" if self.is_exponential else f"{self.value:.1f}"


def fitted_rate(records: Sequence[ErrorRecord], measure: str) -> Rate:
    """Return the rate of an error over the last meshes of a series, by least squares; nan without an estimate.

    For rising degrees it is exponential if that fits the last four meshes better.
    """
    last = records[-N_EXPONENTIAL:]
    n, errors = _sizes_and_errors(last, measure)
    # errors of a fixed degree never fall exponentially, even if four meshes look like it
    is_rising = all(record.discretisation == RISING for record in last)
    if is_rising and len(last) == N_EXPONENTIAL and _is_good(n, errors) and np.all(np.diff(errors) < 0.0):
        algebraic, exponential = (np.polyfit(x, np.log(errors), 1, full=True)[:2] for x in (np.log(n), np.sqrt(n)))
        if np.sum(exponential[1]) < np.sum(algebraic[1]):
            return Rate(float(-exponential[0][0]), is_exponential=True)
    return Rate(fitted_order(records, measure))


def orders(records: Sequence[ErrorRecord], measure: str) -> list[float]:
    """Return the orders p, error ~ n**-p, between each mesh of a series and the one before; nan where there is none."""
    return [float("nan"), *(_slope((before, after), measure) for before, after in pairwise(records))][: len(records)]


def fitted_order(records: Sequence[ErrorRecord], measure: str) -> float:
    """Return the order of an error over the last meshes of a series, by least squares; nan without an estimate."""
    return _slope(records[-N_FITTED:], measure)


def _slope(records: Sequence[ErrorRecord], measure: str) -> float:
    n, errors = _sizes_and_errors(records, measure)
    return float(-np.polyfit(np.log(n), np.log(errors), 1)[0]) if _is_good(n, errors) else float("nan")


def _sizes_and_errors(records: Sequence[ErrorRecord], measure: str) -> tuple[FloatArray, FloatArray]:
    sizes = np.array([float(record.unknowns) for record in records])
    return sizes, np.array([getattr(record, measure) for record in records], dtype=float)


def _is_good(sizes: FloatArray, errors: FloatArray) -> bool:
    return bool(np.all(np.isfinite(errors) & (errors > 0.0) & (sizes > 0.0))) and np.unique(sizes).size >= 2


def pareto_front(records: Sequence[ErrorRecord], measure: str) -> list[ErrorRecord]:
    """Return the records that no other record beats or equals in both run time and error, from fast to accurate.

    There are none if no run time was measured.
    """
    known = [record for record in records if np.isfinite(record.seconds) and np.isfinite(getattr(record, measure))]
    front: list[ErrorRecord] = []
    for record in sorted(known, key=lambda record: (record.seconds, getattr(record, measure))):
        if not front or getattr(record, measure) < (1.0 - EQUALITY_TOLERANCE) * getattr(front[-1], measure):
            front.append(record)
    return front


FILE = RowFile("bemkit-study 3", ErrorRecord, ("scene", "reference", "grading", "budget", "repetitions"))


def table_of(records: Sequence[ErrorRecord]) -> Table:
    """Return the records as a table.

    Besides the fields of `ErrorRecord` there are, for each error, ``order_...`` against the mesh before and
    ``pareto_...``, which is 1 if no other record is both faster and more accurate.
    """
    fronts = {measure: {record.key for record in pareto_front(records, measure)} for measure in MEASURES}
    added = []
    for series in by_series(records):
        steps = [orders(series, measure) for measure in MEASURES]
        for record, *order in zip(series, *steps, strict=True):
            added.append((*order, *(int(record.key in fronts[measure]) for measure in MEASURES)))
    table = Table.from_records(ErrorRecord, records)
    heads = [Column(f"order_{measure}", "", "order against the mesh before", ".1f") for measure in MEASURES]
    heads += [Column(f"pareto_{measure}", "", "1 if no other run is faster and more accurate") for measure in MEASURES]
    rows = tuple((*row, *more) for row, more in zip(table.rows, added, strict=True))
    return Table((*table.columns, *heads), rows)
