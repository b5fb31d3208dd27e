"""Checks that scenes and their bodies share: types of objects made in Python, names, laws, load steps."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from bemkit.errors import InputError, called
from bemkit.geometry.outline import Outline
from bemkit.geometry.shapes import Shape

if TYPE_CHECKING:
    from bemkit.contact.laws import FrictionLaw
    from bemkit.scene.steps import Step

_EXAMPLES: Mapping[str, str] = MappingProxyType(
    {
        "shape": "Rectangle(width=1.0, height=1.0)",
        "material": "Material(youngs_modulus=1e4, poisson_ratio=0.2)",
        "law": "Coulomb(friction_coefficient=0.5)",
        "solver": "Fallbacks((SemismoothNewton(), SolutionPath()))",
        "discretisation": "Galerkin(2)",
        "linear_solver": "Automatic()",
        "mesh": "MeshOptions(elements=320)",
        "symmetry": "Symmetry(x=0.5)",
        "far": "FarField(force_y=1.0)",
        "touching": "Touching(within=0.01)",
        "units": "UnitNames(length='mm', stress='MPa')",
        "condition": "Clamped()",
        "obstacle": "RigidHalfPlane()",
    }
)
_OF_OBJECTS: Mapping[str, str] = MappingProxyType(
    {
        "parts": "Part('wall', Clamped(), sides=('left',))",
        "steps": "Step(1.0)",
        "body_forces": "Gravity(7800.0)",
        "bodies": "Body(name='punch', ...)",
        "rigid": "RigidBody(name='punch', ...)",
        "contacts": "ContactPair(('punch.bottom', 'plate.top'))",
    }
)
_NO_OBJECTS = (str, int, float, type, Mapping, list, tuple)
_SEVERAL = ("parts", "steps", "load_factors", "body_forces", "bodies", "rigid", "contacts", "sides")


def outline_of(shape: Shape) -> Outline:
    """Return the outline of a shape; InputError if it has no such method, or one that returns anything else."""
    if not callable(getattr(shape, "outline", None)):
        raise InputError(
            f"shape is {shape!r}, which has no method outline(): give one as bemkit.geometry.shapes.Shape describes it"
        )
    outline: object = called(shape, "outline", (), "outline(self), which returns a bemkit.geometry.outline.Outline")
    if not isinstance(outline, Outline):
        raise InputError(
            f"{type(shape).__name__}.outline returned a {type(outline).__name__}: "
            "return a bemkit.geometry.outline.Outline"
        )
    return outline


def check_objects(owner: Any, name: str = "") -> None:
    """Refuse texts, numbers and classes where a scene takes an object, and single values where it takes several.

    An unknown condition would leave the boundary free.

    Parameters
    ----------
    owner : object
        Its attributes are checked by their names; None means not given.
    name : str
        Of the owner, to begin messages with.

    Raises
    ------
    InputError
        Naming the attribute, its value and an example.
    """
    begin = f"{name}: " if name else ""
    for attribute in _SEVERAL:
        value = getattr(owner, attribute, ())
        if isinstance(value, str) or not isinstance(value, Iterable):
            raise InputError(f"{begin}{attribute} is {value!r}: give a tuple, such as ({value!r},)")
        if isinstance(value, list):  # equal to the same scene from a file
            object.__setattr__(owner, attribute, tuple(value))
        if attribute in _OF_OBJECTS and (wrong := [item for item in value if isinstance(item, _NO_OBJECTS)]):
            raise InputError(
                f"{begin}{attribute} contains {wrong[0]!r}: give objects, such as {_OF_OBJECTS[attribute]}"
            )
    for attribute, example in _EXAMPLES.items():
        value = getattr(owner, attribute, None)
        if isinstance(value, _NO_OBJECTS):
            shown = f"the class {value.__name__}" if isinstance(value, type) else repr(value)
            raise InputError(f"{begin}{attribute} is {shown}: give an object, such as {example}")
    obstacle = getattr(owner, "obstacle", None)
    if obstacle is not None and not callable(getattr(obstacle, "gap", None)):
        raise InputError(
            f"{begin}obstacle is {obstacle!r}, which has no method gap(points, normals): give one as "
            "bemkit.contact.obstacle.Obstacle describes it"
        )


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


def check_steps(load_factors: Sequence[float], steps: Sequence[Step]) -> None:
    """Raise InputError unless load factors are finite, times increase, and only one of both describes the history."""
    if not (load_factors and all(map(math.isfinite, load_factors))):
        raise InputError(f"load_factors is {load_factors}: give finite numbers such as (0.5, 1.0)")
    if steps and load_factors != (1.0,):
        raise InputError(f"load_factors is {load_factors} besides {len(steps)} steps: give each step its load_factor")
    for number, (before, step) in enumerate(pairwise(steps), start=1):
        if step.time <= before.time:
            raise InputError(f"steps[{number}]: time is {step.time:g} after {before.time:g}: give times that increase")
