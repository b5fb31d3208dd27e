"""The boundary equations of collocation solved by iteration: products by the fast multipole method, nothing dense."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import NoResultError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.reciprocity import Reciprocity
from bemkit.operators.hierarchy.boundary_columns import BoundaryColumns
from bemkit.operators.hierarchy.factor import ElementLaws
from bemkit.operators.hierarchy.fast_multipole import LEAF_SIZE, FastMultipole
from bemkit.operators.hierarchy.preconditioner import Preconditioner
from bemkit.operators.hierarchy.system import HierarchicalSystem, NodeConditions
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.linear.gmres import gmres
from bemkit.operators.linear.solvers import MatrixFree
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import traction_free_modes

_PRODUCTS = 1e-3
"""Error of a product by the tolerance of the iteration; tractions feel it by elements on which it oscillates."""
_FINEST = 1e-13
"""Errors of products below that are round-off."""


@dataclass(frozen=True, eq=False)
class WholeBoundary:
    """Unknowns and equations of the boundary as a whole, of which as little as possible is stored.

    Parameters
    ----------
    errors : (2 n_elements, n_motions + n_loops) array
        Rigid motions and the fields of reciprocities: errors of the equations.
    on_resultant : (2 n_elements,) array [m^2/Pa]
        By which the work of tractions on rigid motions becomes a balance.
    on_traction, on_displacement : (n_loops, 2 n_elements) arrays
        Of the reciprocities; see `bemkit.operators.collocation.reciprocity`.
    """

    errors: FloatArray
    on_resultant: FloatArray
    on_traction: FloatArray
    on_displacement: FloatArray

    @classmethod
    def of(cls, mesh: BoundaryMesh, material: Material, order: IntArray, *, takes_slopes: bool) -> WholeBoundary:
        """Return what `collocation_system.boundary_border` does, by place."""
        reciprocity = Reciprocity.of(mesh, material, takes_slopes=takes_slopes)
        compliance = 1.0 / (8.0 * np.pi * material.shear_modulus * (1.0 - material.effective_poisson_ratio))
        places = (2 * order[:, None] + np.arange(2)).ravel()
        errors = np.column_stack([traction_free_modes(mesh, mesh.centres), reciprocity.fields])
        weights = compliance * np.repeat(mesh.lengths[order], 2)
        rows = (each[:, places] for each in (reciprocity.on_traction, reciprocity.on_displacement))
        return cls(errors[places], weights, *rows)

    def balances(self, state: FloatArray) -> FloatArray:
        """Return both sides of the additional equations, one less the other, of (t_x, t_y, u_x, u_y) by place."""
        traction, displacement = state[:, :2].ravel(), state[:, 2:].ravel()
        n_motions = self.errors.shape[1] - len(self.on_traction)
        resultants = (self.on_resultant * traction) @ self.errors[:, :n_motions]
        return np.concatenate([resultants, self.on_traction @ traction - self.on_displacement @ displacement])


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
        self._whole = WholeBoundary.of(mesh, material, tree.order, takes_slopes=slopes)
        self._traction_unit = material.plane_modulus / mesh.diameter
        self._state, self._errors = np.zeros((self._order.size, 4)), np.zeros(self._whole.errors.shape[1])
        self._laws: ElementLaws | None = None
        self._inverse: Preconditioner | None = None
        self._n_answers = 0
        self.steps: list[int] = []
        """Steps of all responses so far."""

    @property
    def n_answers(self) -> int:
        """How often conditions were asked for."""
        return self._n_answers

    def state(self, known: ElementLaws, elements: IntArray, conditions: NodeConditions) -> FloatArray:
        """Return (t_1, t_2, u_1, u_2) of some elements; see `HierarchicalSystem.state`.

        Raises
        ------
        UndeterminedError
            If conditions of an element are not independent.
        NotConvergedError
            If the steps do not suffice.
        """
        self._n_answers += 1
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
        left += (self._whole.errors @ self._errors).reshape(-1, 2)
        return np.asarray(left[self._place[elements]])

    def _left(self, state: FloatArray, errors: FloatArray) -> FloatArray:
        """Return both sides of the equations and of the balances, one less the other."""
        equations = self._layers.applied(state[:, :2], state[:, 2:]).ravel()
        equations += self._whole.errors @ errors
        return np.concatenate([equations, self._whole.balances(state)])

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

        self._state = _combined(laws.factors, start) + laws.given
        right = -preconditioned(self._state, self._errors)
        target = self._tolerance * max(self._size(self._state), float(np.linalg.norm(right)))
        x, n_steps, left = gmres(product, right, target=target, max_steps=self._max_steps)
        self.steps.append(n_steps)
        if left > target:
            raise NotConvergedError(
                f"{n_steps} steps of GMRES leave {self._tolerance * left / target:.1e} of the solution, above the "
                f"tolerance {self._tolerance:g}: "
                + ("allow more max_steps" if n_steps >= self._max_steps else "round-off is reached, take a larger one")
                + ", or choose the linear solver 'hierarchical'"
            )
        self._state += _combined(laws.factors, units * x[:n])
        self._errors = self._errors + x[n:]

    def _size(self, state: FloatArray) -> float:
        """Return the norm of tractions and displacements in the units of the iteration."""
        return float(np.hypot(np.linalg.norm(state[:, :2]) / self._traction_unit, np.linalg.norm(state[:, 2:])))


def _combined(factors: FloatArray, unknowns: FloatArray) -> FloatArray:
    """Return what unknowns (2 n_elements,) make of (t_x, t_y, u_x, u_y), without what is given."""
    state: FloatArray = np.einsum("nqz,nz->nq", factors, unknowns.reshape(-1, 2))
    return state
