"""Places of contacts on bodies: ends of zones, edges and corners, which a finer mesh has to resolve."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.body import SlipHistory
from bemkit.geometry.local_values import element_degrees
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import at_arc_lengths
from bemkit.geometry.vectors import angles_between, norms
from bemkit.results.contact_table import ContactTable
from bemkit.results.transitions import (
    Transition,
    find_transitions,
    friction_across_gaps,
    resolved_transitions,
    slip_reversals,
    unresolved_contacts,
    unrolled,
)
from bemkit.results.zone_ends import LYING_AT, Side, ZoneEnd, reversal_error, transition_error
from bemkit.scene.conditions import name_at_obstacle

if TYPE_CHECKING:
    from bemkit.results.singular_corners import SingularCorner
    from bemkit.results.solved_scene import SolvedScene

_ErrorAt = tuple[Transition, Callable[[ZoneEnd, int], tuple[float, float]]]
"""A place, and what gives the squared error there and its length, in an element of a degree."""

LARGEST_REACH = 0.15
"""Largest length of the elements at a singular point that are excluded as near it, relative to the contact. Longer ones
have estimates."""

NEIGHBOUR_SHARE = 0.15
"""Share of the error of an excluded element, by its degree, that the tractions of its neighbour have, too."""

FAR_END_SHARE = (0.0, 0.1)
"""Shares of the squared error at the far end of an excluded element that are outside, for degrees 1 and 2: its second
difference takes nodes nearer to the singular point."""


@dataclass(frozen=True, eq=False)
class ContactPlaces:
    """Sides of contacts, ends of their zones, edges and singular corners."""

    solution: SolvedScene

    def sides(self, contact: str) -> list[Side]:
        """Return the sides of elastic bodies in a contact of the table: two, or one at an obstacle.

        The zones of a part of a half-plane, which may be any strip, are compared to half of the contact length.
        """
        return self._sides[contact]

    @cached_property
    def _sides(self) -> dict[str, list[Side]]:
        return {contact: self._sides_of(contact) for contact in self.solution.contact_sides}

    def _sides_of(self, contact: str) -> list[Side]:
        bodies, table = self.solution.bodies, self.solution.contact
        sides = []
        for body, part in self.solution.contact_sides[contact]:
            mesh, zone_length = bodies[body].mesh, None
            if mesh.surface is not None:
                touches = table.rows(contact) & table.is_closed
                zone_length = 0.5 * float(table.weight[touches].sum())
            sides.append(Side(body, mesh, part, zone_length))
        return sides

    def elements(self, name: str) -> IntArray:
        """Return the elements of a body that may touch others or obstacles, without those near `singular_points`."""
        mesh, elements = self.solution.bodies[name].mesh, self._touching(name)
        points, reaches = self.singular_points
        around = norms(points - mesh.centre) <= 0.5 * mesh.diameter + reaches
        ends = np.stack([mesh.start[elements], mesh.end[elements]])
        is_near = norms(ends[:, :, None] - points[around]) < (1.0 - LYING_AT) * reaches[around]
        return elements[~is_near.any(axis=(0, 2))]

    def _touching(self, name: str) -> IntArray:
        body = self.solution.bodies[name]
        listed = self.solution.scene.listed_parts.get(name, ())
        parts = dict.fromkeys([*listed, *(part.name for part in body.scene.contact_parts)])
        return np.unique(np.concatenate([np.zeros(0, np.intp), *(body.mesh.part(part) for part in parts)]))

    @cached_property
    def singular_points(self) -> tuple[FloatArray, FloatArray]:
        """Points (n, 2) at which tractions have no bound, corners and edges, and lengths (n,) [m] of elements there.

        They are compared with lengths of whole contacts, which symmetry lines may halve.

        Both sides of a contact have the length of the longer elements, since an error of one side is one of the other.
        Points with elements longer than `LARGEST_REACH` are excluded.
        """
        found: list[tuple[FloatArray, float, float]] = []
        for name, corners in self.corners.items():
            mesh = self.solution.bodies[name].mesh
            n_lines = 0 if mesh.symmetry is None else 2 - (mesh.symmetry.x, mesh.symmetry.y).count(None)
            length = 2.0**n_lines * float(mesh.lengths[self._touching(name)].sum())
            for corner in corners:
                point = np.array([corner.x, corner.y])
                found.append((point, _reach(mesh, np.array(corner.elements), point), length))
        for one, two, point, _ in self._edges:
            reach = max(_reach(side.mesh, side.elements_at(point), point) for side in (one, two))
            found.append((point, reach, min(one.whole_length, two.whole_length)))
        points = np.array([point for point, _, _ in found]).reshape(-1, 2)
        reaches, lengths = np.array([sizes for _, *sizes in found]).reshape(-1, 2).T
        long = points[reaches > LARGEST_REACH * lengths]  # on one of two sides
        is_short = (norms(points[:, None] - long) > LYING_AT * lengths[:, None]).all(axis=1)
        return points[is_short], reaches[is_short]

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
            listed = solution.scene.listed_parts.get(name, ())
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
    def _zones(self) -> list[tuple[ContactTable, tuple[Transition, ...]]]:
        """The table with its transitions, and where friction acts across gaps that of its status there with its own."""
        solution = self.solution
        zones = [(solution.contact, solution.transitions)]
        if solution.friction_bound is not None:
            table = friction_across_gaps(solution.contact, solution.friction_bound)
            if table.is_closed.any():
                found = find_transitions(table)
                zones.append((table, tuple(each for each in found if not each.is_of_contact)))
        return zones

    def zone_ends(self, missed: Mapping[str, tuple[float, float]]) -> tuple[ZoneEnd, ...]:
        """Return ends of zones of one status on all sides, and unresolved and missed contacts.

        See `resolved_transitions`, `unresolved_contacts` and, for the points (x, y) of the last, by contact,
        `Solution.missed_contacts`.
        """
        resolved = [each for zones in self._zones for each in resolved_transitions(*unrolled(*zones))]
        places = [(each.part, (each.x, each.y)) for each in resolved]
        table, _ = self.solution.contact.unrolled
        places += [*unresolved_contacts(table, resolved), *missed.items()]
        return tuple(side.near(np.array(place)) for name, place in places for side in self.sides(name))

    @cached_property
    def reversals(self) -> tuple[ZoneEnd, ...]:
        """Reversals of slip without a resolved stick zone, on all sides; see `slip_reversals`."""
        places = [reversal.place for table, _ in self._zones for reversal in slip_reversals(table)]
        return tuple(side.near(np.array([place.x, place.y])) for place in places for side in self.sides(place.part))

    @cached_property
    def _edges(self) -> list[tuple[Side, Side, FloatArray, ZoneEnd]]:
        """Two sides, the point where the second ends inside the first, and where that is on the first."""
        pairs = [self.sides(pair.name) for pair in self.solution.scene.elastic_contacts]
        ordered = [order for one, two in pairs for order in ((one, two), (two, one))]
        return [(side, other, *edge) for side, other in ordered for edge in side.edges(other)]

    @property
    def facing_ends(self) -> tuple[ZoneEnd, ...]:
        """Ends of a side that lie inside the side that they face."""
        return tuple(place for _, _, _, place in self._edges)

    def squared_traction_error(self) -> float | None:
        """Return the estimated squared error of the contact tractions of all bodies in L2 [Pa^2 m].

        Elements of degree 3 and more have estimates by their coefficients; if a body has lower degrees, nodes have.
        Those near `singular_points` are excluded. None if too few are left.
        """
        if self.lowest_degree <= 2:
            return self._squared_error_at_nodes()
        if not any(chosen.size for chosen in self._counted.values()):
            return None
        squared, _ = self._transition_errors
        for contact in self.solution.contact.parts:
            name, part = self.solution.contact_sides[contact][0]
            squared += self.solution.n_sides(contact) * self._squared_error_on(name, part)
        return squared

    def _squared_error_at_nodes(self) -> float | None:
        """Return the squared error of linear and quadratic elements; constant ones take the factors of linear ones."""
        from bemkit.results.error_indicators import continuation_error, nodal_error

        table, degree, at_ends, on_curves = self.solution.contact, max(self.lowest_degree, 1), 0.0, 0.0
        share, tractions = np.ones(table.n_contact), np.stack([table.sigma_n, table.sigma_t], axis=1)
        for contact in table.parts:
            rows, side = table.rows(contact), self.sides(contact)[0]
            s, own_degree = table.s[rows], int(self._degrees[side.body].min())
            share[rows] = shares = self._counted_shares(side, s, FAR_END_SHARE[degree - 1])
            on_curves += self.solution.n_sides(contact) * self._squared_error_on_curves(contact)
            if own_degree == 0 or contact in table.circumferences:  # nodes at centres; no ends
                continue
            if self.solution.n_sides(contact) > 1:  # the other side may end there, and none goes on beyond its nodes
                continue
            lengths = side.mesh.lengths[side.elements]
            for order, distances, length in (
                (slice(None), s, lengths[0]),
                (slice(None, None, -1), (side.length - s)[::-1], lengths[-1]),
            ):
                if distances[0] <= (1.0 + LYING_AT) * length:  # within an element
                    missed = continuation_error(distances, tractions[rows][order], own_degree)
                    at_ends += float(shares[order][0]) * missed
        at_nodes = nodal_error(table, degree, self.solution.n_sides, share)
        return None if at_nodes is None else at_nodes + at_ends + on_curves

    def _squared_error_on_curves(self, contact: str) -> float:
        """Return the squared error [Pa^2 m] of linear elements of a side that turn, the larger one of both sides.

        Between two nodes that are displaced along their normals the chord misses turn^2 / 12 of that displacement in
        the mean, and the forces of the nodes as much of the pressure.
        """
        squared = [0.0]
        for side in self.sides(contact):
            elements = np.intersect1d(side.mesh.part(side.part), self._counted[side.body])
            if (self._degrees[side.body] == 1).all():
                normals = side.mesh.normals_at(elements, np.array([-1.0, 1.0]))
                traction = norms(self.solution.bodies[side.body].boundary.traction[elements])
                missed = angles_between(normals[:, 0], normals[:, 1]) ** 2 / 6.0 * traction
                squared.append(float(side.mesh.lengths[elements] @ missed**2))
        return max(squared)

    def _counted_shares(self, side: Side, s: FloatArray, far_end_share: float) -> FloatArray:
        """Return the share (n,) of the squared error at nodes (n,) [m] of a side: of none on excluded elements only.

        At the far end of an excluded element the second difference takes nodes nearer to the singular point.
        """
        is_excluded, margin = ~np.isin(side.elements, self._counted[side.body]), LYING_AT * side.length
        before, after = (
            is_excluded[at_arc_lengths(side.mesh, side.elements, s + step)[0]] for step in (-margin, margin)
        )
        return np.where(before & after, 0.0, np.where(before | after, far_end_share, 1.0))

    def _squared_error_on(self, name: str, part: str) -> float:
        """Return the squared error [Pa^2 m] on the counted elements of a part, by its coefficients and its neighbours.

        Elements at singular corners that are not excluded have the errors of the power of the distance there. The
        neighbour of an excluded element has a share of its error.
        """
        from bemkit.results.coefficient_decay import singular_error

        body = self.solution.bodies[name]
        assert body.coefficient_errors is not None
        errors, elements = body.coefficient_errors.traction.copy(), body.mesh.part(part)
        for corner in self.corners[name]:
            for k in corner.elements:
                last, length = body.coefficient_errors.last_traction[k], body.mesh.lengths[k]
                singular = singular_error(last, length, int(self._degrees[name][k]), corner.exponent - 1.0)
                errors[k] = max(errors[k], singular)
        counted = np.intersect1d(elements, self._counted[name])
        pairs = np.concatenate([body.mesh.node_elements, body.mesh.node_elements[:, ::-1]])
        excluded = np.setdiff1d(elements, counted)
        source = pairs[np.isin(pairs[:, 0], excluded) & np.isin(pairs[:, 1], counted), 0]
        return float(errors[counted].sum() + (NEIGHBOUR_SHARE / self._degrees[name][source]) ** 2 @ errors[source])

    def squared_energy_error(self) -> float:
        """Return the squared error in the energy norm [J/m] where zones end inside elements of degree 3 and more."""
        return self._transition_errors[1] if self.lowest_degree > 2 else 0.0

    @cached_property
    def _degrees(self) -> dict[str, IntArray]:
        """Degrees of the displacements on the elements (n_elements,) of all bodies."""
        return {
            name: element_degrees(body.scene.discretisation.displacement_space(body.mesh))
            for name, body in self.solution.bodies.items()
        }

    @cached_property
    def lowest_degree(self) -> int:
        """Lowest degree of the displacements of all bodies."""
        bodies = self.solution.bodies.values()
        return min(body.scene.discretisation.displacement_space(body.mesh).degree for body in bodies)

    @cached_property
    def _counted(self) -> dict[str, IntArray]:
        """`elements` of all bodies."""
        return {name: self.elements(name) for name in self.solution.bodies}

    @cached_property
    def _transition_errors(self) -> tuple[float, float]:
        """Squared errors of tractions in L2 [Pa^2 m], and in the energy norm [J/m], by `transition_error`.

        The error has about the wave number 2 / l at the length l on which it changes its sign.
        """
        traction, energy = 0.0, 0.0
        for contact, changes in self._zones:
            for transition, error_in in (*self._errors_at(contact, changes), *self._errors_at_reversals(contact)):
                for k, side in enumerate(self.sides(transition.part)):
                    end = side.near(np.array([transition.x, transition.y]))
                    if end.element in self._counted[side.body]:
                        squared, length = error_in(end, int(self._degrees[side.body][end.element]))
                        plane_modulus = self.solution.bodies[side.body].scene.material.plane_modulus
                        energy += 0.5 * squared * length / plane_modulus
                        if k == 0:  # the side with the nodes, for both
                            traction += self.solution.n_sides(transition.part) * squared
        return traction, energy

    def _errors_at(self, contact: ContactTable, changes: tuple[Transition, ...]) -> Iterator[_ErrorAt]:
        """Yield transitions, and what gives their `transition_error` in an element of a degree."""
        table, transitions = unrolled(contact, changes)
        tractions = sticking = [table.sigma_n, table.sigma_t]
        if self.solution.friction_bound is not None:  # how far friction is below its bound
            sticking = [self.solution.friction_bound[contact.unrolled[1]] - np.abs(table.sigma_t)]
        for each in transitions:
            fields = tractions if each.is_of_contact else sticking
            yield each, partial(transition_error, table, fields, each, transitions)

    def _errors_at_reversals(self, contact: ContactTable) -> Iterator[_ErrorAt]:
        """Yield reversals of slip, and what gives their `reversal_error`."""
        for reversal in slip_reversals(contact):
            yield reversal.place, partial(reversal_error, reversal.jump)


def _reach(mesh: BoundaryMesh, elements: IntArray, point: FloatArray) -> float:
    """Return the distance [m] of the furthest end of some elements from a point."""
    return float(max(norms(end[elements] - point).max() for end in (mesh.start, mesh.end)))
