"""Shared data of copies of a body: assembled and factored once, here or on any executor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bemkit.arrays import FloatArray
from bemkit.errors import CANNOT_BE_SENT, InputError, why_not_sent
from bemkit.model.given import loaded_map
from bemkit.model.placed import groups
from bemkit.model.prepared import Prepared
from bemkit.operators.linear_solvers import SingularMatrixError
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from bemkit.threads import blas_threads_for

if TYPE_CHECKING:
    from concurrent.futures import Executor


class NotSentError(InputError):
    """A body that an executor cannot take, because something of it exists only here."""


@dataclass(frozen=True, eq=False)
class Shape:
    """Shared data of all copies of a body, to be assembled and factored here or elsewhere."""

    name: str
    map: SteklovPoincare
    inside: ForcesInside | None
    conditions: NodalConditions
    force: FloatArray

    def condensed(self) -> tuple[SteklovPoincare, CondensedMap]:
        """Return the map without forces inside, and the body condensed under its load."""
        try:
            return self.map, loaded_map(self.map, self.inside).condense(self.conditions, self.force)
        except SingularMatrixError as error:
            if not self.name:
                raise
            raise type(error)(f"body {self.name!r}: {error}") from error

    def condensed_elsewhere(self) -> tuple[SteklovPoincare, CondensedMap]:
        """Return the same in a process that does nothing else; as there, small matrices take one thread."""
        with blas_threads_for(2 * len(self.conditions.is_fixed)):
            return self.condensed()


def condensed_shapes(
    prepared: Prepared, executor: Executor | None = None
) -> list[tuple[SteklovPoincare, CondensedMap]]:
    """Return the map without forces inside and the condensed body of each group of copies, in their order.

    Raises
    ------
    SingularMatrixError, NotSentError
        See `bemkit.model.model.build_model`.
    """
    firsts = [prepared.bodies[int(group[0])] for group in groups(prepared.bodies)]
    shapes = [Shape(body.name, prepared.elastic_map(body), body.inside, body.conditions, body.force) for body in firsts]
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
