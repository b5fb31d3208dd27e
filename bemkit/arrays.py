"""Names for the array types that every signature uses, and what is done to indices everywhere."""

import itertools
from typing import TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
ComplexArray: TypeAlias = npt.NDArray[np.complex128]
IntArray: TypeAlias = npt.NDArray[np.intp]
BoolArray: TypeAlias = npt.NDArray[np.bool_]


AnyArray = TypeVar("AnyArray", FloatArray, IntArray, BoolArray, npt.NDArray[np.generic])


def read_only(array: AnyArray) -> AnyArray:
    """Return an array that a frozen value holds, after writing to it has been forbidden."""
    array.setflags(write=False)
    return array


Run: TypeAlias = tuple[slice, slice | IntArray]
"""Positions in a list of indices, and the indices there."""


def consecutive_runs(indices: IntArray) -> list[Run]:
    """Cut indices into runs of consecutive numbers: pairs (positions, indices) of slices, which index without copies.

    A list that ascends by equal steps is one run. So is a list in no particular order, whose indices are an array.
    """
    if not indices.size:
        return []
    steps = indices[1:] - indices[:-1]
    if steps.size and steps[0] > 1 and (steps == steps[0]).all():
        return [(slice(0, indices.size), slice(int(indices[0]), int(indices[-1]) + 1, int(steps[0])))]
    breaks = (steps != 1).nonzero()[0] + 1
    if breaks.size > 8:
        return [(slice(0, indices.size), indices)]
    edges = [0, *breaks.tolist(), indices.size]
    return [(slice(i, j), slice(int(indices[i]), int(indices[i]) + j - i)) for i, j in itertools.pairwise(edges)]


def block_of(matrix: FloatArray, rows: IntArray, columns: IntArray) -> FloatArray:
    """Return ``matrix[np.ix_(rows, columns)]``, several times as fast where indices follow each other."""
    block = np.empty((rows.size, columns.size))
    column_runs = consecutive_runs(columns)
    for in_rows, own_rows in consecutive_runs(rows):
        for in_columns, own_columns in column_runs:
            block[in_rows, in_columns] = matrix[own_rows][:, own_columns]
    return block


def spread_fractions(n: int) -> FloatArray:
    """Return n fractions without any pattern, as far from each other as can be: multiples of the golden ratio."""
    fractions: FloatArray = np.modf(np.arange(1, n + 1) * 0.6180339887498949)[0]
    return fractions


def blended(one: FloatArray, two: FloatArray, share: float) -> FloatArray:
    """Return values a share of the way from one to another; equal ones, infinite ones among them, stay."""
    with np.errstate(invalid="ignore"):
        return np.where(one == two, two, one + share * (two - one))
