"""The boundary equations of collocation solved by iteration: products by the fast multipole method, nothing dense."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import InputError, NoResultError, counted
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.proximity.cluster_tree import ClusterTree
from bemkit.operators.collocation.equations import CollocationEquations, collocation_border
from bemkit.operators.hierarchy.system import LocalConditions
from bemkit.operators.linear_solvers import MatrixFree
from bemkit.operators.material import Material
from bemkit.operators.matrix_free.fast_multipole import LEAF_SIZE, FastMultipole
from bemkit.operators.matrix_free.preconditioner import Preconditioner
from bemkit.operators.rigid_modes import without_motion

_PRODUCTS = 1e-3
"""Error of a product relative to the tolerance of the iteration; tractions amplify errors that oscillate."""
LARGEST_RESIDUAL = 2.5
"""Largest residual of one equation, relative to the largest displacement times the tolerance. The mean residual may be
small enough while a few equations exceed it."""
_FINEST = 1e-13
"""Smallest error of products: round-off."""
_KEPT = 12
"""Search directions that GMRES keeps before it restarts."""
_SHARE = 0.8
"""Target of a round of GMRES relative to the target of the solve: its estimate of the residual is inexact."""


class NotConvergedError(NoResultError):
    """The iteration did not reach its tolerance; the message gives the residual and a remedy."""


class IterativeFactor:
    """(1/2 + T) u = U t with two conditions on each element, solved by GMRES [SaadSchultz1986]; see `BodyFactor`.

    Parameters
    ----------
    mesh : BoundaryMesh
        Straight elements without symmetry.
    material : Material
    options : MatrixFree
        Its tolerance is about the relative error of displacements, and of tractions relative to E' over the diameter.
    takes_slopes : bool
        Whether the displacements of the double layer vary linearly on each element.

    Attributes
    ----------
    steps : list of int
        GMRES steps of each response so far.

    Notes
    -----
    The iteration begins with the unknowns of the last response. The preconditioner is built again when the factors of
    the local conditions change.
    """

    def __init__(self, mesh: BoundaryMesh, material: Material, options: MatrixFree, *, takes_slopes: bool) -> None:
        self.tree = ClusterTree.of(mesh.centres, LEAF_SIZE)
        # elements in the order of the tree
        self._mesh = BoundaryMesh(
            mesh.nodes, mesh.elements[self.tree.order], is_exterior=mesh.is_exterior, follows_outline=True
        )
        self._material, self._options = material, options
        order = np.arange(mesh.n_elements)
        border = collocation_border(mesh, material, self.tree.order, takes_slopes=takes_slopes)
        self.equations = CollocationEquations(self._mesh, material, order, border, takes_slopes=takes_slopes)
        self._layers = FastMultipole(self.equations, material, self.tree, max(_PRODUCTS * options.tolerance, _FINEST))
        self._traction_unit = material.plane_modulus / mesh.diameter
        self._z, self._c = np.zeros((mesh.n_elements, 2)), np.zeros(len(border.balances))
        self.conditions: LocalConditions | None = None
        self.n_updates, self._is_solved = 0, False
        self._inverse: Preconditioner | None = None
        self.steps: list[int] = []

    def prepare(self, loads: Iterable[FloatArray]) -> None:
        """Do nothing: the iteration gains nothing from announced loads."""

    def update(self, conditions: LocalConditions) -> None:
        """Set the conditions on all elements; `unknowns` solves the equations."""
        before, self.conditions, self.n_updates = self.conditions, conditions, self.n_updates + 1
        if before is None or not np.array_equal(conditions.factors, before.factors):
            if before is not None:
                self._begin_with(before, conditions)
            self._inverse, self._is_solved = None, False
        elif not np.array_equal(conditions.given, before.given):
            self._is_solved = False

    def unknowns(self, leaves: IntArray) -> FloatArray:
        """Return the unknowns z (n, 2) of the elements of some leaves, ascending.

        Raises
        ------
        NotConvergedError
            If the iteration does not reach its tolerance.
        SingularMatrixError
            If the conditions do not hold the body.
        """
        if not self._is_solved:
            self._solve()
        parts = (self._z[self.tree.positions(0, leaf)] for leaf in leaves.tolist())
        return np.concatenate([np.zeros((0, 2)), *parts])

    def errors(self) -> FloatArray:
        """Return the border unknowns (n_border,) of the last call of `unknowns`."""
        return self._c

    def responses(self, leaf: int, given: FloatArray, leaves: IntArray) -> FloatArray:
        """Refuse to form a stiffness: each column would take an iteration.

        Raises
        ------
        InputError
            Always.
        """
        raise InputError(
            "the linear solver MatrixFree forms no stiffness: condense this body with Hierarchical() or densely"
        )

    def _begin_with(self, before: LocalConditions, conditions: LocalConditions) -> None:
        """Set the unknowns that fit the tractions and displacements of the last response best (least squares)."""
        units = np.array([1.0, 1.0, self._traction_unit, self._traction_unit])[:, None]
        state = (before.factors @ self._z[:, :, None] + before.given[:, :, None] - conditions.given[:, :, None]) * units
        factors = conditions.factors * units
        transposed = factors.transpose(0, 2, 1)
        self._z = np.linalg.solve(transposed @ factors, transposed @ state)[:, :, 0]

    def _state(self, z: FloatArray) -> FloatArray:
        """Return (t_x, t_y, u_x, u_y) of all elements without the given parts of the conditions."""
        assert self.conditions is not None  # `update` comes first
        return np.asarray(np.einsum("nqz,nz->nq", self.conditions.factors, z))

    def _residual(self, state: FloatArray, c: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the residuals of the equations (n_elements, 2) and of the border equations (n_border,)."""
        border = self.equations.border
        equations = self._layers.product(state[:, :2], state[:, 2:])
        equations += (border.errors @ c).reshape(-1, 2)
        return equations, border.balances @ state.ravel()

    def _solve(self) -> None:
        """Solve the equations until the mean residual and each single residual are small enough."""
        assert self.conditions is not None  # `update` comes first
        inverse = self._inverse = self._inverse or Preconditioner(
            self._mesh, self._material, self.equations, self.conditions, self._traction_unit
        )
        tolerance, most = self._options.tolerance, self._options.max_steps
        n_steps, target, before = 0, tolerance, np.inf

        def product(x: FloatArray) -> FloatArray:
            z, c = inverse.unknowns(x)
            return inverse.apply(*self._residual(self._state(z), c))

        while True:
            state = self._state(self._z) + self.conditions.given
            equations, balances = self._residual(state, self._c)
            residual, largest = inverse.apply(equations, balances), float(np.abs(equations).max())
            norm = float(np.linalg.norm(residual))
            state_norm = np.hypot(np.linalg.norm(state[:, :2]) / self._traction_unit, np.linalg.norm(state[:, 2:]))
            scale = max(norm, float(state_norm))
            if norm <= target * scale:
                strained = without_motion(self._mesh, self._mesh.centres, state[:, 2:])
                allowed = LARGEST_RESIDUAL * tolerance * float(np.abs(strained).max())
                if largest <= allowed:
                    break
                # the mean is small enough, a single residual is not
                target = 0.5 * min(norm / scale, target * allowed / largest)
            if not norm < 0.5 * before or n_steps >= most:
                if target < tolerance:
                    break  # the mean is small enough, and only round-off remains
                raise self._not_converged(n_steps, norm / scale)
            before = norm
            correction, more = _gmres(product, residual, _SHARE * target * scale / norm, most - n_steps)
            n_steps += more
            z, c = inverse.unknowns(correction)
            self._z, self._c = self._z - z, self._c - c
        self.steps.append(n_steps)
        self._is_solved = True

    def _not_converged(self, n_steps: int, residual: float) -> NotConvergedError:
        is_cut = n_steps >= self._options.max_steps
        return NotConvergedError(
            f"the relative residual is {residual:.1e} after {counted(n_steps, 'step')} of GMRES, above the tolerance "
            f"{self._options.tolerance:.3g}: "
            + ("increase max_steps" if is_cut else "more steps do not help, increase the tolerance")
            + ", or choose the linear solver 'hierarchical'"
        )


def _gmres(
    product: Callable[[FloatArray], FloatArray], right: FloatArray, tolerance: float, max_steps: int
) -> tuple[FloatArray, int]:
    """Return an approximate solution of ``product(x) = right`` and the number of steps."""
    from scipy.sparse.linalg import LinearOperator, gmres

    steps: list[float] = []
    operator = LinearOperator((right.size, right.size), matvec=product, dtype=float)
    x, _ = gmres(
        operator,
        right,
        rtol=tolerance,
        restart=min(_KEPT, max_steps),
        maxiter=max(1, max_steps // _KEPT),
        callback=steps.append,
        callback_type="pr_norm",
    )
    return x, len(steps)
