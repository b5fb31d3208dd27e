"""Errors of the geometry: a boundary that bounds no body, or an unknown name."""

from bemkit.arrays import FloatArray
from bemkit.errors import InputError


class GeometryError(InputError):
    """A curve, shape, selection or mesh that cannot be the boundary of a body."""


class UnknownPartError(GeometryError):
    """A boundary part was asked for by a name the mesh does not know."""


def format_point(point: FloatArray) -> str:
    """Write a point for a message, with digits enough to find it in a file."""
    return f"({point[0]:.9g}, {point[1]:.9g})"
