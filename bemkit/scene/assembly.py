"""Scenes of several elastic bodies: positions, contacts between bodies, and options of the solve."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bemkit.contact.laws import FrictionLaw, Frictionless
from bemkit.errors import InputError
from bemkit.formulas import choices, closest
from bemkit.geometry.symmetry import Symmetry
from bemkit.operators.linear.solvers import Automatic, LinearSolverChoice
from bemkit.scene.body import Body, check_place, lines_across
from bemkit.scene.conditions import Contact, Force, Free, Part
from bemkit.scene.discretisation import Discretisation, Galerkin
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.objects import check_objects
from bemkit.scene.plane_motion import RigidBody
from bemkit.scene.scene import Scene
from bemkit.scene.steps import Stated, Step, check_laws, check_names
from bemkit.scene.unit_names import UnitNames
from bemkit.solvers.base import ContactSolver
from bemkit.solvers.fallbacks import Fallbacks


def body_and_part(side: str) -> tuple[str, str]:
    """Return the names of body and part in the name of a side, ``"body.part"``."""
    body, part = side.split(".", 1)
    return body, part


@dataclass(frozen=True)
class ContactPair:
    """Two sides of bodies that may touch.

    Parameters
    ----------
    sides : (str, str)
        Each ``"body.part"``, ``"body.side"`` by the name of a side or group of its shape, ``"body.side, side"``, or
        ``"body.*"`` for its whole boundary; one of them may be the name of a `RigidBody`. Two sides of one body may
        touch, too, as in a split ring.
    law : FrictionLaw, optional
        By default that of the assembly.
    gap : float [m]
        Added to the distance of the shapes; negative presses bodies together that are drawn touching.
    interference : float [m]
        Largest overlap of the shapes as they are drawn that is meant; more is an error.
    multipliers_on : str, optional
        The side on whose nodes contact is decided; by default see `bemkit.contact.mortar`. Never a rigid body.
    reach : float [m], optional
        Largest distance of points that may come to touch; by default half the size of the smaller body. Round bodies
        with many neighbours need less, so that no point faces two of them.

    Raises
    ------
    InputError
        If neither name has a dot, a side shall touch itself, a length is not finite, the reach is not positive, or the
        multipliers are on neither side.
    """

    sides: tuple[str, str]
    law: FrictionLaw | None = None
    gap: float = 0.0
    interference: float = 0.0
    multipliers_on: str | None = None
    reach: float | None = None

    def __post_init__(self) -> None:
        check_objects(self, "contact")
        object.__setattr__(self, "sides", tuple(self.sides))
        if len(self.sides) != 2 or not self.elastic_sides:
            raise InputError(
                f"contact sides are {self.sides}: give two, each as 'body.side', or one as the name of a rigid body"
            )
        if self.sides[0] == self.sides[1]:
            raise InputError(f"the contact of {self.sides[0]!r} is with itself: give two sides")
        if not np.isfinite(self.gap):
            raise InputError(f"contact {self.name!r}: gap is {self.gap}: give a finite length")
        if not 0.0 <= self.interference < np.inf:
            raise InputError(f"contact {self.name!r}: interference is {self.interference}: give a length, not negative")
        _check_reach(self.reach, f"contact {self.name!r}: reach")
        if self.multipliers_on is not None and self.multipliers_on not in self.elastic_sides:
            raise InputError(
                f"contact {self.name!r}: multipliers_on is {self.multipliers_on!r}: give one of the two sides, "
                "and not a rigid body"
            )

    @property
    def name(self) -> str:
        """Name of the contact in results."""
        return " / ".join(self.sides)

    @property
    def elastic_sides(self) -> tuple[str, ...]:
        """The sides of elastic bodies: two, or the one that faces a rigid body."""
        return tuple(side for side in self.sides if "." in side)

    @property
    def elastic_parts(self) -> tuple[tuple[str, str], ...]:
        """The elastic sides as pairs (body, part or side)."""
        return tuple(body_and_part(side) for side in self.elastic_sides)

    @property
    def rigid_body(self) -> str | None:
        """The name of the rigid body, None between elastic ones."""
        return next((side for side in self.sides if "." not in side), None)


@dataclass(frozen=True)
class Touching:
    """Puts every two free sides of different bodies that face each other in contact.

    Parameters
    ----------
    within : float [m]
        Largest distance of sides that face each other.
    law : FrictionLaw, optional
        By default that of the assembly.
    reach : float [m], optional
        Of each contact found; see `ContactPair`.

    Raises
    ------
    InputError
        If the distance is negative or not finite, or the reach not positive.
    """

    within: float
    law: FrictionLaw | None = None
    reach: float | None = None

    def __post_init__(self) -> None:
        check_objects(self, "touching")
        _check_reach(self.reach, "touching.reach")
        if not 0.0 <= self.within < np.inf:
            raise InputError(f"touching.within is {self.within}: give a length, zero or positive")


def _check_reach(reach: float | None, name: str) -> None:
    if reach is not None and not reach > 0.0:
        raise InputError(f"{name} is {reach}: give a positive length")


@dataclass(frozen=True, kw_only=True)
class Assembly(Stated):
    """Several elastic bodies with their contacts, supports and loads: everything that determines the solution.

    Parameters
    ----------
    title : str
    bodies : tuple of Body
    rigid : tuple of RigidBody
        Obstacles that move; each takes part in a contact.
    contacts : tuple of ContactPair
    touching : Touching, optional
        Finds contacts where bodies face each other, besides those that are listed.
    law : FrictionLaw
        In all contacts that have no law of their own, with bodies and with rigid obstacles.
    load_factors : tuple of float
        A short form of load history: all loads, given displacements and body forces that are not constant times these
        numbers, at the times 1, 2, 3 and so on. Gaps and obstacles stay as they are.
    steps : tuple of Step
        The load history: what changes from step to step; slip counts from the end of the step before.
    discretisation : Discretisation
        Of all bodies that have none of their own.
    linear_solver : LinearSolver or Automatic
    symmetry : Symmetry, optional
        Lines about which everything is symmetric. Bodies that they cross are halved, and must be drawn in their places;
        of those beside them only the ones on the side of smaller x, or y, are listed: images replace the others.
        A body that touches its own image at a line needs an obstacle there.
    mesh : MeshOptions
        Of each body that has none of its own; `elements` are those of one body. An accuracy is that of all bodies.
    solver : ContactSolver
    units : UnitNames, optional
        Names of the units that everything is stated in; they label results.
    description, reference : str
        For the reader.

    Raises
    ------
    InputError
        If the title is empty, there is no body, two bodies share a name, a contact names what does not exist or is
        listed twice, a rigid body takes part in no contact, a load factor is missing or not finite, times do not
        increase, a law needs slip or time without steps, or an accuracy is asked of collocation or goes with elements
        of a body.
    """

    title: str
    bodies: tuple[Body, ...]
    rigid: tuple[RigidBody, ...] = ()
    contacts: tuple[ContactPair, ...] = ()
    touching: Touching | None = None
    law: FrictionLaw = field(default_factory=Frictionless)
    load_factors: tuple[float, ...] = (1.0,)
    steps: tuple[Step, ...] = ()
    discretisation: Discretisation = field(default_factory=lambda: Galerkin(1))
    linear_solver: LinearSolverChoice = field(default_factory=Automatic)
    symmetry: Symmetry | None = None
    mesh: MeshOptions = field(default_factory=MeshOptions)
    solver: ContactSolver = field(default_factory=Fallbacks)
    units: UnitNames | None = None
    description: str = ""
    reference: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.bodies:
            raise InputError("bodies is empty: give at least one body")
        for body in self.bodies:
            body.check_name()
        names = [*(body.name for body in self.placed_bodies), *(body.name for body in self.rigid)]
        check_names("bodies", names, "bodies")
        laws = {f"law of contact {pair.name!r}": self.law_of(pair) for pair in self.contacts}
        check_laws({"law": self.law, **laws}, self.steps)
        pairs = Counter(frozenset(pair.sides) for pair in self.contacts)
        for pair in self.contacts:
            if pairs[frozenset(pair.sides)] > 1:
                raise InputError(f"contact {pair.name!r} is listed twice: remove one")
            for side in pair.elastic_sides:
                self._check_side(side)
        self._check_rigid()
        if self.symmetry is not None:
            if self.rigid:
                raise InputError("symmetry goes only with elastic bodies: remove it, or the rigid bodies")
            for body in self.placed_bodies:
                check_place(body, self.symmetry)
        if self.mesh.accuracy is not None:
            self._check_accuracy(self.mesh.accuracy)
        for body in self.placed_bodies:
            scene = self.scene_of(body)  # parts and sides are checked
            if isinstance(scene.discretisation, Galerkin) and isinstance(scene.discretisation.degree, tuple):
                raise InputError(
                    f"degree is a list, of body {body.name!r}: elements have several degrees in scenes of one body "
                    "only; give one degree"
                )

    def _check_accuracy(self, accuracy: float) -> None:
        for body in self.bodies:
            discretisation = self.discretisation if body.discretisation is None else body.discretisation
            if self.mesh.rising_degrees and body.discretisation is not None:
                raise InputError(
                    f"body {body.name!r} has a fixed degree, the assembly rising degrees: degrees rise for all bodies "
                    "or for none: give only the assembly a discretisation"
                )
            if not discretisation.estimates_error:
                raise InputError(
                    f"mesh.accuracy is {accuracy}: {discretisation.method}, of body {body.name!r}, has no error "
                    "estimate: choose the discretisation 'quadratic' or 'linear', or give elements"
                )
            if body.mesh is not None:
                raise InputError(
                    f"mesh.accuracy is {accuracy}, and body {body.name!r} has mesh options of its own: give one of them"
                )

    def _check_rigid(self) -> None:
        known = [body.name for body in self.rigid]
        named = [pair.rigid_body for pair in self.contacts if pair.rigid_body is not None]
        for name in named:
            if name not in known:
                listed = f"the rigid bodies are {', '.join(known)}" if known else "there is no rigid body"
                raise InputError(
                    f"a contact names {name!r}: {listed}{closest(name, known)}; write a side of an elastic body as "
                    "'body.side'"
                )
        for name in known:
            if name not in named:
                raise InputError(f"rigid body {name!r} touches nothing: list a contact with it, or remove it")

    def _check_side(self, side: str) -> None:
        body, part = body_and_part(side)
        if body not in self._by_name:
            raise InputError(f"a contact names {side!r}: the bodies are {choices(body, list(self._by_name))}")
        placed = self._by_name[body]
        sides = self._side_names(placed)
        if any(part == stated.name for stated in placed.parts) or not any(part in names for names in sides):
            _ = placed.contact_part(part)

    def _side_names(self, body: Body) -> tuple[tuple[str, str], ...]:
        """Return the name and the group of each side of a body; copies share them, since making an outline is slow."""
        if id(body.shape) not in self._sides:
            self._sides[id(body.shape)] = tuple(
                (side.name, side.group or side.name) for side in body.shape.outline().sides
            )
        return self._sides[id(body.shape)]

    @cached_property
    def _sides(self) -> dict[int, tuple[tuple[str, str], ...]]:
        """The names and groups of the sides of shapes."""
        return {}

    @property
    def elastic_contacts(self) -> tuple[ContactPair, ...]:
        """The contacts that no rigid body takes part in."""
        return tuple(pair for pair in self.contacts if pair.rigid_body is None)

    @cached_property
    def placed_bodies(self) -> tuple[Body, ...]:
        """The bodies, every copy a body of its own."""
        return tuple(placed for body in self.bodies for placed in body.copied())

    @cached_property
    def _by_name(self) -> Mapping[str, Body]:
        return {body.name: body for body in self.placed_bodies}

    @cached_property
    def _listed_parts(self) -> Mapping[str, tuple[str, ...]]:
        named: dict[str, list[str]] = {}
        for pair in self.contacts:
            for body, part in pair.elastic_parts:
                named.setdefault(body, []).append(part)
        return {body: tuple(dict.fromkeys(parts)) for body, parts in named.items()}

    def listed_parts(self, body: str) -> tuple[str, ...]:
        """Return the parts and sides of a placed body that contacts name."""
        return self._listed_parts.get(body, ())

    def touching_parts(self, body: Body) -> tuple[str, ...]:
        """Return the names of the parts and sides of a placed body that may touch other bodies."""
        listed = self.listed_parts(body.name)
        if self.touching is None:
            return listed
        parts = (*body.parts, *(body.contact_part(name) for name in listed))
        taken = {side for part in parts for side in part.sides}
        whole = any(not part.sides for part in parts)
        free = [part.name for part in body.parts if isinstance(part.condition, Free)]
        sides = [] if whole else [name for name, group in self._side_names(body) if not {name, group} & taken]
        return tuple(dict.fromkeys([*listed, *free, *sides]))

    @cached_property
    def _scenes(self) -> dict[tuple[object, ...], Scene]:
        """The scenes of bodies; copies share one."""
        return {}

    def scene_of(self, body: Body) -> Scene:
        """Return the scene of one placed body, in which sides in contact are free parts.

        Its shape is in the coordinates of the body; loads, given displacements and obstacles are those in its place.
        Copies without moments share one scene, and so do bodies that are made of the same objects.
        """
        stated = (body.shape, body.mesh, body.discretisation, *body.parts, None, *body.body_forces)
        key = (
            *(id(entry) for entry in stated),
            body.material,
            self.touching_parts(body),
            lines_across(body, self.symmetry),
            body.placement
            if any(isinstance(part.condition, Force) and part.condition.moment for part in body.parts)
            else None,
        )
        if key not in self._scenes:
            self._scenes[key] = self._new_scene(body)
        return self._scenes[key]

    def _new_scene(self, body: Body) -> Scene:
        named = {part.name for part in body.parts}
        own = tuple(part.on(body.shape.outline(), body.placement) for part in body.parts)
        facing = [body.contact_part(name) for name in self.touching_parts(body)]
        parts: tuple[Part, ...] = (*own, *(part for part in facing if part.name not in named))
        touches_obstacle = any(isinstance(part.condition, Contact) for part in parts)
        try:
            return Scene(
                title=body.name,
                shape=body.shape,
                material=body.material,
                parts=parts,
                body_forces=body.body_forces,
                law=self.law if touches_obstacle else Frictionless(),
                steps=self.steps,
                symmetry=lines_across(body, self.symmetry),
                discretisation=self.discretisation if body.discretisation is None else body.discretisation,
                linear_solver=self.linear_solver,
                mesh=self.mesh if body.mesh is None else body.mesh,
                units=self.units,
            )
        except InputError as error:
            raise type(error)(f"body {body.name!r}: {error}") from error

    def rigid_body_of(self, pair: ContactPair) -> RigidBody:
        """Return the rigid body of a contact that has one."""
        return next(body for body in self.rigid if body.name == pair.rigid_body)

    def law_of(self, pair: ContactPair | Touching) -> FrictionLaw:
        """Return the friction law of a contact."""
        return self.law if pair.law is None else pair.law

    def with_contacts(self, contacts: tuple[ContactPair, ...]) -> Assembly:
        """Return the assembly with all its contacts listed."""
        return replace(self, contacts=contacts, touching=None)
