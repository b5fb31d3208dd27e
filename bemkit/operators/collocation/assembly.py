"""Collocation with constant elements (the paper's discretisation): both boundary matrices at the element midpoints.

With complex tractions p and displacements v on an element from a to b, chord direction tau, half length l, seen from x:

    U p = A l ([1 - kappa (2 log(l / r0) + L)] p + tau^2 [Q / 2] conj(p)),                   A = 1 / (8 pi mu (1 - nu))
    T v = [D / (2 pi) - i B (1 - 2 nu) lambda] v + (i B / 2) [rho / conj(rho)]_a^b conj(v),  B = 1 / (4 pi (1 - nu))

where kappa = 3 - 4 nu, L, Q, D are the inner integrals (`pairs.Inner`) of log|rho|, rho / conj(rho) and 2 pi k over the
element of half length 1, and lambda = log(|x - a| / |x - b|): of the double layer only k is left to integrate, the rest
are differences between the ends, on straight and on curved elements alike. On its own element D is a principal value;
on straight ones it is zero. Then (1/2 I + T) u = U t.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.collocation_points import Midpoints
from bemkit.operators.collocation.columns import ColumnRun, covered, segments
from bemkit.operators.collocation.gradient_reconstruction import Slopes
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.linear.threads import for_each_chunk
from bemkit.operators.material import Material
from bemkit.operators.stopwatch import assembling

CHUNK_PAIRS = 32768


@dataclass(frozen=True, eq=False)
class BoundaryData:
    """Given tractions and displacements of elements, x + i y.

    Parameters
    ----------
    traction : (n_elements,) complex array [Pa]
    displacement : (n_elements,) complex array [m]
    """

    traction: ComplexArray
    displacement: ComplexArray


@dataclass(frozen=True, eq=False)
class Filled:
    """What a sweep over the pairs gives beside the columns that it writes.

    Parameters
    ----------
    known : (n_elements,) complex array [m]
        U t - T u of the data, without the free term.
    n_pairs : int
        Pairs of a midpoint and an element that were evaluated.
    """

    known: ComplexArray
    n_pairs: int


def collocation_matrices(mesh: BoundaryMesh, material: Material) -> tuple[FloatArray, FloatArray]:
    """Return the single and the double layer of constant densities at the element midpoints.

    Parameters
    ----------
    mesh : BoundaryMesh
        x is the point in the middle of the arc of each element.
    material : Material

    Returns
    -------
    single, double : (2 n_elements, 2 n_elements) arrays
        Rows and columns are 2 * element + component. single maps tractions [Pa] to displacements [m]; its logarithm
        is log(|r| / r0) with r0 the diameter of the mesh. double maps displacements to displacements, without the
        free term 1/2.
    """
    n = mesh.n_elements
    single, double = np.empty((n, 2, n, 2)), np.empty((n, 2, n, 2))
    runs = [
        [ColumnRun(slice(0, n), direction, m[:, 0, :, k], m[:, 1, :, k]) for k, direction in enumerate((1.0 + 0j, 1j))]
        for m in (single, double)
    ]
    fill_columns(mesh, material, *runs)
    return single.reshape(2 * n, 2 * n), double.reshape(2 * n, 2 * n)


@assembling()
def fill_columns(
    mesh: BoundaryMesh,
    material: Material,
    single: Sequence[ColumnRun],
    double: Sequence[ColumnRun],
    *,
    takes_slopes: bool = False,
    data: BoundaryData | None = None,
) -> Filled:
    """Evaluate some columns of the single and the double layer; entries of the others are not formed.

    Parameters
    ----------
    mesh : BoundaryMesh
        The images of elements that a symmetry adds are columns of the elements themselves.
    material : Material
    single, double : sequence of ColumnRun
        Columns that are wanted; they are written, not added.
    takes_slopes : bool
        Whether the double layer is that of displacements with slopes; see
        `bemkit.operators.collocation.gradient_reconstruction`.
    data : BoundaryData, optional
        Given tractions and displacements, whose columns are multiplied by them and not stored.

    Returns
    -------
    Filled

    Notes
    -----
    The diagonal blocks of the double layer are such that constant displacements, which have constant values +1/2 or
    -1/2, keep them: an element of length h at coordinates of size one has its midpoint to eps / h only, and the
    tractions there feel that divided by h again unless a translation causes none. The sums that this takes run over
    the coefficients of all elements, also of those whose columns are not wanted.
    """
    n, whole = mesh.n_elements, mesh.whole
    images = [(1.0, 1.0)] if mesh.symmetry is None else mesh.symmetry.images.tolist()
    panels = Panels(whole)
    midpoints = Midpoints(panels, material, mesh.diameter)
    slopes = Slopes.of(whole, panels) if takes_slopes else None
    data = BoundaryData(np.zeros(n, complex), np.zeros(n, complex)) if data is None else data
    needs_single = np.tile(covered(single, n) | (data.traction != 0.0), len(images))
    parts = [(part, bool(needs_single[part.start])) for part in segments(needs_single, whole.is_straight)]
    needs_double = bool(double) or bool(data.displacement.any())
    if not needs_double:
        parts, slopes = [part for part in parts if part[1]], None
    sums, known = np.zeros((2, n), complex), np.zeros(n, complex)

    def fill(rows: slice) -> None:
        found = midpoints.evaluate(rows, parts, slopes is not None)
        if slopes is not None:
            found.add_slopes(slopes)
        if needs_double:
            sums[:, rows] = found.on_displacement.sum(axis=1), found.on_conjugate_displacement.sum(axis=1)
        found = found.folded(images)
        for run in single:
            run.write(rows, found.on_traction[:, run.elements], found.on_conjugate_traction[:, run.elements])
        for run in double:
            run.write(rows, found.on_displacement[:, run.elements], found.on_conjugate_displacement[:, run.elements])
        if data.traction.any():
            known[rows] += _product(found.on_traction, found.on_conjugate_traction, data.traction)
        if data.displacement.any():
            known[rows] -= _product(found.on_displacement, found.on_conjugate_displacement, data.displacement)

    step = max(1, CHUNK_PAIRS // whole.n_elements)
    chunks = (slice(first, min(first + step, n)) for first in range(0, n, step))
    for_each_chunk(fill, chunks, n_pairs=n * whole.n_elements)
    own, balance = np.arange(n), ((0.5 if mesh.is_exterior else -0.5) - sums[0], -sums[1])
    for run in double:
        run.add(own, own, *balance)
    known -= balance[0] * data.displacement + balance[1] * data.displacement.conj()
    return Filled(known, n * sum(part.stop - part.start for part, _ in parts))


def _product(on: FloatArray | ComplexArray, on_conjugate: ComplexArray, density: ComplexArray) -> ComplexArray:
    """Return on v + on_conjugate conj(v), without BLAS: its threads and those of the chunks wait for each other."""
    product: ComplexArray = np.einsum("ij,j->i", on, density) + np.einsum("ij,j->i", on_conjugate, density.conj())
    return product
