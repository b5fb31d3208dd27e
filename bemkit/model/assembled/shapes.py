"""What copies of a body have in common: assembled and factored once, here or on any executor."""

from __future__ import annotations

from concurrent.futures import BrokenExecutor, Executor
from dataclasses import dataclass

from bemkit.arrays import FloatArray
from bemkit.errors import CANNOT_BE_SENT, InputError, why_not_sent
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.model.assembled.placed import groups
from bemkit.model.assembled.prepared import PreparedAssembly, linear_solver
from bemkit.operators.linear.dense import SingularMatrixError
from bemkit.operators.linear.solvers import ChosenLinearSolver
from bemkit.operators.linear.threads import blas_threads_for
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside, HeavyElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from bemkit.scene.discretisation import Discretisation


class NotSentError(InputError):
    """A body that an executor cannot take, because something of it exists only here."""


@dataclass(frozen=True, eq=False)
class Shape:
    """What all copies of a body have in common, to be assembled and factored here or elsewhere."""

    name: str
    discretisation: Discretisation
    mesh: BoundaryMesh
    material: Material
    linear_solver: ChosenLinearSolver
    inside: ForcesInside | None
    conditions: NodalConditions
    force: FloatArray

    @classmethod
    def of(cls, prepared: PreparedAssembly, number: int) -> Shape:
        """Return that of a body, under its own load."""
        body = prepared.bodies[number]
        return cls(
            body.name,
            body.scene.discretisation,
            body.own_mesh.unit,
            body.material.scaled(prepared.units.modulus),
            linear_solver(prepared, number),
            prepared.insides[number],
            prepared.conditions[number],
            prepared.forces[number],
        )

    def condensed(self) -> tuple[SteklovPoincare, CondensedMap]:
        """Return the map without forces inside, and the body condensed under its load."""
        try:
            map_ = self.discretisation.chosen_map(self.mesh, self.material, self.linear_solver)
            loaded = map_ if self.inside is None else HeavyElasticity(map_, self.inside)
            return map_, loaded.condense(self.conditions, self.force)
        except SingularMatrixError as error:
            raise type(error)(f"body {self.name!r}: {error}") from error

    def condensed_elsewhere(self) -> tuple[SteklovPoincare, CondensedMap]:
        """Return the same in a process that does nothing else; as there, small matrices take one thread."""
        with blas_threads_for(2 * self.mesh.n_elements):
            return self.condensed()


def condensed_shapes(
    prepared: PreparedAssembly, executor: Executor | None = None
) -> list[tuple[SteklovPoincare, CondensedMap]]:
    """Return the map without forces inside and the condensed body of each group of copies, in their order.

    Raises
    ------
    SingularMatrixError, NotSentError
        See `build_assembled_model`.
    """
    shapes = [Shape.of(prepared, int(group[0])) for group in groups(prepared.bodies)]
    if executor is None:
        return [shape.condensed() for shape in shapes]
    try:
        return list(executor.map(Shape.condensed_elsewhere, shapes))
    except BrokenExecutor as error:
        raise NotSentError(
            f"the executor broke down ({str(error) or type(error).__name__}): take fewer processes, or remove it"
        ) from error
    except CANNOT_BE_SENT as error:
        for shape in shapes:
            if reason := why_not_sent(shape):
                raise NotSentError(
                    f"body {shape.name!r} cannot be sent to another process ({reason}): write its functions as "
                    "formulas, or remove the executor"
                ) from error
        raise
