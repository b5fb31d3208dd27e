"""A small finite element code for the paper's examples: what a boundary element code has to beat.

Rectangles with contact at the bottom and rollers on the right, on tensor-product meshes of Lagrange elements of any
degree with Gauss-Lobatto nodes. One sparse factorisation condenses the body onto the contact nodes (the Schur
complement by PARDISO where `pypardiso` is installed, by SuperLU otherwise); bemkit's semismooth Newton method solves
the small contact problem that is left, and never learns where the stiffness came from.

Everything favours the finite elements: the product structure makes assembly cheap, mesh lines run through the jumps of
the loads, only the contact side is recovered, and meshes may be graded towards transition points that are *given*.
Contact tractions are consistent nodal forces over Gauss-Lobatto weights, which is more accurate here than a
consistent mass matrix on the closed nodes, let alone stresses of the elements.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from scipy import sparse

import bemkit as bk
from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.problem import ContactProblem
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.results.contact_table import ContactTable
from bemkit.results.transitions import Transition, find_transitions
from bemkit.solvers.base import solve
from bemkit.threads import blas_threads_for

_N_CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
HAS_PARDISO = importlib.util.find_spec("pypardiso") is not None
LARGE = 30_000
"""Unknowns above which PARDISO uses all cores."""


@dataclass(frozen=True, eq=False)
class Line:
    """A line cut into elements of one degree: the factor of a tensor-product mesh.

    Parameters
    ----------
    ends : (n_elements + 1,) array [m]
    degree : int
    """

    ends: FloatArray
    degree: int

    @cached_property
    def half(self) -> FloatArray:
        """(n_elements,) array [m]: half the lengths."""
        return 0.5 * np.diff(self.ends)

    @cached_property
    def dofs(self) -> IntArray:
        """(n_elements, degree + 1) array: node numbers along the line."""
        return self.degree * np.arange(self.half.size)[:, None] + np.arange(self.degree + 1)

    @cached_property
    def nodes(self) -> FloatArray:
        """(n_nodes,) array [m]."""
        nodes = np.empty(self.dofs[-1, -1] + 1)
        nodes[self.dofs] = self.points(_lobatto(self.degree)[0])
        return nodes

    @cached_property
    def weights(self) -> FloatArray:
        """(n_nodes,) array [m]: length that belongs to each node."""
        return self.summed(self.half[:, None] * _lobatto(self.degree)[1])

    def points(self, xi: FloatArray) -> FloatArray:
        """Return the points (n_elements, q) [m] at local coordinates (q,)."""
        return (self.ends[:-1] + self.half)[:, None] + self.half[:, None] * xi

    def summed(self, values: FloatArray) -> FloatArray:
        """Add up local values (n_elements, degree + 1) at the nodes."""
        return np.bincount(self.dofs.ravel(), values.ravel())

    def matrix(self, n_test: int, n_trial: int) -> sparse.csr_matrix:
        """Return the integrals of the n-th derivatives of the basis functions; all have the same pattern."""
        xi, weights = gauss_legendre(self.degree + 1)
        test, trial = _basis(self.degree, xi, n_test), _basis(self.degree, xi, n_trial)
        local = np.einsum("q,iq,jq->ij", weights, test, trial)
        values = self.half[:, None, None] ** (1 - n_test - n_trial) * local
        rows, columns = np.broadcast_arrays(self.dofs[:, :, None], self.dofs[:, None, :])
        return sparse.coo_matrix((values.ravel(), (rows.ravel(), columns.ravel()))).tocsr()

    def evaluated(self, nodal: FloatArray, x: FloatArray) -> FloatArray:
        """Interpolate nodal values by the elements."""
        own = np.clip(np.searchsorted(self.ends, x - 1e-14) - 1, 0, self.half.size - 1)
        xi = np.clip((x - self.ends[own]) / self.half[own] - 1.0, -1.0, 1.0)
        return np.einsum("in,ni->n", _basis(self.degree, xi, 0), nodal[self.dofs[own]])


def uniform_line(length: float, n_elements: int, degree: int) -> Line:
    """Return a line of equal elements."""
    return Line(np.linspace(0.0, length, n_elements + 1), degree)


def graded_line(breaks: Sequence[float], n_elements: int, degree: int, exponent: float) -> Line:
    """Return a line whose pieces between breaks are graded towards their ends.

    Parameters
    ----------
    breaks : sequence of float [m]
        From end to end; the pieces share the elements by the square roots of their lengths, at least two each.
    n_elements : int
        About so many.
    degree : int
    exponent : float
        At the distance d from a break elements have lengths like d**(1 - 1/exponent).
    """
    roots = np.sqrt(np.diff(breaks))
    ends = [np.zeros(1)]
    for start, length, share in zip(breaks, np.diff(breaks), roots / roots.sum(), strict=False):
        y = np.linspace(0.0, 1.0, max(2, round(n_elements * share)) + 1)
        near = 0.5 * (2.0 * np.minimum(y, 1.0 - y)) ** exponent
        ends.append(start + length * np.where(y <= 0.5, near, 1.0 - near)[1:])
    return Line(np.concatenate(ends), degree)


def layered_line(breaks: Sequence[float], layers: Sequence[int], degree: int, factor: float = 0.17) -> Line:
    """Return a line whose pieces between breaks are cut in their middles and in geometric layers towards their ends.

    Parameters
    ----------
    breaks : sequence of float [m]
        From end to end.
    layers : sequence of int
        Layers on either side of each break; on a short piece fewer, so that they are as fine as those of the longest.
    degree : int
    factor : float
        Length of a layer over that of the next one.
    """
    lengths, ends = np.diff(breaks), [np.array(breaks)]
    for start, length, n_left, n_right in zip(breaks, lengths, layers, layers[1:], strict=False):
        n_spared = int(np.log(length / lengths.max()) / np.log(factor))
        left, right = (0.5 * length * factor ** np.arange(max(n - n_spared, 0), 0.0, -1.0) for n in (n_left, n_right))
        ends += [start + left, [start + 0.5 * length], start + length - right]
    return Line(np.sort(np.concatenate(ends)), degree)


@lru_cache
def _lobatto(degree: int) -> tuple[FloatArray, FloatArray]:
    """Return the Gauss-Lobatto points and weights on [-1, 1]."""
    legendre = np.polynomial.legendre.Legendre.basis(degree)
    points = np.concatenate([[-1.0], np.sort(legendre.deriv().roots().real), [1.0]])
    return points, 2.0 / (degree * (degree + 1) * legendre(points) ** 2)


@lru_cache
def _coefficients(degree: int) -> FloatArray:
    """Return the monomial coefficients (power, function) of the basis functions."""
    return np.linalg.inv(np.vander(_lobatto(degree)[0], increasing=True))


def _basis(degree: int, xi: FloatArray, n_derivative: int) -> FloatArray:
    """Return the values (degree + 1, n_points) of the basis functions or their derivatives."""
    coefficients = np.polynomial.polynomial.polyder(_coefficients(degree), n_derivative)
    return np.polynomial.polynomial.polyval(xi, coefficients)


@dataclass(frozen=True, eq=False)
class FiniteElementSolution:
    """What is compared: fields on the contact side and resultants.

    Parameters
    ----------
    line : Line
        The contact side.
    contact : ContactTable
    force_tangential : float [N/m]
    energy : float [J/m]
    transitions : tuple of Transition
    """

    line: Line
    contact: ContactTable
    force_tangential: float
    energy: float
    transitions: tuple[Transition, ...]


def solve_scene(scene: bk.Scene, x: Line, y: Line) -> FiniteElementSolution:
    """Solve a scene of the paper's kind on the mesh of all products of two lines."""
    n_x, n_y = x.nodes.size, y.nodes.size
    number = np.arange(2 * n_x * n_y).reshape(n_x, n_y, 2)
    is_held = np.zeros(number.size, bool)
    is_held[number[-1, :, 0]] = True  # u_x at the roller
    load = np.where(is_held, 0.0, _load(scene, x, y))
    kept = number[:, 0].ravel()
    stiffness, condensed, work = _condensed(_stiffness(scene.material, x, y, is_held), load, kept)
    to_local = np.stack([2 * np.arange(n_x) + 1, 2 * np.arange(n_x)], axis=1).ravel()  # u_n = -u_y, u_t = u_x
    sign = np.tile([-1.0, 1.0], n_x)
    whole = sign[:, None] * stiffness[np.ix_(to_local, to_local)] * sign
    forces = sign * condensed[to_local]
    floating = np.tile([1.0, 0.0], n_x).reshape(1, n_x, 2)
    body = DenseBody(whole, forces, x.weights, floating)
    problem = ContactProblem(body, np.zeros(n_x), scene.law)
    with blas_threads_for(2 * n_x):
        result = solve(problem, bk.SemismoothNewton())
    state = result.state
    table = ContactTable(
        part=("foundation",) * n_x,
        x=x.nodes,
        y=np.zeros(n_x),
        s=x.nodes,
        u_n=state.u_n.copy(),
        u_t=state.u_t.copy(),
        sigma_n=state.sigma_n.copy(),
        sigma_t=state.sigma_t.copy(),
        gap=np.zeros(n_x),
        clearance=-state.u_n,
        status=np.asarray(result.node_status).copy(),
        weight=x.weights,
    )
    displacement = state.displacement.ravel()
    return FiniteElementSolution(
        line=x,
        contact=table,
        force_tangential=float(x.weights @ state.sigma_t),
        energy=0.5 * float(displacement @ whole @ displacement + work),
        transitions=find_transitions(table, table.u_t),
    )


