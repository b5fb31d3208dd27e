"""Both boundary matrices of collocation as a whole; bodies are solved without them, column by column."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.assembly import sweep_rows, write_columns
from bemkit.operators.collocation.collocation_points import Coefficients
from bemkit.operators.material import Material


def collocation_matrices(
    mesh: BoundaryMesh, material: Material, *, takes_slopes: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Return the single and the double layer of constant densities at the element midpoints.

    Parameters
    ----------
    mesh : BoundaryMesh
        x is the point in the middle of the arc of each element.
    material : Material
    takes_slopes : bool
        As in `sweep_rows`.

    Returns
    -------
    single, double : (2 n_elements, 2 n_elements) arrays
        Rows and columns are 2 * element + component. single maps tractions [Pa] to displacements [m]; its logarithm
        is log(|r| / r0) with r0 the diameter of the mesh. double maps displacements to displacements, without the
        free term 1/2.
    """
    n = mesh.n_elements
    single, double = np.empty((n, 2, n, 2)), np.empty((n, 2, n, 2))

    def store(rows: slice, block: Coefficients) -> None:
        write_columns(block.on_traction, block.on_conjugate_traction, single[rows, 0], single[rows, 1])
        write_columns(block.on_displacement, block.on_conjugate_displacement, double[rows, 0], double[rows, 1])

    sweep_rows(mesh, material, store, needs_single=np.ones(n, bool), needs_double=True, takes_slopes=takes_slopes)
    return single.reshape(2 * n, 2 * n), double.reshape(2 * n, 2 * n)
