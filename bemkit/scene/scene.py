"""A scene: bodies, their parts, loads and obstacles, contacts, friction laws, meshes and the solver.

Everything here is a frozen value. A scene can be written in Python or as a TOML file (`bemkit.scene.toml`), and either
form can be turned into the other. All quantities are in one consistent set of units, for example m, N and Pa.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.laws import FrictionLaw, Frictionless
from bemkit.errors import InputError, Mistakes
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.shapes import Shape
from bemkit.notebook import ShownInNotebooks
from bemkit.operators.linear_solvers import Automatic, LinearSolverChoice
from bemkit.operators.material import Material
from bemkit.scene.body import Body, check_accuracy, check_place, lines_across
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.conditions import Contact, Force, Free, Part
from bemkit.scene.discretisation import Discretisation, Galerkin, MeshOptions
from bemkit.scene.objects import check_laws, check_names, check_objects, check_steps, outline_of
from bemkit.scene.unit_names import UnitNames
from bemkit.solvers.base import ContactSolver
from bemkit.solvers.fallbacks import Fallbacks

if TYPE_CHECKING:
    from bemkit.geometry.symmetry.lines import Symmetry
    from bemkit.scene.body_forces import BodyForce
    from bemkit.scene.contacts import ContactPair, Touching
    from bemkit.scene.plane_motion import FarField, RigidBody
    from bemkit.scene.steps import Step

_OF_COPY = ("name", "placement", "copies")
"""Fields of a body that differ between its copies."""
OF_ONE_BODY = ("shape", "material", "parts", "body_forces", "far")
"""Fields of the short form."""
OF_SEVERAL = ("bodies", "rigid", "contacts", "touching")
"""Fields that the short form lacks."""


@dataclass(frozen=True, kw_only=True)
class Scene(ShownInNotebooks):
    """Elastic bodies with their contacts, supports and loads: everything that determines the solution.

    A scene lists its `bodies`, or states a single one in the short form, by `shape`, `material`, `parts`, `body_forces`
    and `far`. Boundary that belongs to no part is free of traction. Without contact this is a problem of elasticity.

    Parameters
    ----------
    title : str
    shape, material : Shape, Material
        Of the body in the short form.
    parts : tuple of Part
        Its supports, loads and rigid obstacles. They must not overlap (checked when the boundary is divided).
    body_forces : tuple of BodyForce
        Gravity, rotation, heating.
    far : FarField, optional
        Motion or load of a half-plane far away from its surface. By default it is at rest there.
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
        The load history: what changes from step to step. Without one, or with a single step, slip counts from the
        undeformed bodies (the static law); with several, from the end of the step before (the incremental law).
    symmetry : Symmetry, optional
        Lines about which the scene, which describes the whole, is symmetric. Only elements on the side x <= a, y <= b
        carry unknowns, the others are their images; results are those of that side. Of several bodies those that a line
        crosses are drawn in their places; of those beside it only the ones on the side of smaller x, or y, are listed.
        A body that touches its own image at a line needs an obstacle there.
    discretisation : Discretisation
        Of all bodies that have none of their own.
    linear_solver : LinearSolver or Automatic
        Linear solver of the bodies.
    mesh : MeshOptions
        Of each body that has none of its own; `elements` are those of one body. An accuracy is that of all bodies.
    solver : ContactSolver
    units : UnitNames, optional
        Names of the units that everything is stated in; they label results.
    thickness : float, optional [m]
        Out of the plane. With it forces and moments, given and in results, are those on the whole thickness, and
        energies, too; without it all are per unit of thickness.
    description, reference : str
        Text: what the scene shows, and its source.

    Raises
    ------
    InputError
        If the title is empty, there is no body, or both forms are used; two bodies or parts share a name, a part names
        an unknown side, a contact names what does not exist or is listed twice, a rigid body takes part in no contact;
        a load factor is missing or not finite, times do not increase, a law needs slip or time without steps; body
        forces act in an exterior, an accuracy is asked of collocation or goes with elements of a body; or a law with
        friction or a solver is given without any contact.
    GeometryError
        If the outline of a shape is not a valid boundary.
    """

    title: str
    shape: Shape | None = None
    material: Material | None = None
    parts: tuple[Part, ...] = ()
    body_forces: tuple[BodyForce, ...] = ()
    far: FarField | None = None
    bodies: tuple[Body, ...] = ()
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
    thickness: float | None = None
    description: str = ""
    reference: str = ""

    def __post_init__(self) -> None:
        check_objects(self)
        object.__setattr__(self, "load_factors", tuple(self.load_factors))
        object.__setattr__(self, "steps", tuple(self.steps))
        if not self.title or not self.title.isprintable():
            raise InputError(f"title is {self.title!r}: give one line of printable text")
        if self.thickness is not None and not 0.0 < self.thickness < np.inf:
            raise InputError(f"thickness is {self.thickness}: give a positive length, or omit it")
        _ = self.result_units
        self._check_form()
        mistakes = Mistakes()
        with mistakes.collected():
            check_steps(self.load_factors, self.steps)
        with mistakes.collected():
            check_accuracy(self.mesh, self.bodies)
        for check in (self._check_names, self._check_contacts, self._check_symmetry):
            with mistakes.collected():
                check()
        for body in self.placed_bodies:
            with mistakes.collected():
                scene = self.scene_of(body)  # parts and sides are checked
                if len(self.placed_bodies) > 1:
                    scene.check_among_others(body.name)
        mistakes.raise_all()

    def _check_names(self) -> None:
        for body in self.bodies:
            body.check_name()
        names = [*(body.name for body in self.placed_bodies), *(body.name for body in self.rigid)]
        check_names("bodies", names, "bodies")
        check_names("parts", (part.name for part in self.parts), "parts")

    def _check_contacts(self) -> None:
        laws = {f"law of contact {pair.name!r}": self.law_of(pair) for pair in self.contacts}
        check_laws(({"law": self.law} if self.bodies else {}) | laws, self.steps)
        if not self.has_contact:
            self._check_without_contact()
        if self.contacts or self.rigid:
            from bemkit.scene.contacts import check_contacts

            check_contacts(self.contacts, self.rigid, self._by_name, self._side_names)

    def _check_symmetry(self) -> None:
        if self.symmetry is not None and self.bodies:
            if self.rigid:
                raise InputError("symmetry goes only with elastic bodies: remove it, or the rigid bodies")
            for body in self.placed_bodies:
                check_place(body, self.symmetry)

    def __getstate__(self) -> dict[str, Any]:
        """Pickle the fields only: caches use the identity of objects."""
        return {entry.name: getattr(self, entry.name) for entry in fields(self)}

    def _check_form(self) -> None:
        if not self.bodies:
            for name in ("shape", "material"):
                if getattr(self, name) is None:
                    raise InputError(
                        f"{name} is missing: give the body a shape and a material, [{name}] in a file, or bodies"
                    )
            for name in OF_SEVERAL:
                if getattr(self, name):
                    raise InputError(f"{name} is given, but the body has no name: list it in bodies")
            return
        for name in OF_ONE_BODY:
            if getattr(self, name) not in (None, ()):
                raise InputError(f"{name} is given besides bodies: state it of one of the bodies")

    def _check_without_contact(self) -> None:
        remedy = "no part is in contact: remove the {name}, or give one part the condition 'contact' with an obstacle"
        if self.bodies:
            remedy = "no two bodies are in contact: list contacts, or remove the {name}"
        for name, default in (("law", Frictionless()), ("solver", Fallbacks())):
            if getattr(self, name) != default:
                raise InputError(f"{name} is {getattr(self, name)!r}, but {remedy.format(name=name)}")

    def _side_names(self, body: Body) -> tuple[tuple[str, str], ...]:
        """Return the name and the group of each side of a body; copies share them, since making an outline is slow."""
        key = id(body.shape)
        if key not in self._sides:
            self._sides[key] = tuple((side.name, side.group or side.name) for side in outline_of(body.shape).sides)
        return self._sides[key]

    @cached_property
    def _sides(self) -> dict[int, tuple[tuple[str, str], ...]]:
        """The names and groups of the sides of shapes."""
        return {}

    @property
    def n_steps(self) -> int:
        """Number of load steps, increments counted."""
        return sum(step.increments for step in self.steps) if self.steps else len(self.load_factors)

    @property
    def is_one_load(self) -> bool:
        """Whether there is a single load step without changes: all loads at once, or one state of a history."""
        return self.load_factors == (1.0,) and len(self.steps) <= 1 and all(step.is_plain for step in self.steps)

    @cached_property
    def placed_bodies(self) -> tuple[Body, ...]:
        """The bodies, every copy a body of its own; that of the short form has no name."""
        if self.shape is not None and self.material is not None:
            own = {name: getattr(self, name) for name in OF_ONE_BODY}
            return (Body(name="", **own),)
        return tuple(placed for body in self.bodies for placed in body.copied())

    @property
    def depth(self) -> float:
        """The thickness that forces act on: 1 if none is given."""
        return 1.0 if self.thickness is None else self.thickness

    @property
    def result_units(self) -> UnitNames | None:
        """Names of the units of forces, lengths and stresses in results."""
        return None if self.units is None else self.units.over_thickness(self.thickness)

    def load_on(self, body: RigidBody) -> FloatArray:
        """Return the given loads (3,) [N/m, N/m, N m/m] on a rigid body, per unit of thickness."""
        return body.load / self.depth

    @property
    def has_contact(self) -> bool:
        """Whether anything may touch: obstacles, rigid bodies or other bodies."""
        parts = (*self.parts, *(part for body in self.bodies for part in body.parts))
        return any(isinstance(part.condition, Contact) for part in parts) or bool(self.contacts or self.touching)

    @property
    def has_obstacles_only(self) -> bool:
        """Whether there is one elastic body that touches nothing but fixed obstacles."""
        return len(self.placed_bodies) == 1 and not self.contacts and self.touching is None

    @property
    def only(self) -> BodyScene:
        """The statement of the only body; InputError if there are several."""
        if len(self.placed_bodies) > 1:
            raise InputError(f"there are {len(self.placed_bodies)} bodies: only scenes of one body can do this")
        return self.scene_of(self.placed_bodies[0])

    @property
    def contact_parts(self) -> tuple[Part, ...]:
        """The parts of all bodies that may touch a rigid obstacle."""
        return tuple(part for body in self.placed_bodies for part in self.scene_of(body).contact_parts)

    def build_mesh(self) -> BoundaryMesh:
        """Divide the boundary of the only body into elements; GeometryError if it lacks the symmetry it states."""
        scene = self.only
        mesh = scene.divided([part.name for part in scene.contact_parts])
        if scene.symmetry is not None:
            from bemkit.scene.symmetry import check_symmetry

            check_symmetry(scene, mesh)
        return mesh

    @cached_property
    def elastic_contacts(self) -> tuple[ContactPair, ...]:
        """The contacts that no rigid body takes part in."""
        return tuple(pair for pair in self.contacts if pair.rigid_body is None)

    @cached_property
    def _by_name(self) -> Mapping[str, Body]:
        """The placed bodies by name."""
        return {body.name: body for body in self.placed_bodies}

    @cached_property
    def listed_parts(self) -> Mapping[str, tuple[str, ...]]:
        """The parts and sides of placed bodies that contacts name, by the body."""
        named: dict[str, list[str]] = {}
        for pair in self.contacts:
            for body, part in pair.elastic_parts:
                named.setdefault(body, []).append(part)
        return {body: tuple(dict.fromkeys(parts)) for body, parts in named.items()}

    def touching_parts(self, body: Body) -> tuple[str, ...]:
        """Return the names of the parts and sides of a placed body that may touch other bodies."""
        listed = self.listed_parts.get(body.name, ())
        if self.touching is None:
            return listed
        parts = (*body.parts, *(body.contact_part(name) for name in listed))
        taken = {side for part in parts for side in part.sides}
        whole = any(not part.sides for part in parts)
        free = [part.name for part in body.parts if isinstance(part.condition, Free)]
        sides = [] if whole else [name for name, group in self._side_names(body) if not {name, group} & taken]
        return tuple(dict.fromkeys([*listed, *free, *sides]))

    @cached_property
    def _scenes(self) -> dict[tuple[object, ...], BodyScene]:
        """Statements of bodies; copies share one."""
        return {}

    def scene_of(self, body: Body) -> BodyScene:
        """Return the scene of one placed body, with the sides in contact as free parts.

        Its shape is in the coordinates of the body; loads, given displacements and obstacles are those in its place.
        Copies without moments share it, and so do bodies that consist of the same objects.
        """
        has_moment = any(isinstance(part.condition, Force) and part.condition.moment for part in body.parts)
        own = [_identity(each.name, getattr(body, each.name)) for each in fields(body) if each.name not in _OF_COPY]
        placement = body.placement if has_moment else None
        key = (*own, self.touching_parts(body), self._lines_across(body), placement)
        if key not in self._scenes:
            self._scenes[key] = self._new_scene(body)
        return self._scenes[key]

    def _lines_across(self, body: Body) -> Symmetry | None:
        """Return the symmetry lines that halve a body: in the short form all."""
        return lines_across(body, self.symmetry) if self.bodies else self.symmetry

    def _new_scene(self, body: Body) -> BodyScene:
        named = {part.name for part in body.parts}
        try:
            outline = outline_of(body.shape)
            own = tuple(part.on(outline, body.placement, self.depth) for part in body.parts)
            facing = [body.contact_part(name) for name in self.touching_parts(body)]
            return BodyScene(
                shape=body.shape,
                material=body.material,
                parts=(*own, *(part for part in facing if part.name not in named)),
                body_forces=body.body_forces,
                far=None if body.far is None else body.far.multiplied(np.ones(3), np.full(3, 1.0 / self.depth)),
                law=self.law,
                steps=self.steps,
                n_steps=self.n_steps,
                symmetry=self._lines_across(body),
                discretisation=self.discretisation if body.discretisation is None else body.discretisation,
                mesh=self.mesh if body.mesh is None else body.mesh,
                units=self.result_units,
                depth=self.depth,
            )
        except InputError as error:
            if not body.name:
                raise
            lines = (f"body {body.name!r}: {line}" for line in str(error).splitlines())
            raise type(error)("\n".join(lines)) from error

    def rigid_body_of(self, pair: ContactPair) -> RigidBody:
        """Return the rigid body of a contact that has one."""
        return next(body for body in self.rigid if body.name == pair.rigid_body)

    def law_of(self, pair: ContactPair | Touching) -> FrictionLaw:
        """Return the friction law of a contact."""
        return self.law if pair.law is None else pair.law

    def with_contacts(self, contacts: tuple[ContactPair, ...]) -> Scene:
        """Return the scene with all its contacts listed."""
        return replace(self, contacts=contacts, touching=None)


def _identity(name: str, value: object) -> object:
    """Return a key that equal fields of bodies share: numbers are compared, other objects must be identical."""
    if isinstance(value, tuple):
        return tuple(id(entry) for entry in value)
    return value if name in ("material", "far") else id(value)


def check_scene(scene: object) -> None:
    """Check that a value is a scene, not the name of one.

    Raises
    ------
    InputError
        Naming the value and what reads a scene.
    """
    if not isinstance(scene, Scene):
        remedy = f"load_scene({scene!r}) reads one" if isinstance(scene, str) else "load_scene(path) reads one"
        raise InputError(f"scene is {scene!r}: give a Scene; {remedy}")
