"""The boundary equations of collocation solved by iteration: products by the fast multipole method, nothing dense."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.errors import NoResultError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.reciprocity import Arcs, ReciprocalField, reciprocal_fields
from bemkit.operators.hierarchy.system import HierarchicalSystem, NodeConditions
from bemkit.operators.linear.solvers import MatrixFree
from bemkit.operators.material import Material
from bemkit.operators.matrix_free.compact_laws import CompactLaws
from bemkit.operators.matrix_free.fast_multipole import FastMultipole
from bemkit.operators.matrix_free.gmres import SingleArray, gmres
from bemkit.operators.matrix_free.preconditioner import Preconditioner
from bemkit.operators.matrix_free.straight_elements import StraightElements, pairs
from bemkit.operators.rigid_modes import admissible_modes, traction_free_modes, without_motion

_PRODUCTS = 1e-3
"""Error of a product by the tolerance of the iteration; tractions feel it by elements on which it oscillates."""
LARGEST_RESIDUAL = 2.5
"""Largest residual of an equation, by the largest displacement and the tolerance. Where the mean of all is small enough
it is mostly below that, but all of it may be on a few elements."""
_FINEST = 1e-13
"""Errors of products below that are round-off."""


Vector: TypeAlias = FloatArray | SingleArray
"""Unknowns, or a direction of the iteration."""


@dataclass(frozen=True, eq=False)
class WholeBoundary:
    """Unknowns and equations of the boundary as a whole, those of `collocation_border`.

    Parameters
    ----------
    elements : StraightElements
    material : Material
    fields : list of ReciprocalField
        One for each closed curve.
    """

    elements: StraightElements
    material: Material
    fields: list[ReciprocalField]

    @classmethod
    def of(cls, elements: StraightElements, material: Material) -> WholeBoundary:
        """Return those of a mesh."""
        loops = zip(elements.mesh.loops, elements.mesh.loop_areas, strict=True)
        fields = [field for loop, area in loops for field in reciprocal_fields(elements.mesh, loop, area)]
        return cls(elements, material, fields)

    @property
    def n_unknowns(self) -> int:
        """Number of the rigid motions and of the closed curves."""
        return len(admissible_modes(self.elements.mesh)) + len(self.fields)

    def add_errors(self, unknowns: Vector, equations: ComplexArray) -> None:
        """Add what the unknowns (n_unknowns,), factors of rigid motions and of fields, do to the equations (n,)."""
        for some in self.elements.chunks():
            centres = self.elements.centres(some)
            errors = [*self._motions(centres), *(field.value(centres) for field in self.fields)]
            equations[some] += sum(factor * error for factor, error in zip(unknowns, errors, strict=True))

    def balances(self, traction: ComplexArray, mean: ComplexArray, slope: ComplexArray) -> FloatArray:
        """Return both sides of the equations, one less the other, of tractions and displacements (n,) on elements."""
        total = np.zeros(self.n_unknowns)
        compliance = 1.0 / (8.0 * np.pi * self.material.shear_modulus * (1.0 - self.material.effective_poisson_ratio))
        for some in self.elements.chunks():
            start, end = self.elements.ends(some)
            arcs, t, half = Arcs.straight(start, end), traction[some], 0.5 * (end - start)
            forces = compliance * t * np.abs(end - start)
            works = [(motion.conj() @ forces).real for motion in self._motions(self.elements.centres(some))]
            for field in self.fields:
                on_t, on_u, on_gradient = field.work(arcs, self.material)
                works.append((on_t @ t - on_u @ mean[some] - (on_gradient / half) @ slope[some]).real)
            total += works
        return total

    def _motions(self, points: ComplexArray) -> ComplexArray:
        """Return the rigid motions (n_motions, n) at points, complex."""
        mesh, places = self.elements.mesh, pairs(points)
        motions = traction_free_modes(mesh, places).reshape(*places.shape, -1)
        return np.asarray((motions[:, 0] + 1j * motions[:, 1]).T)


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
    What is kept between two responses are the unknowns of the last one, with which the iteration begins, and what is
    known. The preconditioner is made anew if on some element other quantities are unknown than before.
    """

    def __init__(
        self, mesh: BoundaryMesh, material: Material, frame: FloatArray, options: MatrixFree, *, slopes: bool
    ) -> None:
        self.n_elements, self._frame, self._material = mesh.n_elements, frame, material
        self._unit = mesh.diameter / mesh.n_elements / material.plane_modulus
        self._tolerance, self._max_steps = options.tolerance, options.max_steps
        self._elements = StraightElements.of(mesh, material, takes_slopes=slopes)
        self._layers = FastMultipole(self._elements, max(_PRODUCTS * options.tolerance, _FINEST))
        self._whole = WholeBoundary.of(self._elements, material)
        self._traction_unit = material.plane_modulus / mesh.diameter
        self._x = np.zeros(2 * mesh.n_elements + self._whole.n_unknowns)
        self._laws: CompactLaws | None = None
        self._inverse: Preconditioner | None = None
        self._is_solved, self._n_answers = False, 0
        self.steps: list[int] = []
        """Steps of all responses so far."""

    @property
    def n_answers(self) -> int:
        """How often conditions were asked for."""
        return self._n_answers

    def laws(self, conditions: NodeConditions) -> CompactLaws:  # type: ignore[override]  # what `state` takes
        """Return what conditions on all elements make of their tractions and displacements, in their frames."""
        parts = (conditions.take(some).solved(self._unit) for some in self._elements.chunks())
        return CompactLaws.joined([CompactLaws.of(each) for each in parts])

    def state(self, known: CompactLaws, elements: IntArray, conditions: NodeConditions) -> FloatArray:  # type: ignore[override]
        """Return (t_1, t_2, u_1, u_2) of some elements, ascending; see `HierarchicalSystem.state`.

        Raises
        ------
        UndeterminedError
            If conditions of an element are not independent.
        NotConvergedError
            If the steps do not suffice.
        """
        self._n_answers += 1
        laws, before = known.replaced(elements, conditions.solved(self._unit)), self._laws
        if before is None or not laws.has_factors_of(before):
            self._begin_with(laws)
            self._inverse = None  # before another is made
        elif not np.array_equal(laws.given, before.given):
            self._is_solved = False
        self._laws = laws
        if not self._is_solved:
            self._inverse = self._inverse or Preconditioner.of(self._elements, self._material, laws, self._frame)
            self._solve(laws, self._inverse)
        return self._local(laws, elements, self._x)

    def everywhere(self) -> tuple[FloatArray, FloatArray]:
        """Return tractions and displacements (n_elements, 2) in x and y under the conditions of the last `state`."""
        assert self._laws is not None  # `state` comes first
        traction, displacement = self._fields(self._laws, self._x)
        return pairs(traction), pairs(displacement)

    def residual(self, elements: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return the residual (n, 2) of the equations of some elements; see `HierarchicalSystem.residual`."""
        t, u = (each @ np.array([1.0, 1j]) for each in (traction, displacement))
        return self._left(t, u, self._x[2 * self.n_elements :])[0][elements]

    def _units(self, laws: CompactLaws, elements: IntArray) -> FloatArray:
        """Return the units (n, 2) of the unknowns of some elements in the iteration."""
        return np.where(laws.is_traction(elements), self._traction_unit, 1.0)

    def _local(self, laws: CompactLaws, elements: IntArray, x: Vector, *, is_change: bool = False) -> FloatArray:
        """Return (t_1, t_2, u_1, u_2) of some elements; of a change of the unknowns their change."""
        unknowns = x[: 2 * self.n_elements].reshape(-1, 2)[elements]
        return laws.state(elements, unknowns * self._units(laws, elements), is_change=is_change)

    def _fields(self, laws: CompactLaws, x: Vector, *, is_change: bool = False) -> tuple[ComplexArray, ComplexArray]:
        """Return complex tractions and displacements (n_elements,), in x and y; of a change their change."""
        traction, displacement = np.empty((2, self.n_elements), complex)
        for some in self._elements.chunks():
            local = self._local(laws, some, x, is_change=is_change)
            directions = self._frame[some] @ [1.0, 1j]
            traction[some] = (local[:, :2] * directions).sum(axis=1)
            displacement[some] = (local[:, 2:] * directions).sum(axis=1)
        return traction, displacement

    def _begin_with(self, laws: CompactLaws) -> None:
        """Take over the unknowns of the last response."""
        self._is_solved = False
        if self._laws is None:
            return
        unknowns = self._x[: 2 * self.n_elements].reshape(-1, 2)
        for some in self._elements.chunks():
            unknowns[some] = laws.unknowns(some, self._local(self._laws, some, self._x)) / self._units(laws, some)

    def _left(
        self, traction: ComplexArray, displacement: ComplexArray, errors: Vector
    ) -> tuple[FloatArray, FloatArray]:
        """Return the equations (n_elements, 2) and those of the whole boundary, both sides, one less the other."""
        mean, slope = self._elements.reconstructed(displacement)
        balances = self._whole.balances(traction, mean, slope)
        equations = self._layers.applied(traction, mean, slope, displacement)
        self._whole.add_errors(errors, equations)
        return pairs(equations), balances

    def _solve(self, laws: CompactLaws, inverse: Preconditioner) -> None:
        """Find the unknowns that fulfil the equations under laws, in the mean and each of them."""
        target, n_steps, is_enough = self._tolerance, 0, False
        while not is_enough:
            more, left, largest = self._iterated(laws, inverse, target, self._max_steps - n_steps)
            n_steps += more
            is_stuck = left > target
            if is_stuck and (target == self._tolerance or n_steps >= self._max_steps):
                raise NotConvergedError(
                    f"{n_steps} steps of GMRES leave {left:.1e} of the solution, above the tolerance {target:.3g}: "
                    + (
                        "allow more max_steps"
                        if n_steps >= self._max_steps
                        else "further ones do not help, take a larger one"
                    )
                    + ", or choose the linear solver 'hierarchical'"
                )
            allowed = LARGEST_RESIDUAL * self._tolerance * self._strained(laws)
            is_enough = is_stuck or largest <= allowed
            target *= 0.5 * allowed / largest if largest else 1.0
        self.steps.append(n_steps)
        self._is_solved = True

    def _iterated(
        self, laws: CompactLaws, inverse: Preconditioner, tolerance: float, max_steps: int
    ) -> tuple[int, float, float]:
        """Return steps, what they leave by `gmres`, and the largest residual of an equation of an element."""
        n, largest = 2 * self.n_elements, 0.0

        def preconditioned(equations: FloatArray, balances: FloatArray) -> FloatArray:
            result = inverse.apply(equations, balances)
            unknowns = result[:n].reshape(-1, 2)
            np.divide(unknowns, self._traction_unit, out=unknowns, where=inverse.is_traction)
            return result

        def product(x: Vector) -> FloatArray:
            return preconditioned(*self._left(*self._fields(laws, x, is_change=True), x[n:]))

        def residual(x: FloatArray) -> FloatArray:
            nonlocal largest
            equations, balances = self._left(*self._fields(laws, x), x[n:])
            largest = max(float(equations.max()), -float(equations.min()))
            left = preconditioned(equations, balances)
            return np.negative(left, out=left)

        size = self._size(laws)
        found = gmres(product, residual, self._x, tolerance=tolerance, size=size, max_steps=max_steps)
        return *found, largest

    def _strained(self, laws: CompactLaws) -> float:
        """Return the largest displacement beside a rigid motion."""
        mesh, (_, displacement) = self._elements.mesh, self._fields(laws, self._x)
        return float(np.abs(without_motion(mesh, mesh.centres, pairs(displacement))).max())

    def _size(self, laws: CompactLaws) -> float:
        """Return the norm of tractions and displacements in the units of the iteration."""
        traction, displacement = self._fields(laws, self._x)
        return float(np.hypot(np.linalg.norm(traction) / self._traction_unit, np.linalg.norm(displacement)))
