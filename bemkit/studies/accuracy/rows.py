"""Rows of an error study, and what follows from several of them: orders and Pareto fronts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np

N_FITTED = 3
"""Meshes, from the finest on, to which an order is fitted."""
SAME = 1e-6
"""Relative difference below which errors are equal: drivers agree on a state to their tolerances only."""
STAGES = ("mesh", "assemble", "condense", "solve", "recover")


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Parameters
    ----------
    discretisation, map, meshes, solver : str
        Element type, Steklov-Poincare map, sequence of meshes, driver.
    size : float
        Number of elements, or wished accuracy of adaptive meshes.
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
        Relative errors, see `bemkit.reference.errors_of`; nan unless the row is certified.
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
        """Whether there is a result, be it as accurate as was wished or not."""
        return self.status in ("converged", "accuracy_not_reached")

    @property
    def series(self) -> tuple[str, str, str]:
        """Rows that differ in nothing but the size of the mesh share this."""
        return self.discretisation, self.meshes, self.solver

    @property
    def key(self) -> tuple[str, str, str, float]:
        """What tells rows of one study apart."""
        return *self.series, self.size


def by_series(rows: Iterable[Row]) -> list[list[Row]]:
    """Group rows that follow each other and differ in their meshes alone."""
    return [list(group) for _, group in groupby(rows, key=lambda row: row.series)]


def orders(rows: Sequence[Row], measure: str) -> list[float]:
    """Return the order of an error between each mesh and the one before it; nan where there is none.

    Parameters
    ----------
    rows : sequence of Row
        Of one series.
    measure : str

    Returns
    -------
    list of float
        p in error ~ N**-p.
    """
    return [float("nan"), *(_slope((before, after), measure) for before, after in pairwise(rows))][: len(rows)]


def fitted_order(rows: Sequence[Row], measure: str) -> float:
    """Return the order of an error over the last meshes of a series, by least squares; nan if it cannot be told."""
    return _slope(rows[-N_FITTED:], measure)


def _slope(rows: Sequence[Row], measure: str) -> float:
    sizes = np.array([float(row.elements) for row in rows])
    errors = np.array([getattr(row, measure) for row in rows], dtype=float)
    is_good = np.isfinite(errors) & (errors > 0.0) & (sizes > 0.0)
    if not is_good.all() or np.unique(sizes).size < 2:
        return float("nan")
    return float(-np.polyfit(np.log(sizes), np.log(errors), 1)[0])


def pareto_front(rows: Sequence[Row], measure: str) -> list[Row]:
    """Return the rows that no other row beats or equals in both run time and error, from fast to accurate.

    Parameters
    ----------
    rows : sequence of Row
    measure : str

    Returns
    -------
    list of Row
        Empty if no run time was measured.
    """
    known = [row for row in rows if np.isfinite(row.seconds) and np.isfinite(getattr(row, measure))]
    front: list[Row] = []
    for row in sorted(known, key=lambda row: (row.seconds, getattr(row, measure))):
        if not front or getattr(row, measure) < (1.0 - SAME) * getattr(front[-1], measure):
            front.append(row)
    return front