def _stiffness(material: bk.Material, x: Line, y: Line, is_held: BoolArray) -> sparse.csr_matrix:
    """Return the upper triangle of the stiffness matrix; held unknowns are coupled with nothing.

    Component c of the node (i, j) has the number 2 (n_y i + j) + c. The matrix is a sum of Kronecker products of
    matrices with a common pattern: n_x by n_x ones and, for both components together, 2 n_y by 2 n_y ones.
    """
    mu, nu = material.shear_modulus, material.effective_poisson_ratio
    lame = 2.0 * mu * nu / (1.0 - 2.0 * nu)
    terms = [
        (x.matrix(1, 1), y.matrix(0, 0), [[lame + 2.0 * mu, 0.0], [0.0, mu]]),
        (x.matrix(0, 0), y.matrix(1, 1), [[mu, 0.0], [0.0, lame + 2.0 * mu]]),
        (x.matrix(1, 0), y.matrix(0, 1), [[0.0, lame], [mu, 0.0]]),
        (x.matrix(0, 1), y.matrix(1, 0), [[0.0, mu], [lame, 0.0]]),
    ]
    factors = [(of_x.data, sparse.kron(of_y, np.array(moduli), "bsr").tocsr().data) for of_x, of_y, moduli in terms]
    of_x = x.matrix(0, 0)
    of_y = sparse.kron(y.matrix(0, 0), np.ones((2, 2)), "bsr").tocsr()
    size_y = of_y.shape[0]
    # the entries of row (i, j) are the products of the entries of row i and those of row j, in this order
    n_y = np.diff(of_y.indptr)
    n_entries = np.multiply.outer(np.diff(of_x.indptr), n_y).ravel()
    row = np.repeat(np.arange(n_entries.size), n_entries)
    i, j = np.divmod(row, size_y)
    nth_x, nth_y = np.divmod(np.arange(row.size) - np.repeat(np.cumsum(n_entries) - n_entries, n_entries), n_y[j])
    at_x, at_y = of_x.indptr[i] + nth_x, of_y.indptr[j] + nth_y
    column = size_y * of_x.indices[at_x] + of_y.indices[at_y]
    is_wanted = (column == row) | ((column > row) & ~is_held[row] & ~is_held[column])
    row, column, at_x, at_y = (array[is_wanted] for array in (row, column, at_x, at_y))
    data = sum(in_x[at_x] * in_y[at_y] for in_x, in_y in factors)
    starts = np.concatenate([[0], np.cumsum(np.bincount(row))])
    return sparse.csr_matrix((data, column, starts))


