"""Checks of scenes made in Python: objects where scene files have words, tuples where they have lists."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from bemkit.errors import InputError, called
from bemkit.geometry.outline import Outline
from bemkit.geometry.shapes import Shape

_EXAMPLES: Mapping[str, str] = MappingProxyType(
    {
        "shape": "Rectangle(width=1.0, height=1.0)",
        "material": "Material(youngs_modulus=1e4, poisson_ratio=0.2)",
        "law": "Coulomb(friction_coefficient=0.5)",
        "solver": "Fallbacks()",
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
_SEVERAL = ("parts", "steps", "load_factors", "body_forces", "bodies", "rigid", "contacts", "sides")


def outline_of(shape: Shape) -> Outline:
    """Return the outline of a shape; InputError if its method takes arguments or returns no outline."""
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
    for attribute, example in _EXAMPLES.items():
        value = getattr(owner, attribute, None)
        if isinstance(value, str | int | float | type | Mapping):
            shown = f"the class {value.__name__}" if isinstance(value, type) else repr(value)
            raise InputError(f"{begin}{attribute} is {shown}: give an object, such as {example}")
    obstacle = getattr(owner, "obstacle", None)
    if obstacle is not None and not callable(getattr(obstacle, "gap", None)):
        raise InputError(
            f"{begin}obstacle is {obstacle!r}, which has no method gap(points, normals): give one as "
            "bemkit.contact.obstacle.Obstacle describes it"
        )
    shape = getattr(owner, "shape", None)
    if shape is not None and not callable(getattr(shape, "outline", None)):
        raise InputError(
            f"{begin}shape is {shape!r}, which has no method outline(): give one as bemkit.geometry.shapes.Shape "
            "describes it"
        )
    for attribute in _SEVERAL:
        value = getattr(owner, attribute, ())
        if isinstance(value, str) or not isinstance(value, Iterable):
            raise InputError(f"{begin}{attribute} is {value!r}: give a tuple, such as ({value!r},)")
