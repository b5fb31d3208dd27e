"""The boundary equations of collocation solved by iteration: products by the fast multipole method, nothing dense."""

from __future__ import annotations

import numpy as np

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
from bemkit.operators.linear.gmres import gmres
from bemkit.operators.linear.solvers import MatrixFree
from bemkit.operators.material import Material

_PRODUCTS = 1e-3
"""Error of a product by the tolerance of the iteration; tractions feel it by elements on which it oscillates."""
_FINEST = 1e-13
"""Errors of products below that are round-off."""


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
        start: FloatArray = (
            np.linalg.solve(normal @ laws.factors, normal @ (self._state - laws.given)[:, :, None])
            .ravel()
            .astype(float)
        )
        units = np.where(inverse.is_traction, self._traction_unit, 1.0).ravel()

        def preconditioned(state: FloatArray, errors: FloatArray) -> FloatArray:
            result = inverse.apply(self._left(state, errors))
            result[:n] /= units
            return result

        def product(x: FloatArray) -> FloatArray:
            return preconditioned(_combined(laws.factors, units * x[:n]), x[n:])

        state = _combined(laws.factors, start) + laws.given
        right = -preconditioned(state, self._errors)
        target = self._tolerance * max(self._size(state), float(np.linalg.norm(right)))
        x, n_steps, left = gmres(product, right, target=target, max_steps=self._max_steps)
        self.steps.append(n_steps)
        if left > target:
            raise NotConvergedError(
                f"{n_steps} steps of GMRES leave {self._tolerance * left / target:.1e} of the solution, above the "
                f"tolerance {self._tolerance:g}: "
                + ("allow more max_steps" if n_steps >= self._max_steps else "round-off is reached, take a larger one")
                + ", or choose the linear solver 'hierarchical'"
            )
        self._state = _combined(laws.factors, start + units * x[:n]) + laws.given
        self._errors = self._errors + x[n:]

    def _size(self, state: FloatArray) -> float:
        """Return the norm of tractions and displacements in the units of the iteration."""
        return float(np.hypot(np.linalg.norm(state[:, :2]) / self._traction_unit, np.linalg.norm(state[:, 2:])))


def _combined(factors: FloatArray, unknowns: FloatArray) -> FloatArray:
    """Return what unknowns (2 n_elements,) make of (t_x, t_y, u_x, u_y), without what is given."""
    state: FloatArray = np.einsum("nqz,nz->nq", factors, unknowns.reshape(-1, 2))
    return state
