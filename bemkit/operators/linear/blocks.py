"""Sparse arrays made of blocks."""

from __future__ import annotations

from collections.abc import Iterable

from scipy import sparse

from bemkit.arrays import FloatArray


def diagonal_blocks(blocks: Iterable[FloatArray | sparse.csr_array]) -> sparse.csr_array:
    """Return a sparse array with blocks (m, n) of any shapes along its diagonal, zero elsewhere."""
    return sparse.csr_array(sparse.block_diag([sparse.coo_array(block) for block in blocks], format="csr"))
