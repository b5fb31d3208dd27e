"""The contacts of a solution, the bodies that they join, and the units of both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.laws import FrictionLaw
from bemkit.results.contact_table import ContactTable
from bemkit.results.solution import Solution
from bemkit.results.solved_body import SideName
from bemkit.scene.conditions import name_at_obstacle
from bemkit.scene.contacts import ContactPair
from bemkit.testing.independent_check.bodies import BodyMeasurements
from bemkit.testing.independent_check.boundary import trusted_stress
from bemkit.testing.independent_check.check import ContactMeasurements, measure
from bemkit.testing.independent_check.sides import Side

LIGHTEST = 1e-3
"""Least unit of stress of a body, relative to the largest stress of the scene."""


@dataclass(frozen=True, eq=False)
class Interfaces:
    """The contacts of a scene and the bodies that they join.

    Parameters
    ----------
    solution : Solution
    bodies : mapping of str to BodyMeasurements
    pairs : mapping of str to ContactPair
        By name, those between elastic bodies.
    moving : mapping of str to ContactPair
        By name, those with rigid bodies that move.
    """

    solution: Solution
    bodies: Mapping[str, BodyMeasurements]
    pairs: Mapping[str, ContactPair]
    moving: Mapping[str, ContactPair]

    @classmethod
    def of(cls, solution: Solution, before: Solution | None = None) -> Interfaces:
        """Measure the bodies of a solution, and find whose nodes the rows of its table are.

        What is left of the load step `before` is known no better than that was.
        """
        contacts = solution.scene.contacts
        pairs = {pair.name: pair for pair in solution.scene.elastic_contacts}
        moving = {pair.name: pair for pair in contacts if pair.name not in pairs}
        touched: dict[str, list[str]] = {name: [] for name in solution.bodies}
        for pair in contacts:
            for body, part in solution.contact_sides[pair.name]:
                touched[body].append(part)
        earlier = {} if before is None else before.bodies
        views = {
            name: BodyMeasurements.of(body, tuple(touched[name]), earlier.get(name))
            for name, body in solution.bodies.items()
        }
        most = max(body.largest_stress for body in views.values())
        bodies = {name: body.measured_by(LIGHTEST * most) for name, body in views.items()}
        return cls(solution, bodies, pairs, moving)

    def side(self, name: SideName) -> Side:
        """Return the elements of a side."""
        return Side(self.bodies[name.body], self.bodies[name.body].result.mesh.part(name.part))

    def owner(self, contact: str) -> SideName:
        """Return the side with the nodes of a contact."""
        return self.solution.contact_sides[contact][0]

    def partner(self, contact: str) -> SideName | None:
        """Return the elastic side without the nodes, None of an obstacle."""
        return next(iter(self.solution.contact_sides[contact][1:]), None)

    def _law(self, name: str) -> FrictionLaw:
        if pair := self.pairs.get(name) or self.moving.get(name):
            return self.solution.scene.law_of(pair)
        side = self.owner(name)
        return self.solution.bodies[side.body].scene.laws[side.part]

    def units(self) -> tuple[FloatArray, FloatArray]:
        """Return the units of each row: (n_contact,) lengths [m] and stresses [Pa]."""
        length, stress = np.ones((2, self.solution.contact.n_contact))
        for name in self.solution.contact.parts:
            sides = self.solution.contact_sides[name]
            bodies = [self.bodies[side.body] for side in sides]
            scales = [body.scales for body in bodies]
            # a body that moves far passes on what is round-off there
            trusted = max(trusted_stress(body.fields.solution, body.fields.before) for body in bodies)
            rows = self.solution.contact.rows(name)
            length[rows] = max(each.length for each in scales)
            stress[rows] = max(min(each.stress for each in scales), trusted)
        return length, stress

    def measured(self, before: Solution | None) -> ContactMeasurements:
        """Return the contact quantities in the friction laws."""
        table, units = self.solution.contact, self.units()
        points = np.column_stack([table.x, table.y])
        slip = table.u_t if before is None else table.u_t - before.contact.u_t
        parts = []
        for name in table.parts:
            rows = table.rows(name)
            columns: dict[str, Any] = {key: column[rows] for key, column in table.columns().items()}
            own = ContactTable((name,) * int(rows.sum()), **columns)
            law, loading = self._law(name).at(points[rows]), self.solution.loading
            law = law if loading is None else law.at_slip(loading.motion.of(np.flatnonzero(rows)))
            supported = self._is_supported(name)
            parts.append(measure(own, law, own.u_n, slip[rows], supported, (units[0][rows], units[1][rows])))
        order = np.argsort(np.concatenate([np.flatnonzero(table.rows(name)) for name in table.parts]))
        entries = ([getattr(part, entry.name) for part in parts] for entry in fields(ContactMeasurements))
        return ContactMeasurements(*(np.concatenate(entry)[order] for entry in entries))

    def _is_supported(self, name: str) -> BoolArray:
        """Return which nodes of a contact a support holds, or another obstacle of the body shares."""
        side, table = self.side(self.owner(name)), self.solution.contact
        points = np.column_stack([table.x, table.y])[table.rows(name)]
        nodes = side.body.supported_nodes()
        if name not in self.pairs:
            others = [
                side.body.boundary.nodes[side.body.result.mesh.part(part.name)].ravel()
                for part in side.body.result.scene.contact_parts
                if name_at_obstacle(side.body.result.name, part.name) != name
            ]
            nodes = np.unique(np.concatenate([nodes, *others]))
        at = side.body.result.boundary.points[nodes]
        apart = np.linalg.norm(points[:, None] - at, axis=2).min(axis=1, initial=np.inf)
        return np.asarray(apart <= 1e-9 * side.body.result.mesh.diameter)
