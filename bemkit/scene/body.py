"""One of several elastic bodies: its position, its loads, and the symmetry lines that cross it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.formulas import choices
from bemkit.geometry.placement import Placement
from bemkit.geometry.shapes import Shape
from bemkit.operators.material import Material
from bemkit.scene.conditions import Clamped, Contact, Free, Part, PrescribedDisplacement, Roller
from bemkit.scene.discretisation import Discretisation, MeshOptions
from bemkit.scene.objects import check_names, check_objects, outline_of

if TYPE_CHECKING:
    from bemkit.geometry.symmetry.lines import Symmetry
    from bemkit.scene.body_forces import BodyForce
    from bemkit.scene.copies import Copies
    from bemkit.scene.plane_motion import FarField

_ALONG = np.linspace(0.0, 1.0, 33)
"""Parameters of curves at which the extent of a body is measured."""
_NAME = "the body name {name!r} does not do: give printable text without a dot"
_ALL_SIDES = "*"
_ON_LINE = 1e-9
"""Distance by which a body that ends on a symmetry line may cross it by round-off, relative to its size."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """An elastic body of a `Scene`.

    Parameters
    ----------
    name : str
        Without a dot: contacts name sides as ``"body.side"``.
    shape : Shape
        In coordinates of its own.
    material : Material
    parts : tuple of Part
        Supports, loads and rigid obstacles. `Part.where` is in the coordinates of the shape; loads, given displacements
        and obstacles are in those of the scene, where the body is placed.
    body_forces : tuple of BodyForce
        Forces and heat inside the body, in the coordinates of the scene.
    far : FarField, optional
        Motion or load of a half-plane far away from its surface, in the coordinates of the scene. By default it is at
        rest there.
    placement : Placement
        Position of the body: turned, then shifted.
    copies : Copies, optional
        Makes copies of the body, each named ``"name-..."``; copies without supports share one factorisation.
    discretisation : Discretisation, optional
        By default that of the scene.
    mesh : MeshOptions, optional
        A number of elements for this body; by default that of the scene.

    Raises
    ------
    InputError
        If the name has a dot, two parts share a name, or the mesh options ask for an accuracy.
    """

    name: str
    shape: Shape
    material: Material
    parts: tuple[Part, ...] = ()
    body_forces: tuple[BodyForce, ...] = ()
    far: FarField | None = None
    placement: Placement = field(default_factory=Placement)
    copies: Copies | None = None
    discretisation: Discretisation | None = None
    mesh: MeshOptions | None = None

    def __post_init__(self) -> None:
        if not self.name.isprintable() or "." in self.name:
            raise InputError(_NAME.format(name=self.name))
        check_objects(self, f"body {self.name!r}")
        check_names(f"body {self.name!r}", (part.name for part in self.parts), "parts")
        if self.mesh is not None and self.mesh.accuracy is not None:
            raise InputError(f"body {self.name!r}: an accuracy is that of all bodies: give it to the scene")

    def check_name(self) -> None:
        """Raise InputError unless contacts can name the body; the only body of a scene needs no name."""
        if not self.name:
            raise InputError(_NAME.format(name=self.name))

    @property
    def is_held(self) -> bool:
        """Whether a support, a rigid obstacle or a far field belongs to the body, so that it is no copy of another."""
        return self.far is not None or any(
            isinstance(part.condition, Clamped | Roller | PrescribedDisplacement | Contact) for part in self.parts
        )

    def copied(self) -> Iterator[Body]:
        """Yield each copy of the body, with a name and a placement of its own; the body itself without copies."""
        if self.copies is None:
            yield self
            return
        for suffix, place in self.copies.placements().items():
            yield replace(self, name=f"{self.name}-{suffix}", placement=place.after(self.placement), copies=None)

    def contact_part(self, name: str) -> Part:
        """Return the part that a contact names: a part, sides of the shape with commas between them, or ``*``, all.

        Raises
        ------
        InputError
            If there is none of that name, or it has a support, a load or an obstacle.
        """
        for part in self.parts:
            if part.name == name:
                if not isinstance(part.condition, Free):
                    kind = type(part.condition).__name__
                    raise InputError(f"part {self.name}.{name} is {kind}: a part in contact with a body must be free")
                return part
        known = [*(part.name for part in self.parts), *(sides := outline_of(self.shape).selectable_names)]
        named = () if name == _ALL_SIDES else tuple(side.strip() for side in name.split(","))
        for side in named:
            if side not in sides:
                raise InputError(f"body {self.name!r} has no part or side {side!r}: there are {choices(side, known)}")
        return Part(name, Free(), sides=named)


def lines_across(body: Body, symmetry: Symmetry | None) -> Symmetry | None:
    """Return the symmetry lines that cross a placed body; None if none does."""
    if symmetry is None:
        return None
    low, high = _extent(body)
    margin = _ON_LINE * float((high - low).max())
    places = zip((symmetry.x, symmetry.y), (low + margin).tolist(), (high - margin).tolist(), strict=True)
    x, y = (place if place is not None and below < place < above else None for place, below, above in places)
    if x is None and y is None:
        return None
    return replace(symmetry, x=x, y=y)


def check_accuracy(mesh: MeshOptions, bodies: Sequence[Body]) -> None:
    """Raise InputError if a scene has both an accuracy and a body with its own degree or mesh."""
    for body in bodies if mesh.accuracy is not None else ():
        if mesh.rising_degrees and body.discretisation is not None:
            raise InputError(
                f"body {body.name!r} has a fixed degree, the scene rising degrees: degrees rise for all bodies "
                "or for none: give only the scene a discretisation"
            )
        if body.mesh is not None:
            raise InputError(
                f"mesh.accuracy is {mesh.accuracy}, and body {body.name!r} has mesh options of its own: give one of "
                "them"
            )


def check_place(body: Body, symmetry: Symmetry) -> None:
    """Check that a body lies on the listed side of symmetry lines, and has no placement if a line crosses it.

    Raises
    ------
    InputError
    """
    crossing = lines_across(body, symmetry)
    if crossing is not None and body.placement != Placement():
        raise InputError(f"body {body.name!r} has a placement, and {crossing} halves it: draw it in its place")
    middle = _extent(body).mean(axis=0)
    others = (line for line in symmetry.lines if crossing is None or line not in crossing.lines)
    if any(line.is_beyond(middle) for line in others):
        raise InputError(
            f"body {body.name!r} lies beyond the symmetry line {symmetry}: its image represents it, remove it"
        )


def _extent(body: Body) -> FloatArray:
    """Return the smallest and the largest coordinates, (2, 2) [m], of a placed body."""
    curves = [side.curve for loop in body.shape.outline().loops for side in loop]
    points = body.placement.forward(np.concatenate([curve.point(_ALONG) for curve in curves]))
    return np.array([points.min(axis=0), points.max(axis=0)])
