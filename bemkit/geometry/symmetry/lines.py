"""Mirror lines of a body, of which only one side is divided into elements; the rest are their images.

A line x = a takes the point (x, y) to (2 a - x, y) and a displacement (u_x, u_y) to (-u_x, u_y), a line y = b
likewise; two lines together turn the body by half a turn. A single reflection also turns the direction of traversal,
so that image elements run from the image of the end to the image of the start.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.errors import GeometryError
from bemkit.geometry.curves import Curve, TransformedCurve, scaled_curve
from bemkit.geometry.pieces import RESOLUTION, Elements

_ON_LINE = 64 * RESOLUTION
"""Nodes closer to a line than this, times the size of coordinates, lie on it: trigonometry loses a few digits."""


@dataclass(frozen=True)
class Symmetry:
    """One or two lines about which a body and everything that acts on it are symmetric.

    Parameters
    ----------
    x : float, optional [m]
        The vertical line x = a.
    y : float, optional [m]
        The horizontal line y = b.

    Raises
    ------
    GeometryError
        If neither is given or one is not a finite number.
    """

    x: float | None = None
    y: float | None = None

    def __post_init__(self) -> None:
        if self.x is None and self.y is None:
            raise GeometryError(
                "Symmetry: neither x nor y is given: give the position of at least one line, such as x=0.5"
            )
        for name, value in (("x", self.x), ("y", self.y)):
            if value is not None and not math.isfinite(value):
                raise GeometryError(f"Symmetry: {name} is {value}: give a finite number")

    def __str__(self) -> str:
        return " and ".join(
            f"{name} = {value:.15g}" for name, value in (("x", self.x), ("y", self.y)) if value is not None
        )

    @property
    def _places(self) -> FloatArray:
        """(2,) array: where the lines are, NaN without a line."""
        return np.array([np.nan if value is None else value for value in (self.x, self.y)])

    @property
    def images(self) -> FloatArray:
        """(n_images, 2) array: the signs of the x and y components of vectors in each image, the body itself first."""
        signs = [(1.0,) if place is None else (1.0, -1.0) for place in (self.x, self.y)]
        return np.array([(x, y) for y, x in itertools.product(signs[1], signs[0])])

    @property
    def n_images(self) -> int:
        """Number of images, the body itself included: 2 or 4."""
        return len(self.images)

    @property
    def rigid_motions(self) -> tuple[int, ...]:
        """Which of the translations along x and y and the rotation (0, 1, 2) are symmetric: only those along a line."""
        along = {0: self.x is None, 1: self.y is None}
        return tuple(component for component, is_along in along.items() if is_along)

    def reflected(self, points: FloatArray, image: FloatArray) -> FloatArray:
        """Return the images of points (..., 2) [m]; `image` is a row of `images`."""
        return np.where(image < 0.0, 2.0 * self._places - points, points)

    def _reflected_curve(self, curve: Curve, image: FloatArray) -> TransformedCurve:
        x, y = np.where(image < 0.0, 2.0 * self._places, 0.0).tolist()
        return scaled_curve(curve, (x, y), (float(image[0]), float(image[1])), is_reversed=is_reversing(image))

    def meets(self, nodes: FloatArray) -> BoolArray:
        """Return (n, 2) bool: which nodes (n, 2) lie on the lines x = a and y = b.

        The nodes are all of a body: the round-off of its largest coordinate counts, wherever a node is.
        """
        with np.errstate(invalid="ignore"):
            on_line = np.abs(nodes - self._places) <= _ON_LINE * np.abs(nodes).max()
        return np.asarray(on_line)

    @property
    def lines(self) -> tuple["Symmetry", ...]:
        """The lines one by one, each as a `Symmetry`."""
        x, y = self.x, self.y
        return (*([] if x is None else [Symmetry(x=x)]), *([] if y is None else [Symmetry(y=y)]))

    def is_beyond_at(self, x: FloatArray, y: FloatArray) -> BoolArray:
        """As `is_beyond`, for coordinates (n,)."""
        return self.is_beyond(np.stack([x, y], axis=-1))

    def is_beyond(self, points: FloatArray) -> BoolArray:
        """Return (n,) bool: which points (n, 2) lie on the side of images, x > a or y > b."""
        with np.errstate(invalid="ignore"):
            beyond = (points > self._places).any(axis=-1)
        return np.asarray(beyond)

    def snapped(self, nodes: FloatArray) -> FloatArray:
        """Return all nodes (n, 2) of a body, those on a line moved there to the last digit."""
        return np.where(self.meets(nodes), self._places, nodes)

    def transformed(self, shift: tuple[float, float], factor: float) -> "Symmetry":
        """Return the lines of the body (x - shift) * factor."""
        moved = [
            None if place is None else (place - s) * factor for place, s in zip((self.x, self.y), shift, strict=True)
        ]
        return Symmetry(*moved)

    def check_half(self, nodes: FloatArray, elements: IntArray, is_exterior: bool) -> None:
        """Raise if an element lies on a line, or the body is an exterior."""
        if is_exterior:
            raise GeometryError(f"BoundaryMesh: symmetry ({self}) of an exterior is not supported: remove it")
        start, end = self.meets(nodes)[elements].transpose(1, 0, 2)
        for element in np.flatnonzero((start & end).any(axis=1)):
            raise GeometryError(
                f"BoundaryMesh: element {element} lies on the symmetry line ({self}), inside of the whole body: "
                "remove it, or remove the symmetry and give the line a roller"
            )

    def unfold(self, half: Elements) -> Elements:
        """Return the elements of the whole body.

        Parameters
        ----------
        half : Elements
            Of one side of the lines; nodes on a line lie there to the last digit.

        Returns
        -------
        Elements
            Image by image: the element e of the image g has the number g * n_elements + e, and the first nodes are
            those of `half`. A part holds all images of its elements.
        """
        images = self.images
        n_elements, n_curves = len(half.elements), len(half.curves)
        points = np.concatenate([self.reflected(half.nodes, image) for image in images])
        # nodes on a line are their own images, to the last digit; others come in the order of images
        _, first, place = np.unique(points, axis=0, return_index=True, return_inverse=True)
        number = np.argsort(np.argsort(first))[place].reshape(len(images), -1)
        nodes = points[np.sort(first)]
        elements = [
            nodes_of_image[half.elements][:, :: -1 if is_reversing(image) else 1]
            for nodes_of_image, image in zip(number, images, strict=True)
        ]
        parts = {
            name: np.concatenate([members + g * n_elements for g in range(len(images))])
            for name, members in half.parts.items()
            if len(members)
        }
        curve, span = half.element_curve, half.element_span
        if curve is None or span is None:
            return Elements(nodes, np.concatenate(elements), parts, (), None, None)
        curves = [self._reflected_curve(curve, image) for image in images[1:] for curve in half.curves]
        spans = [1.0 - span[:, ::-1] if is_reversing(image) else span for image in images]
        indices = [np.where(curve < 0, -1, curve + g * n_curves) for g in range(len(images))]
        return Elements(
            nodes,
            np.concatenate(elements),
            parts,
            (*half.curves, *curves),
            np.concatenate(indices),
            np.concatenate(spans),
        )


def is_reversing(image: FloatArray) -> bool:
    """Return whether an image is traversed from the images of ends to the images of starts."""
    return bool(np.prod(image) < 0.0)
