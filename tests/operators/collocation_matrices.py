"""Both boundary matrices of collocation as a whole, every pair exactly: slow, and without the code that bodies take."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.corrections import GradientReconstruction
from bemkit.operators.collocation.curved_elements import exact_factors
from bemkit.operators.collocation.layers import Constants
from bemkit.operators.element_geometry import ElementGeometry
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
        Whether the double layer takes the slopes of displacements.

    Returns
    -------
    single, double : (2 n_elements, 2 n_elements) arrays
        Rows and columns are 2 * element + component. single maps tractions [Pa] to displacements [m]; its logarithm
        is log(|r| / r0) with r0 the diameter of the mesh. double maps displacements to displacements, without the
        free term 1/2.
    """
    n, whole = mesh.n_elements, mesh.whole
    geometry = ElementGeometry(whole)
    row, column = np.divmod(np.arange(n * whole.n_elements), whole.n_elements)
    exact = exact_factors(geometry, Constants.of(material, mesh.diameter), geometry.centre[row], column, row == column)
    p, conj_p, v, conj_v, s, conj_s = exact.reshape(6, n, whole.n_elements)
    if takes_slopes:
        reconstruction = GradientReconstruction(whole, geometry)
        v, conj_v = reconstruction.gathered(v, s), reconstruction.gathered(conj_v.conj(), conj_s.conj()).conj()
    return _real(mesh, p, conj_p), _real(mesh, v, conj_v)


def _real(mesh: BoundaryMesh, on: ComplexArray, on_conjugate: ComplexArray) -> FloatArray:
    """Return the matrix of v -> on v + on_conjugate conj(v), images added to what they are images of."""
    images = np.ones((1, 2)) if mesh.symmetry is None else mesh.symmetry.images
    x, y = on + on_conjugate, 1j * (on - on_conjugate)
    columns = np.stack([x, y], axis=-1).reshape(mesh.n_elements, len(images), mesh.n_elements, 2)
    total = np.einsum("rgnc,gc->rnc", columns, images)
    return np.stack([total.real, total.imag], axis=1).reshape(2 * mesh.n_elements, -1)
