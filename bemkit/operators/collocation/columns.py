"""Columns of a boundary matrix that a caller wants, and where they are written."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray

_MANY_DIRECTIONS = 8
"""A run of elements whose directions change more often than this (curved parts) is not cut into pieces."""


@dataclass(frozen=True, eq=False)
class ColumnRun:
    """The columns of one direction of the densities on consecutive elements.

    Parameters
    ----------
    elements : slice
        Of the source elements.
    direction : complex or (n_columns,) complex array
        Unit direction of the densities, x + i y.
    along_x, along_y : (n_rows, n_columns) arrays
        The components x and y of the equations; views of the matrix into which the columns are written.
    """

    elements: slice
    direction: complex | ComplexArray
    along_x: FloatArray
    along_y: FloatArray

    def write(self, rows: slice, on: FloatArray | ComplexArray, on_conjugate: ComplexArray) -> None:
        """Write v -> on v + on_conjugate conj(v) for the columns of this run, in a range of rows."""
        x, y = self.along_x[rows], self.along_y[rows]
        a, b = (on.real, on.imag) if np.iscomplexobj(on) else (on, None)
        if isinstance(self.direction, np.ndarray) or self.direction not in (1.0, -1.0, 1j, -1j):
            value = on * self.direction + on_conjugate * np.conj(self.direction)
            x[...], y[...] = value.real, value.imag
            return
        if self.direction in (1.0, -1.0):
            np.add(a, on_conjugate.real, out=x)
            np.add(0.0 if b is None else b, on_conjugate.imag, out=y)
        else:
            np.subtract(on_conjugate.imag, 0.0 if b is None else b, out=x)
            np.subtract(a, on_conjugate.real, out=y)
        if self.direction in (-1.0, -1j):
            np.negative(x, out=x)
            np.negative(y, out=y)

    def add(self, rows: IntArray, elements: IntArray, on: ComplexArray, on_conjugate: ComplexArray | float) -> None:
        """Add v -> on v + on_conjugate conj(v) to single entries; elements of other runs are passed over."""
        own = np.flatnonzero((elements >= self.elements.start) & (elements < self.elements.stop))
        columns = elements[own] - self.elements.start
        direction = self.direction[columns] if isinstance(self.direction, np.ndarray) else self.direction
        conjugate = on_conjugate[own] if isinstance(on_conjugate, np.ndarray) else on_conjugate
        value = on[own] * direction + conjugate * np.conj(direction)
        np.add.at(self.along_x, (rows[own], columns), value.real)
        np.add.at(self.along_y, (rows[own], columns), value.imag)


def column_runs(matrix: FloatArray, dofs: IntArray, frame: FloatArray) -> list[ColumnRun]:
    """Cut the columns of a matrix into runs.

    Parameters
    ----------
    matrix : (2 n_rows, n_columns) array
        The first half of its rows are the equations along x.
    dofs : (n_columns,) array
        2 * element + component of each column.
    frame : (n_elements, 2, 2) array
        Rows are the directions of the two components.

    Returns
    -------
    list of ColumnRun
    """
    n_rows = len(matrix) // 2
    direction: ComplexArray = frame[dofs // 2, dofs % 2] @ np.array([1.0, 1j])
    return [
        ColumnRun(
            slice(int(dofs[own.start]) // 2, int(dofs[own.stop - 1]) // 2 + 1),
            along,
            matrix[:n_rows, own],
            matrix[n_rows:, own],
        )
        for own, along in _consecutive(dofs, direction)
    ]


def _consecutive(dofs: IntArray, direction: ComplexArray) -> Iterator[tuple[slice, complex | ComplexArray]]:
    """Yield ranges of columns on consecutive elements, with their direction if they share it."""
    for run in _cut(slice(0, dofs.size), np.diff(dofs) != 2):
        changes = np.diff(direction[run]) != 0.0
        if np.count_nonzero(changes) > _MANY_DIRECTIONS:
            yield run, direction[run]
        else:
            yield from ((piece, complex(direction[piece.start])) for piece in _cut(run, changes))


def _cut(run: slice, is_break: BoolArray) -> Iterator[slice]:
    """Cut a range after each place marked as a break."""
    if run.start == run.stop:
        return
    edges = [run.start, *(run.start + 1 + np.flatnonzero(is_break)).tolist(), run.stop]
    yield from (slice(first, last) for first, last in itertools.pairwise(edges))


def covered(runs: Sequence[ColumnRun], n_elements: int) -> BoolArray:
    """Return which elements have a column in one of the runs."""
    is_covered = np.zeros(n_elements, bool)
    for run in runs:
        is_covered[run.elements] = True
    return is_covered


def segments(*labels: BoolArray) -> list[slice]:
    """Cut all elements into the longest ranges on which no label changes."""
    changes = np.any([np.diff(label.astype(int)) != 0 for label in labels], axis=0)
    return list(_cut(slice(0, labels[0].size), changes))