def _load(scene: bk.Scene, x: Line, y: Line) -> FloatArray:
    """Return the nodal forces [N/m] of the tractions on sides of a rectangle."""
    load = np.zeros((x.nodes.size, y.nodes.size, 2))
    width, height = x.nodes[-1], y.nodes[-1]
    sides = {
        "top": (x, load[:, -1], lambda s: np.stack([s, np.full_like(s, height)], axis=-1), (0.0, 1.0)),
        "left": (y, load[0], lambda s: np.stack([np.zeros_like(s), s], axis=-1), (-1.0, 0.0)),
        "right": (y, load[-1], lambda s: np.stack([np.full_like(s, width), s], axis=-1), (1.0, 0.0)),
    }
    for part in scene.parts:
        if not isinstance(part.condition, bk.Traction):
            continue
        for side in part.sides:
            line, target, place, normal = sides[side]
            xi, weights = gauss_legendre(line.degree + 3)
            points = place(line.points(xi))
            values = part.condition.at(points.reshape(-1, 2), np.broadcast_to(normal, (points[..., 0].size, 2)))
            if part.where is not None:
                middle = place(line.points(np.zeros(1)))[:, 0]
                values = values * np.repeat(part.where(middle[:, 0], middle[:, 1]), xi.size)[:, None]
            local = np.einsum(
                "q,iq,eqc,e->eic", weights, _basis(line.degree, xi, 0), values.reshape(points.shape), line.half
            )
            for component in (0, 1):
                target[:, component] += line.summed(local[:, :, component])
    return load.ravel()


