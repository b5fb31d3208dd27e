"""Compile all kernels at once, instead of within the first run that needs them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bemkit.errors import InputError
from bemkit.geometry import BoundaryMesh, Disk, Rectangle, discretise
from bemkit.operators.hierarchy import compiled
from bemkit.operators.hierarchy.compression import Compression
from bemkit.operators.hierarchy.element_pairs import ElementPairs
from bemkit.operators.hierarchy.fast_multipole import FastMultipole
from bemkit.operators.hierarchy.folded_columns import boundary_columns
from bemkit.operators.hierarchy.straight_elements import StraightElements
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.material import Material

_ELEMENTS, _LEAF = 64, 16


@dataclass(frozen=True)
class Compiled:
    """Kernels that are ready: what they are for, and whether numba had kept them from before."""

    what: str
    was_kept: bool


def warm_up() -> Iterator[Compiled]:
    """Compile the kernels, or load what numba has kept, and use each of them once.

    Yields
    ------
    Compiled
        As soon as they are ready.

    Raises
    ------
    InputError
        If numba is not installed or does not work; the message says which.
    """
    if not compiled.is_installed():
        raise InputError(f"nothing to compile: numba is {compiled.why()}")
    from bemkit.operators.hierarchy import compiled_curved, compiled_fields, compiled_pairs

    square, disk = (discretise(of.outline(), n_elements=_ELEMENTS).unit for of in (Rectangle(1.0, 1.0), Disk(1.0)))
    for what, mesh, module in (
        ("straight elements", square, compiled_fields),
        ("curved elements", disk, compiled_curved),
        ("Galerkin's method", square, compiled_pairs),
    ):
        was_kept = compiled.is_cached(module.__name__)
        if compiled.functions() is None:
            raise InputError(f"nothing to compile: {compiled.why()}")
        if module is compiled_pairs:
            ElementPairs.of(mesh, 1).integrals(*2 * (np.arange(mesh.n_elements),))
        else:
            _use(mesh)
        yield Compiled(what, was_kept)


def _use(mesh: BoundaryMesh) -> None:
    """Compress the equations of a small mesh and put numbers into them, with slopes and without."""
    n, tree, material = mesh.n_elements, ClusterTree.of(mesh.centres, _LEAF), Material(1.0, 0.3)
    for takes_slopes in (True, False):
        columns = boundary_columns(mesh, material, tree.order, takes_slopes=takes_slopes)
        Compression.of(columns, tree, np.ones((n, 4), bool), 1e-6)
        columns.applied(np.arange(n), np.ones((n, 2)), np.ones((n, 2)))
        if columns.curved is None:
            elements = StraightElements.of(mesh, material, takes_slopes=takes_slopes)
            FastMultipole(elements, 1e-6).matvec(np.ones(4 * n))
