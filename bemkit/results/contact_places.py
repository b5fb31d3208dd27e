"""Places of contacts on bodies: ends of zones, edges and corners, which a finer mesh has to resolve."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.body import SlipHistory
from bemkit.results.contact_table import resolved_transitions, unresolved_contacts
from bemkit.results.zone_ends import Side, ZoneEnd
from bemkit.scene.contacts import name_at_obstacle
from bemkit.solvers.active_sets import NodeStatus

if TYPE_CHECKING:
    from bemkit.results.singular_corners import SingularCorner
    from bemkit.results.solved_scene import SolvedScene


@dataclass(frozen=True, eq=False)
class ContactPlaces:
    """Sides of contacts, ends of their zones, edges and singular corners.

    Parameters
    ----------
    solution : SolvedScene
    missed : callable () -> mapping of str to (x, y)
        Points where contact is missed, by contact; called where ends of zones are asked for.
    """

    solution: SolvedScene
    missed: Callable[[], Mapping[str, tuple[float, float]]]

    def sides(self, contact: str) -> list[Side]:
        """Return the sides of elastic bodies in a contact of the table: two, or one at an obstacle.

        The zones of a part of a half-plane, which may be any strip, are compared to half of the contact length.
        """
        bodies, table = self.solution.bodies, self.solution.contact
        sides = []
        for body, part in self.solution.contact_sides[contact]:
            mesh, zone_length = bodies[body].mesh, None
            if mesh.surface is not None:
                touches = table.rows(contact) & (table.status != NodeStatus.SEPARATED)
                zone_length = 0.5 * float(table.weight[touches].sum())
            sides.append(Side(body, mesh, part, zone_length))
        return sides

    def elements(self, name: str) -> IntArray:
        """Return the elements of a body that may touch other bodies or obstacles.

        Without those at edges that press into another side, and from degree 3 on those at singular corners: tractions
        there have no bound.
        """
        body = self.solution.bodies[name]
        listed = self.solution.scene.listed_parts(name)
        parts = dict.fromkeys([*listed, *(part.name for part in body.scene.contact_parts)])
        left_out = [
            side.elements_at(point) for one, two, point, _ in self._edges for side in (one, two) if side.body == name
        ]
        if body.coefficient_errors is not None:
            left_out += [np.array(corner.elements) for corner in self.corners[name]]
        none = np.zeros(0, np.intp)
        elements = np.concatenate([none, *(body.mesh.part(part) for part in parts)])
        return np.setdiff1d(elements, np.concatenate([none, *left_out]))

    @cached_property
    def corners(self) -> Mapping[str, tuple[SingularCorner, ...]]:
        """Singular corners at rigid obstacles and other elastic bodies, by the name of the body.

        See `bemkit.results.singular_corners` and `bemkit.results.joined_corners`; between elastic bodies none are known
        for laws that depend on slip or time.
        """
        from bemkit.results.joined_corners import joined_corners
        from bemkit.results.singular_corners import GivenSides, singular_corners

        solution = self.solution
        found: dict[str, list[SingularCorner]] = {}
        given, materials = {}, {name: body.scene.material for name, body in solution.bodies.items()}
        for name, body in solution.bodies.items():
            own = {name_at_obstacle(body.name, part.name): part.name for part in body.scene.contact_parts}
            table, motion = solution.contact.renamed(own), self._motion_of(own)
            listed = solution.scene.listed_parts(name)
            given[name] = GivenSides(body, table, motion, listed)
            found[name] = list(singular_corners(body, table, motion=motion, unknown=listed))
        for pair in solution.scene.elastic_contacts:
            law, rows = solution.scene.law_of(pair), solution.contact.renamed({pair.name: pair.name})
            if rows.n_contact and not law.needs_history:
                one, two = self.sides(pair.name)
                for name, corner in joined_corners(one, two, rows, law, given, materials):
                    found[name].append(corner)
        return {name: tuple(corners) for name, corners in found.items()}

    def _motion_of(self, contacts: Mapping[str, str]) -> SlipHistory | None:
        """Return what the nodes of some contacts have slipped in a load history."""
        motion, table = self.solution.motion, self.solution.contact
        if motion is None:
            return None
        rows = [row for row, part in enumerate(table.part) if part in contacts]
        return replace(motion, slip=motion.slip[rows], last_slip=motion.last_slip[rows])

    @cached_property
    def zone_ends(self) -> tuple[ZoneEnd, ...]:
        """Ends of zones of one status on all sides, missed and unresolved contact.

        See `resolved_transitions`, `unresolved_contacts` and `Solution.missed_contacts`.
        """
        solution = self.solution
        resolved = resolved_transitions(solution.contact, solution.transitions)
        places = [(each.part, (each.x, each.y)) for each in resolved]
        places += [*unresolved_contacts(solution.contact, resolved), *self.missed().items()]
        return tuple(side.near(np.array(place)) for name, place in places for side in self.sides(name))

    @cached_property
    def reversals(self) -> tuple[ZoneEnd, ...]:
        """Reversals of slip without a resolved stick zone, on all sides; see `slip_reversals`."""
        from bemkit.results.slip_reversals import slip_reversals

        places = [reversal.place for reversal in slip_reversals(self.solution.contact)]
        return tuple(side.near(np.array([place.x, place.y])) for place in places for side in self.sides(place.part))

    @cached_property
    def _edges(self) -> list[tuple[Side, Side, FloatArray, ZoneEnd]]:
        """Two sides, the point where the second ends inside the first, and where that is on the first."""
        pairs = [self.sides(pair.name) for pair in self.solution.scene.elastic_contacts]
        ordered = [order for one, two in pairs for order in ((one, two), (two, one))]
        return [(side, other, *edge) for side, other in ordered for edge in side.edges(other)]

    @property
    def facing_ends(self) -> tuple[ZoneEnd, ...]:
        """Edges: ends of a side that lie inside the side that they face."""
        return tuple(place for _, _, _, place in self._edges)

    def squared_traction_error(self) -> float | None:
        """Return the estimated squared error of the contact tractions of all bodies in L2 [Pa^2 m].

        By the coefficients of elements of degree 3 and more, without those that `elements` excludes; None if a body has
        lower degrees.
        """
        from bemkit.results.error_indicators import transition_error

        solution, squared = self.solution, 0.0
        elements = {name: self.elements(name) for name in solution.bodies}
        for name, body in solution.bodies.items():
            if body.coefficient_errors is None:
                return None
            squared += float(body.coefficient_errors.traction[elements[name]].sum())
        for transition in solution.transitions:
            for side in self.sides(transition.part):
                end = side.near(np.array([transition.x, transition.y]))
                if end.element in elements[side.body]:
                    squared += transition_error(solution.contact, transition, solution.transitions, end)
        return squared
