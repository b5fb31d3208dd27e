"""The boundary equations of collocation solved by iteration: products by the fast multipole method, nothing dense."""

from __future__ import annotations

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import NoResultError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.hierarchy.boundary_columns import BoundaryColumns
from bemkit.operators.hierarchy.collocation_system import boundary_border
from bemkit.operators.hierarchy.factor import ElementLaws
from bemkit.operators.hierarchy.fast_multipole import LEAF_SIZE, FastMultipole
from bemkit.operators.hierarchy.preconditioner import Preconditioner
from bemkit.operators.hierarchy.system import HierarchicalSystem, NodeConditions
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.linear.solvers import MatrixFree
from bemkit.operators.material import Material

_PRODUCTS = 1e-3
"""Error of a product by the tolerance of the iteration; tractions feel it by elements on which it oscillates."""
_FINEST = 1e-13
"""Errors of products below that are round-off."""
_KEPT = 25
"""Steps after which the iteration starts again from where it is, and forgets its directions."""


class NotConvergedError(NoResultError):
    """An iteration that did not reach its tolerance; the message says how far it came and what helps."""


class MatrixFreeSystem(HierarchicalSystem):
    """(1/2 + T) u = U t with two conditions on each element, solved by GMRES [SaadSchultz1986].

    Parameters
    ----------
    mesh : BoundaryMesh
        Of straight elements, without symmetry.
    material : Material
    frame : (n_elements, 2, 2) array
        Rows are the directions of the conditions of each element.
    options : MatrixFree
        Its tolerance is about the error of displacements, and of tractions by E' over the diameter.
    slopes : bool
        Whether the double layer takes slopes.

    Notes
    -----
    The iteration begins with the last response. Its preconditioner is made anew if on some element other quantities
    are unknown than before.
    """

    def __init__(
        self, mesh: BoundaryMesh, material: Material, frame: FloatArray, options: MatrixFree, *, slopes: bool
    ) -> None:
        tree = ClusterTree.of(mesh.centres, LEAF_SIZE)
        self._order, self._n_elements, self._frame = tree.order, mesh.n_elements, frame
        self._place = np.empty_like(self._order)
        self._place[self._order] = np.arange(self._order.size)
        self._unit = mesh.diameter / mesh.n_elements / material.plane_modulus
        self._mesh, self._material = mesh, material
        self._tolerance, self._max_steps = options.tolerance, options.max_steps
        columns = BoundaryColumns.of(mesh, material, tree.order, takes_slopes=slopes)
        self._layers = FastMultipole(columns, tree, max(_PRODUCTS * options.tolerance, _FINEST))
        self._border = boundary_border(mesh, material, tree.order, slopes, has_holes=True)
        self._traction_unit = material.plane_modulus / mesh.diameter
        self._state, self._errors = np.zeros((self._order.size, 4)), np.zeros(self._border.errors.shape[1])
        self._laws: ElementLaws | None = None
        self._inverse: Preconditioner | None = None
        self.steps: list[int] = []
        """Steps of all responses so far."""

    def state(self, known: ElementLaws, elements: IntArray, conditions: NodeConditions) -> FloatArray:
        """Return (t_1, t_2, u_1, u_2) of some elements; see `HierarchicalSystem.state`.

        Raises
        ------
        UndeterminedError
            If conditions of an element are not independent.
        NotConvergedError
            If the steps do not suffice.
        """
        places, turned = self._place[elements], self.turned(elements, self.local_laws(conditions))
        laws = ElementLaws(known.factors.copy(), known.given.copy())
        laws.factors[places], laws.given[places] = turned.factors, turned.given
        if self._inverse is None or self._laws is None or np.any(laws.factors != self._laws.factors):
            self._inverse = Preconditioner.of(self._mesh, self._material, self._layers.columns, laws)
            self._laws = None
        if self._laws is None or np.any(laws.given != self._laws.given):
            self._laws = None  # until it is solved
            self._solve(laws, self._inverse)
            self._laws = laws
        both = self._state[places].reshape(-1, 2, 2)
        state: FloatArray = np.einsum("nkc,nqc->nqk", self._frame[elements], both).reshape(-1, 4)
        return state

    def everywhere(self) -> tuple[FloatArray, FloatArray]:
        """Return tractions and displacements (n_elements, 2) in x and y under the conditions of the last `state`."""
        state = np.empty_like(self._state)
        state[self._order] = self._state
        return state[:, :2], state[:, 2:]

    def residual(self, elements: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return what is left (n, 2) of the equations of some elements; see `HierarchicalSystem.residual`."""
        left = self._layers.applied(traction[self._order], displacement[self._order])
        left += (self._border.errors @ self._errors).reshape(-1, 2)
        return np.asarray(left[self._place[elements]])

    def _left(self, state: FloatArray, errors: FloatArray) -> FloatArray:
        """Return both sides of the equations and of the balances, one less the other."""
        equations = self._layers.matvec(state.ravel()) + self._border.errors @ errors
        return np.concatenate([equations, self._border.balances @ state.ravel()])

    def _solve(self, laws: ElementLaws, inverse: Preconditioner) -> None:
        """Find the state and the unknowns of the boundary as a whole that fulfil the equations under laws."""
        n = 2 * self._order.size
        normal = laws.factors.transpose(0, 2, 1)
        unknowns: FloatArray = np.linalg.solve(normal @ laws.factors, normal @ (self._state - laws.given)[:, :, None])[
            :, :, 0
        ].astype(float)
        units = np.where(inverse.is_traction, self._traction_unit, 1.0).ravel()
        state, errors = self._under(laws, unknowns), self._errors
        right = self._scaled(inverse.apply(-self._left(state, errors)), units)
        target = self._tolerance * max(self._size(state, errors), float(np.linalg.norm(right)))
        homogeneous = ElementLaws(laws.factors, np.zeros_like(laws.given))

        def product(x: FloatArray) -> FloatArray:
            of_unknowns = self._under(homogeneous, (units * x[:n]).reshape(-1, 2))
            return self._scaled(inverse.apply(self._left(of_unknowns, x[n:])), units)

        operator = LinearOperator((right.size, right.size), matvec=product, dtype=float)
        found: list[float] = []
        cycles = -(-self._max_steps // _KEPT)
        x, has_failed = gmres(
            operator, right, rtol=0.0, atol=target, restart=min(_KEPT, self._max_steps), maxiter=cycles,
            callback=lambda residual: found.append(float(residual)), callback_type="pr_norm",
        )  # fmt: skip
        self.steps.append(len(found))
        if has_failed:
            raise NotConvergedError(
                f"{len(found)} steps of GMRES leave {self._tolerance * found[-1] * np.linalg.norm(right) / target:.1e} "
                f"of the solution, above the tolerance {self._tolerance:g}: allow more max_steps, or choose the linear "
                "solver 'hierarchical'"
            )
        self._state = self._under(laws, unknowns + (units * x[:n]).reshape(-1, 2))
        self._errors = errors + x[n:]

    def _size(self, state: FloatArray, errors: FloatArray) -> float:
        scaled = np.concatenate([(state[:, :2] / self._traction_unit).ravel(), state[:, 2:].ravel(), errors])
        return float(np.linalg.norm(scaled))

    @staticmethod
    def _under(laws: ElementLaws, unknowns: FloatArray) -> FloatArray:
        """Return (t_x, t_y, u_x, u_y) of all elements from their unknowns (n, 2)."""
        state: FloatArray = (laws.factors @ unknowns[:, :, None])[:, :, 0] + laws.given
        return state

    @staticmethod
    def _scaled(x: FloatArray, units: FloatArray) -> FloatArray:
        return np.concatenate([x[: units.size] / units, x[units.size :]])
