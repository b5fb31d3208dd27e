"""Shared data of copies of a body: assembled and factored once, here or on any executor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bemkit.arrays import FloatArray
from bemkit.errors import CANNOT_BE_SENT, InputError, why_not_sent
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.model.placed import groups
from bemkit.model.prepared import Prepared, PreparedBody
from bemkit.operators.half_plane.far_drive import FarDrive
from bemkit.operators.half_plane.surface import SurfaceElasticity
from bemkit.operators.linear.dense import SingularMatrixError
from bemkit.operators.linear.solvers import ChosenLinearSolver
from bemkit.operators.linear.threads import blas_threads_for
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside, HeavyElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from bemkit.scene.discretisation import Discretisation

if TYPE_CHECKING:
    from concurrent.futures import Executor


class NotSentError(InputError):
    """A body that an executor cannot take, because something of it exists only here."""


@dataclass(frozen=True, eq=False)
class Shape:
    """Shared data of all copies of a body, to be assembled and factored here or elsewhere."""

    name: str
    discretisation: Discretisation
    mesh: BoundaryMesh
    material: Material
    linear_solver: ChosenLinearSolver
    drive: FarDrive
    inside: ForcesInside | None
    conditions: NodalConditions
    force: FloatArray

    @classmethod
    def of(cls, prepared: Prepared, body: PreparedBody) -> Shape:
        """Return that of a body, under its own load."""
        return cls(
            body.name,
            body.scene.discretisation,
            body.own_mesh.unit,
            prepared.material_of(body),
            prepared.linear_solver(body),
            body.drive,
            body.inside,
            body.conditions,
            body.force,
        )

    @property
    def map(self) -> SteklovPoincare:
        """The elastic map without forces inside."""
        map_ = self.discretisation.chosen_map(self.mesh, self.material, self.linear_solver)
        return driven_by(map_, self.drive)

    def condensed(self) -> tuple[SteklovPoincare, CondensedMap]:
        """Return the map without forces inside, and the body condensed under its load."""
        try:
            map_ = self.map
            loaded = map_ if self.inside is None else HeavyElasticity(map_, self.inside)
            return map_, loaded.condense(self.conditions, self.force)
        except SingularMatrixError as error:
            if not self.name:
                raise
            raise type(error)(f"body {self.name!r}: {error}") from error

    def condensed_elsewhere(self) -> tuple[SteklovPoincare, CondensedMap]:
        """Return the same in a process that does nothing else; as there, small matrices take one thread."""
        with blas_threads_for(2 * self.mesh.n_elements):
            return self.condensed()


def driven_by(elastic: SteklovPoincare, drive: FarDrive) -> SteklovPoincare:
    """Return a half-plane that moves otherwise far away; a body that ends somewhere stays as it is."""
    return elastic.driven_by(drive) if isinstance(elastic, SurfaceElasticity) else elastic


def elastic_map(prepared: Prepared, body: PreparedBody) -> SteklovPoincare:
    """Return the elastic map of a body under its forces inside."""
    map_ = Shape.of(prepared, body).map
    return map_ if body.inside is None else HeavyElasticity(map_, body.inside)


def condensed_shapes(
    prepared: Prepared, executor: Executor | None = None
) -> list[tuple[SteklovPoincare, CondensedMap]]:
    """Return the map without forces inside and the condensed body of each group of copies, in their order.

    Raises
    ------
    SingularMatrixError, NotSentError
        See `bemkit.model.model.build_model`.
    """
    shapes = [Shape.of(prepared, prepared.bodies[int(group[0])]) for group in groups(prepared.bodies)]
    if executor is None:
        return [shape.condensed() for shape in shapes]
    from concurrent.futures import BrokenExecutor

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
