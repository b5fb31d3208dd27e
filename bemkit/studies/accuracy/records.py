"""Records of an error study, their files, and what follows from several of them: orders and Pareto fronts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from itertools import groupby, pairwise

import numpy as np

from bemkit.hdf5 import FileFormat
from bemkit.reference.compare import MEASURES
from bemkit.results.outputs import csv_text
from bemkit.results.record_file import RecordFile

N_FITTED = 3
"""Meshes, from the finest on, to which an order is fitted."""
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
    elements, contact_nodes, linear_solves, outer_steps : int
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


def orders(records: Sequence[ErrorRecord], measure: str) -> list[float]:
    """Return the orders p, error ~ N**-p, between each mesh of a series and the one before; nan where there is none."""
    return [float("nan"), *(_slope((before, after), measure) for before, after in pairwise(records))][: len(records)]


def fitted_order(records: Sequence[ErrorRecord], measure: str) -> float:
    """Return the order of an error over the last meshes of a series, by least squares; nan if it cannot be told."""
    return _slope(records[-N_FITTED:], measure)


def _slope(records: Sequence[ErrorRecord], measure: str) -> float:
    sizes = np.array([float(record.elements) for record in records])
    errors = np.array([getattr(record, measure) for record in records], dtype=float)
    is_good = np.isfinite(errors) & (errors > 0.0) & (sizes > 0.0)
    if not is_good.all() or np.unique(sizes).size < 2:
        return float("nan")
    return float(-np.polyfit(np.log(sizes), np.log(errors), 1)[0])


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


FORMAT = FileFormat("bemkit-study", 1, "bemkit study errors file", "bemkit study errors -o")
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