def _condensed(upper: sparse.csr_matrix, load: FloatArray, kept: IntArray) -> tuple[FloatArray, FloatArray, float]:
    """Eliminate all unknowns but the kept ones: their stiffness and load, and the work done on the others."""
    # the load as one more column: elimination then condenses it too
    loaded = np.flatnonzero(load)
    indices = np.insert(upper.indices, upper.indptr[loaded + 1], load.size)
    data = np.insert(upper.data, upper.indptr[loaded + 1], -load[loaded])
    starts = upper.indptr + np.concatenate([[0], np.cumsum(load != 0.0)])
    whole = sparse.csr_matrix((np.append(data, 0.0), np.append(indices, load.size), np.append(starts, data.size + 1)))
    schur = _schur(whole, np.append(kept, load.size))
    return schur[:-1, :-1], -schur[:-1, -1], -float(schur[-1, -1])


def _schur(upper: sparse.csr_matrix, kept: IntArray) -> FloatArray:
    """Return the Schur complement that a symmetric matrix, given by its upper triangle, leaves on the kept unknowns."""
    if HAS_PARDISO:
        return _schur_by_pardiso(upper, kept)
    from scipy.sparse.linalg import splu

    whole = (upper + sparse.triu(upper, 1).T).tocsc()
    rest = np.setdiff1d(np.arange(whole.shape[0]), kept)
    beside = whole[rest][:, kept].toarray()
    factor = splu(whole[rest][:, rest], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    return np.asarray(whole[kept][:, kept].toarray() - beside.T @ factor.solve(beside))


def _schur_by_pardiso(upper: sparse.csr_matrix, kept: IntArray) -> FloatArray:
    solver, size, n_kept = _pardiso(), upper.shape[0], kept.size
    solver.libmkl.MKL_Set_Num_Threads(_N_CORES if size > LARGE else 1)
    solver.pt[:] = 0
    solver.perm = np.zeros(size, np.int32)
    solver.perm[kept] = 1
    solver.set_phase(12)
    # the complement comes back where solutions do, n_kept by n_kept whatever the length of the right-hand side
    found = solver._call_pardiso(upper, np.zeros(max(size, n_kept**2)))[: n_kept**2].reshape(n_kept, n_kept).copy()
    solver.set_phase(-1)
    solver._call_pardiso(upper, np.zeros(size))
    return np.asarray(found)


@lru_cache
def _pardiso() -> Any:
    """Load the library once: symmetric indefinite, nested dissection, Schur complement."""
    from pypardiso.pardiso_wrapper import PyPardisoSolver

    solver = PyPardisoSolver(mtype=-2)
    for number, value in {1: 1, 2: 2, 10: 8, 36: 1}.items():
        solver.set_iparm(number, value)
    return solver
