"""Steps of a load history, and the facts that a scene and an assembly share."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeAlias

import numpy as np

from bemkit.contact.laws import FrictionLaw
from bemkit.errors import InputError
from bemkit.notebook import ShownInNotebooks
from bemkit.scene.objects import check_objects

if TYPE_CHECKING:
    from bemkit.geometry.symmetry import Symmetry
    from bemkit.operators.linear.solvers import LinearSolverChoice
    from bemkit.scene.discretisation import Discretisation
    from bemkit.scene.mesh_options import MeshOptions
    from bemkit.scene.plane_motion import RigidBody
    from bemkit.scene.unit_names import UnitNames
    from bemkit.solvers.base import ContactSolver

TimeValue: TypeAlias = float | str | Callable[[float], float]
"""A number, a formula in the time t, or a Python function of it."""


@dataclass(frozen=True)
class Step:
    """One step of a load history: what changes in it. All else stays as it was at the end of the step before.

    Parameters
    ----------
    time : float [s]
        At the end of the step; positive, and later than the step before. The history begins at 0.
    changes : mapping of str to value
        New values by their keys in scene files, such as ``"parts.press.condition.y"``, ``"law.friction_coefficient"``
        or ``"rigid.punch.y"``: a number, a text, a table or an object as the key takes it, or a Python function of the
        time that returns one. Numbers hold from the first increment of the step on; formulas of the time ``t`` are
        evaluated at each increment, and keep their last value after the step.
    load_factor : float, str, callable or None
        Multiplies all loads, prescribed displacements and body forces that are not constant.
    increments : int
        Number of equal parts of the time of the step, each a step of the result.

    Raises
    ------
    InputError
        If the time is not positive and finite, or there is no increment.
    """

    time: float
    changes: Mapping[str, Any] = field(default_factory=dict)
    load_factor: TimeValue | None = None
    increments: int = 1

    def __post_init__(self) -> None:
        if not (math.isfinite(self.time) and self.time > 0.0):
            raise InputError(f"time is {self.time}: give the time at the end of the step, a positive number")
        if self.increments < 1:
            raise InputError(f"increments is {self.increments}: give 1 or more")
        object.__setattr__(self, "changes", MappingProxyType(dict(self.changes)))

    def __reduce__(self) -> tuple[type[Step], tuple[object, ...]]:
        """Pickle with a plain dict: a read-only mapping cannot be pickled."""
        return Step, (self.time, dict(self.changes), self.load_factor, self.increments)

    @property
    def is_plain(self) -> bool:
        """Whether it has a time and nothing else, as the steps of results do."""
        return not self.changes and self.load_factor is None and self.increments == 1


class Stated(ShownInNotebooks):
    """Base of `Scene` and `Assembly`: title, load factors and steps, with their checks."""

    title: str
    load_factors: tuple[float, ...]
    steps: tuple[Step, ...]

    if TYPE_CHECKING:  # of both
        __dataclass_fields__: ClassVar[dict[str, Any]]
        law: FrictionLaw
        discretisation: Discretisation
        linear_solver: LinearSolverChoice
        symmetry: Symmetry | None
        mesh: MeshOptions
        solver: ContactSolver
        units: UnitNames | None

        @property
        def placed_bodies(self) -> tuple[Any, ...]:
            """The elastic bodies, every copy a body of its own."""

        def scene_of(self, body: Any) -> Any:
            """Return the scene of one placed body, in which sides in contact with other bodies are free parts."""

        def with_contacts(self, contacts: tuple[Any, ...]) -> Self:
            """Return the scene with all its contacts listed."""

    @property
    def contacts(self) -> tuple[Any, ...]:
        """The contacts of bodies with each other and with rigid bodies."""
        return ()

    @property
    def touching(self) -> Any:
        """How further contacts are found."""
        return None

    @property
    def rigid(self) -> tuple[RigidBody, ...]:
        """Obstacles that move."""
        return ()

    @property
    def elastic_contacts(self) -> tuple[Any, ...]:
        """The contacts that no rigid body takes part in."""
        return ()

    def listed_parts(self, body: str) -> tuple[str, ...]:
        """Return the parts and sides of a placed body that contacts name."""
        return ()

    def touching_parts(self, body: Any) -> tuple[str, ...]:
        """Return the names of the parts and sides of a placed body that may touch other bodies."""
        return ()

    def __post_init__(self) -> None:
        check_objects(self)
        object.__setattr__(self, "load_factors", tuple(self.load_factors))
        object.__setattr__(self, "steps", tuple(self.steps))
        if not self.title or not self.title.isprintable():
            raise InputError(f"title is {self.title!r}: give one line of printable text")
        if not (self.load_factors and np.all(np.isfinite(self.load_factors))):
            raise InputError(f"load_factors is {self.load_factors}: give finite numbers such as (0.5, 1.0)")
        if self.steps and self.load_factors != (1.0,):
            raise InputError(
                f"load_factors is {self.load_factors} besides {len(self.steps)} steps: give each step its load_factor"
            )
        for number, (before, step) in enumerate(pairwise(self.steps), start=1):
            if step.time <= before.time:
                raise InputError(
                    f"steps[{number}]: time is {step.time:g} after {before.time:g}: give times that increase"
                )

    @property
    def n_steps(self) -> int:
        """Number of load steps, increments counted."""
        return sum(step.increments for step in self.steps) if self.steps else len(self.load_factors)


def check_stated(scene: object) -> None:
    """Refuse what is neither a scene nor an assembly, such as the name of one.

    Raises
    ------
    InputError
        Naming the value and what reads a scene.
    """
    if not isinstance(scene, Stated):
        remedy = f"load_scene({scene!r}) reads one" if isinstance(scene, str) else "load_scene(path) reads one"
        raise InputError(f"scene is {scene!r}: give a Scene or an Assembly; {remedy}")


def check_names(owner: str, names: Iterable[str], kind: str) -> None:
    """Raise InputError if two parts or bodies have one name."""
    for name, count in Counter(names).items():
        if count > 1:
            raise InputError(f"{owner}: {name!r} is the name of two {kind}: give each its own name")


def check_laws(laws: Mapping[str, FrictionLaw], steps: Sequence[Step]) -> None:
    """Check that laws that depend on slip or time have a load history.

    Raises
    ------
    InputError
        Naming the place and the law.
    """
    for place, law in laws.items():
        if law.needs_history and not steps:
            raise InputError(
                f"{place} is {type(law).__name__}, which depends on slip or time: give [[steps]] with their times"
            )
