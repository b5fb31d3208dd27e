"""Records of an error study, their files, and what follows from several of them: orders and Pareto fronts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from itertools import groupby, pairwise

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.hdf5 import FileFormat
from bemkit.reference.compare import MEASURES
from bemkit.results.outputs import csv_text
from bemkit.results.record_file import RecordFile
from bemkit.scene.registry import RISING

N_FITTED = 3
"""Meshes, from the finest on, to which an order is fitted."""
N_EXPONENTIAL = 4
"""Meshes to which an exponential rate is fitted: three lie on either curve nearly as well."""
EQUALITY_TOLERANCE = 1e-6
"""Relative difference below which errors are equal: drivers agree on a state to their tolerances only."""
STAGES = ("mesh", "assemble", "condense", "solve", "recover")


@dataclass(frozen=True)
class ErrorRecord:
    """One line of the table.

    Parameters
    ----------
    discretisation, map, meshes, solver : str
        Element type, Steklov-Poincare map, sequence of meshes, driver.
    size : float
        Number of elements, or asked-for accuracy of adaptive meshes.
    status : str
        Of the driver in small letters, or ``refused``.
    elements, unknowns, contact_nodes, linear_solves, outer_steps : int
        The unknowns are the displacements of all nodes.
    seconds : float [s]
        Run time of everything; median over the repetitions, nan if it was not measured.
    seconds_mesh, seconds_assemble, seconds_condense, seconds_solve, seconds_recover : float [s]
        Its stages.
    peak_memory : float [bytes]
        Largest memory held by arrays and objects at one time, in a run of its own; nan if it was not measured.
    estimated_error : float
        In the energy norm, relative, as the solution itself tells; nan for collocation.
    energy, sigma_n, sigma_t, displacement, force_normal, force_tangential, transitions : float
        Relative errors, see `bemkit.reference.errors_of`; nan unless the record is certified.
    message : str
        Why there is no result, or why an accuracy was not reached.
    """

    discretisation: str
    map: str
    meshes: str
    solver: str
    size: float
    status: str
    elements: int
    unknowns: int
    contact_nodes: int
    linear_solves: int
    outer_steps: int
    seconds: float
    seconds_mesh: float
    seconds_assemble: float
    seconds_condense: float
    seconds_solve: float
    seconds_recover: float
    peak_memory: float
    estimated_error: float
    energy: float
    sigma_n: float
    sigma_t: float
    displacement: float
    force_normal: float
    force_tangential: float
    transitions: float
    message: str

    @property
    def is_certified(self) -> bool:
        """Whether there is a result, be it as accurate as was asked for or not."""
        return self.status in ("converged", "accuracy_not_reached")

    @property
    def series(self) -> tuple[str, str, str]:
        """Records that differ in nothing but the size of the mesh share this."""
        return self.discretisation, self.meshes, self.solver

    @property
    def key(self) -> tuple[str, str, str, float]:
        """What tells records of one study apart."""
        return *self.series, self.size


def by_series(records: Iterable[ErrorRecord]) -> list[list[ErrorRecord]]:
    """Group records that follow each other and differ in their meshes alone."""
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
    """Return the rate of an error over the last meshes of a series, by least squares; nan if it cannot be told.

    With degrees that rise it is exponential where that fits the last four meshes better.
    """
    last = records[-N_EXPONENTIAL:]
    n, errors = _sizes_and_errors(last, measure)
    # errors of a fixed degree never fall exponentially, whatever four meshes look like
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
    """Return the order of an error over the last meshes of a series, by least squares; nan if it cannot be told."""
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


FORMAT = FileFormat("bemkit-study", 2, "bemkit study errors file", "bemkit study errors -o")
FILE = RecordFile(FORMAT, ErrorRecord, ("scene", "reference", "grading", "budget", "repetitions"))
CSV_START = "discretisation,map,meshes,solver,size,"


def to_csv(records: Sequence[ErrorRecord]) -> str:
    """Return the records as comma-separated values.

    Besides the fields of `ErrorRecord` there are, for each error, ``order_...`` against the mesh before and
    ``pareto_...``, which is 1 if no other record is both faster and more accurate.
    """
    names = [field.name for field in fields(ErrorRecord)]
    fronts = {measure: {record.key for record in pareto_front(records, measure)} for measure in MEASURES}
    lines = []
    for series in by_series(records):
        steps = {measure: orders(series, measure) for measure in MEASURES}
        for k, record in enumerate(series):
            values = [getattr(record, name) for name in names]
            values += [steps[measure][k] for measure in MEASURES]
            lines.append([*values, *(int(record.key in fronts[measure]) for measure in MEASURES)])
    head = [*names, *(f"order_{measure}" for measure in MEASURES), *(f"pareto_{measure}" for measure in MEASURES)]
    return csv_text(head, lines)
