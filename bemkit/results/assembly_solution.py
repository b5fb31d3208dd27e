"""The result of an assembly: the fields of each body, the contacts between them, and how the solve ended."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.body import SlipHistory
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.results.between_nodes import BetweenNodes
from bemkit.results.contact_table import resolved_transitions, unresolved_contacts
from bemkit.results.part_forces import ContactForce, RigidResult
from bemkit.results.resultants import contact_facts
from bemkit.results.solved_body import BoundaryFields, SolvedBody
from bemkit.results.solved_problem import SolvedProblem
from bemkit.results.zone_ends import Side, ZoneEnd
from bemkit.scene.assembly import Assembly
from bemkit.scene.scene import Scene

if TYPE_CHECKING:
    from bemkit.results.singular_corners import SingularCorner


@dataclass(frozen=True, eq=False)
class BodyResult(SolvedBody):
    """One body of a solved assembly; `bemkit.interior_fields` takes it like a solution.

    Parameters
    ----------
    name : str
    scene : Scene
        The scene of the body, its mesh in the coordinates of its shape.
    mesh : BoundaryMesh
        In its place.
    boundary : BoundaryFields
    energy : float [J/m]
        Elastic energy of this body.
    """

    name: str
    scene: Scene
    mesh: BoundaryMesh
    boundary: BoundaryFields
    energy: float

    def __repr__(self) -> str:
        """Return one line."""
        return f"BodyResult({self.name!r}: {self.mesh.n_elements} elements)"

    def summary(self) -> dict[str, Any]:
        """Return the result without its fields."""
        return {
            "n_elements": self.mesh.n_elements,
            "energy": self.energy,
            "parts": [force.as_dict() for force in self.part_forces],
        }


class SideName(NamedTuple):
    """A side of an elastic body in a contact."""

    body: str
    part: str


@dataclass(frozen=True, eq=False, kw_only=True)
class AssemblySolution(SolvedProblem):
    """The solution of an assembly, as `bemkit.run` returns it and result files hold it.

    Status, certificate, contact table and history are entries of `SolvedProblem`. The contact table has a row for each
    multiplier node; `part` is the name of the contact, and displacements are those of the body with the node less those
    of its partner.

    Parameters
    ----------
    assembly : Assembly
        With all contacts listed, those found by `Assembly.touching` among them; of a load history that of its last
        step.
    bodies : mapping of str to BodyResult
        By name, in the order of the assembly.
    contact_sides : mapping of str to tuple of SideName
        The sides of elastic bodies in each contact of the table and of the assembly, first the one with the nodes.
    contact_directions : (n_contact, 2) array
        Unit vectors of u_n and sigma_n, out of the body with the node.
    friction_bound : (n_contact,) array or None [Pa]
        The largest friction at each contact node; None if there is none anywhere.
    contacts : tuple of ContactForce
        What each contact transmits.
    rigid : mapping of str to RigidResult
        How each rigid body moved and what acts on it, by name.
    """

    assembly: Assembly
    bodies: Mapping[str, BodyResult]
    contact_sides: Mapping[str, tuple[SideName, ...]]
    contact_directions: FloatArray
    friction_bound: FloatArray | None
    contacts: tuple[ContactForce, ...]
    rigid: Mapping[str, RigidResult] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return one line; the fields hold thousands of numbers."""
        sizes = f"{len(self.bodies)} bodies, {self.n_elements} elements, {self.contact.n_contact} contact nodes"
        return f"AssemblySolution({self.assembly.title!r}: {self.status_words}, {sizes})"

    @property
    def stated(self) -> Assembly:
        """The assembly that was solved, with all its load steps."""
        return self.assembly if self.loading is None else cast(Assembly, self.loading.asked)

    @property
    def _problem(self) -> Assembly:
        return self.assembly

    @property
    def solved_bodies(self) -> tuple[BodyResult, ...]:
        """The elastic bodies, in the order of the assembly."""
        return tuple(self.bodies.values())

    def part_length(self, contact: str) -> float:
        """Return the length of boundary that can touch in a contact [m]."""
        rows = self.contact.rows(contact)
        return float(self.contact.weight[rows].sum()) + max(float(self.contact.s[rows][0]), 0.0)

    @property
    def energy(self) -> float:
        """Elastic energy of all bodies [J/m]."""
        return sum(body.energy for body in self.bodies.values())

    @property
    def force_normal(self) -> float:
        """Sum of the pressing forces of all contacts [N/m], positive."""
        return sum(contact.force_normal for contact in self.contacts)

    @property
    def force_tangential(self) -> float:
        """Sum of the friction forces of all contacts along their tangents [N/m]."""
        return sum(contact.force_tangential for contact in self.contacts)

    @property
    def error_unit(self) -> float:
        """Energy [J/m] to which squared errors in the energy norm are relative; see `SolvedBody.error_unit`."""
        return sum(body.error_unit for body in self.bodies.values())

    def _measured_between(
        self, motion: SlipHistory | None, names: Collection[str] | None = None
    ) -> dict[str, BetweenNodes]:
        from bemkit.results.between_bodies import violations_between_bodies  # mortars, which single bodies lack

        return violations_between_bodies(
            self.assembly, self.bodies, self.contact_sides, self.rigid, self.contact, motion, names
        )

    def contact_elements(self, body: str) -> IntArray:
        """Return the elements of a body that may touch other bodies or obstacles.

        Without those at edges that press into another side, and from degree 3 on those at `singular_corners`:
        tractions there have no bound.
        """
        result = self.bodies[body]
        parts = dict.fromkeys([*self.assembly.listed_parts(body), *(part.name for part in result.scene.contact_parts)])
        at_edges = [
            side.elements_at(point) for one, two, point, _ in self._edges for side in (one, two) if side.body == body
        ]
        if result.coefficient_errors is not None:
            at_edges += [np.array(corner.elements) for corner in self.singular_corners[body]]
        elements = np.concatenate([np.zeros(0, np.intp), *(result.mesh.part(part) for part in parts)])
        return np.setdiff1d(elements, np.concatenate([np.zeros(0, np.intp), *at_edges]))

    @cached_property
    def singular_corners(self) -> dict[str, tuple[SingularCorner, ...]]:
        """Singular corners at rigid obstacles and other elastic bodies, by the name of the body.

        See `bemkit.results.singular_corners` and `bemkit.results.joined_corners`; of laws that depend on slip or time
        none are known.
        """
        from bemkit.results.joined_corners import joined_corners
        from bemkit.results.singular_corners import GivenSides, singular_corners

        found: dict[str, list[SingularCorner]] = {}
        given, materials = {}, {name: body.scene.material for name, body in self.bodies.items()}
        for name, body in self.bodies.items():
            table = self.contact.renamed({f"{name}.{part.name}": part.name for part in body.scene.contact_parts})
            listed = self.assembly.listed_parts(name)
            given[name] = GivenSides(body, table, None, listed)
            has_history = any(law.needs_history for law in body.scene.laws.values())
            found[name] = [] if has_history else list(singular_corners(body, table, unknown=listed))
        for pair in self.assembly.elastic_contacts:
            law, rows = self.assembly.law_of(pair), self.contact.renamed({pair.name: pair.name})
            if rows.n_contact and not law.needs_history:
                one, two = self._sides_of(pair.name)
                for name, corner in joined_corners(one, two, rows, law, given, materials):
                    found[name].append(corner)
        return {name: tuple(corners) for name, corners in found.items()}

    def corners_of(self, body: SolvedBody) -> tuple[SingularCorner, ...]:
        """Return the singular corners of one of the bodies."""
        return next(self.singular_corners[name] for name, own in self.bodies.items() if own is body)

    def _sides_of(self, contact: str) -> list[Side]:
        """Return the sides of elastic bodies in a contact of the table: two, or one at an obstacle."""
        return [Side(body, self.bodies[body].mesh, part) for body, part in self.contact_sides[contact]]

    def n_sides(self, contact: str) -> int:
        """Return how many elastic bodies carry the tractions of a contact."""
        return len(self._sides_of(contact))

    @cached_property
    def zone_ends(self) -> tuple[ZoneEnd, ...]:
        """Ends of zones of one status on all sides, missed and unresolved contact.

        See `resolved_transitions`, `missed_contacts` and `unresolved_contacts`.
        """
        resolved = resolved_transitions(self.contact, self.transitions)
        places = [(each.part, (each.x, each.y)) for each in resolved]
        places += [*unresolved_contacts(self.contact, resolved), *self.missed_contacts.items()]
        return tuple(side.near(np.array(place)) for name, place in places for side in self._sides_of(name))

    @cached_property
    def _edges(self) -> list[tuple[Side, Side, FloatArray, ZoneEnd]]:
        """Two sides, the point where the second ends inside the first, and where that is on the first."""
        pairs = [self._sides_of(pair.name) for pair in self.assembly.elastic_contacts]
        ordered = [order for one, two in pairs for order in ((one, two), (two, one))]
        return [(side, other, *edge) for side, other in ordered for edge in side.edges(other)]

    @cached_property
    def reversal_ends(self) -> tuple[ZoneEnd, ...]:
        """Reversals of slip without a resolved stick zone, on all sides; see `slip_reversals`."""
        from bemkit.results.slip_reversals import slip_reversals

        places = [reversal.place for reversal in slip_reversals(self.contact)]
        return tuple(side.near(np.array([place.x, place.y])) for place in places for side in self._sides_of(place.part))

    @property
    def facing_ends(self) -> tuple[ZoneEnd, ...]:
        """Edges: ends of a side that lie inside the side that they face."""
        return tuple(place for _, _, _, place in self._edges)

    @cached_property
    def estimated_traction_error(self) -> float | None:
        """Estimated error of the contact tractions of all bodies in L2, relative to their norm.

        None if a body has no error estimate, if there are no such tractions, or fewer than three nodes carry them. From
        degree 3 on elements at edges that press into another side, and at singular corners, are excluded; see
        `contact_elements`.
        """
        size, errors_of_bodies = self.contact_traction_size, [body.coefficient_errors for body in self.solved_bodies]
        if size == 0.0 or not all(body.scene.discretisation.estimates_error for body in self.solved_bodies):
            return None
        if any(errors is None for errors in errors_of_bodies):
            return self._error_of_nodal_tractions()
        from bemkit.results.error_indicators import place_error

        elements = {name: self.contact_elements(name) for name in self.bodies}
        squared = sum(
            float(errors.traction[elements[name]].sum())
            for name, errors in zip(self.bodies, errors_of_bodies, strict=True)
            if errors is not None
        )
        for transition in self.transitions:
            for side in self._sides_of(transition.part):
                end = side.near(np.array([transition.x, transition.y]))
                if end.element in elements[side.body]:
                    squared += place_error(self.contact, transition, self.transitions, end)
        return float(np.sqrt(squared)) / size

    def _sizes(self) -> dict[str, int]:
        return {"n_bodies": len(self.bodies)}

    def _parts(self) -> dict[str, Any]:
        return {
            "estimated_traction_error": self.estimated_traction_error,
            "singular_corners": [
                {"body": name, **corner.as_dict()} for name, own in self.singular_corners.items() for corner in own
            ],
            "contacts": contact_facts(self),
            "bodies": {name: body.summary() for name, body in self.bodies.items()},
            "rigid": {name: body.as_dict() for name, body in self.rigid.items()},
        }
