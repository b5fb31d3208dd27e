"""Collocation with constant elements (the paper's discretisation): both boundary matrices at the element midpoints.

With complex tractions p and displacements v on an element from a to b, chord direction tau, half length l, seen from x:

    U p = A l ([1 - kappa (2 log(l / r0) + L)] p + tau^2 [Q / 2] conj(p)),                   A = 1 / (8 pi mu (1 - nu))
    T v = [D / (2 pi) - i B (1 - 2 nu) lambda] v + (i B / 2) [rho / conj(rho)]_a^b conj(v),  B = 1 / (4 pi (1 - nu))

where kappa = 3 - 4 nu, r0 is the diameter of the mesh, L, Q, D are the inner integrals (`pairs.Inner`) of log|rho|,
rho / conj(rho) and 2 pi k over the element of half length 1, and lambda = log(|x - a| / |x - b|): of the double layer
only k is left to integrate, the rest are differences between the ends, on straight and on curved elements alike. On its
own element D is a principal value; on straight ones it is zero. Then (1/2 I + T) u = U t.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.collocation_points import Coefficients, CollocationPoints, constant_runs
from bemkit.operators.collocation.gradient_reconstruction import GradientReconstruction
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.linear.threads import for_each_chunk
from bemkit.operators.material import Material
from bemkit.stopwatch import assembling

CHUNK_PAIRS = 32768


@assembling()
def sweep_rows(
    mesh: BoundaryMesh,
    material: Material,
    store: Callable[[slice, Coefficients], None],
    *,
    needs_single: BoolArray,
    needs_double: bool,
    takes_slopes: bool,
) -> int:
    """Evaluate the single and the double layer by chunks of rows, each of which is handed on as soon as it is there.

    Parameters
    ----------
    mesh : BoundaryMesh
        The images of elements that a symmetry adds are columns of the elements themselves.
    material : Material
    store : callable
        Takes the elements of some rows and the coefficients (n_rows, n_elements) of all densities there; called from
        several threads, and owner of what it is given.
    needs_single : (n_elements,) bool array
        Elements whose columns of the single layer are evaluated; those of the others may be zero.
    needs_double : bool
        Whether the double layer is evaluated; if not, its coefficients mean nothing.
    takes_slopes : bool
        Whether the double layer is that of displacements with slopes; see
        `bemkit.operators.collocation.gradient_reconstruction`.

    Returns
    -------
    int
        Pairs of a midpoint and an element that were evaluated.

    Notes
    -----
    The diagonal blocks of the double layer are such that constant displacements, which have constant values +1/2 or
    -1/2, keep them: an element of length h at coordinates of size one has its midpoint to eps / h only, and the
    tractions there feel that divided by h again unless a translation causes none.
    """
    n, whole = mesh.n_elements, mesh.whole
    images = [(1.0, 1.0)] if mesh.symmetry is None else mesh.symmetry.images.tolist()
    panels = Panels(whole)
    points = CollocationPoints(panels, material, mesh.diameter)
    reconstruction = GradientReconstruction.of(whole, panels) if takes_slopes and needs_double else None
    has_single = np.tile(needs_single, len(images))
    runs = [(run, bool(has_single[run.start])) for run in constant_runs(has_single, whole.is_straight)]
    runs = [(run, single) for run, single in runs if single or needs_double]
    value_of_one = 0.5 if mesh.is_exterior else -0.5

    def evaluate(rows: slice) -> None:
        block = points.evaluate(rows, runs, reconstruction is not None)
        if reconstruction is not None:
            block.add_slopes(reconstruction)
        if needs_double:
            sums = block.on_displacement.sum(axis=1), block.on_conjugate_displacement.sum(axis=1)
        block = block.folded(images)
        if needs_double:
            row, own = np.arange(rows.stop - rows.start), np.arange(rows.start, rows.stop)
            block.on_displacement[row, own] += value_of_one - sums[0]
            block.on_conjugate_displacement[row, own] -= sums[1]
        store(rows, block)

    step = max(1, CHUNK_PAIRS // whole.n_elements)
    chunks = (slice(first, min(first + step, n)) for first in range(0, n, step))
    for_each_chunk(evaluate, chunks, n_integrals=n * whole.n_elements)
    return n * sum(int(run.stop - run.start) for run, _ in runs)


def write_columns(on: FloatArray | ComplexArray, on_conjugate: ComplexArray, x: FloatArray, y: FloatArray) -> None:
    """Write the real form of v -> on v + on_conjugate conj(v).

    Parameters
    ----------
    on, on_conjugate : (n_rows, n_elements) arrays
    x, y : (n_rows, n_elements, 2) arrays
        The two components of the result, by the components of v.
    """
    np.add(on.real, on_conjugate.real, out=x[:, :, 0])
    np.subtract(on_conjugate.imag, on.imag, out=x[:, :, 1])
    np.add(on.imag, on_conjugate.imag, out=y[:, :, 0])
    np.subtract(on.real, on_conjugate.real, out=y[:, :, 1])
