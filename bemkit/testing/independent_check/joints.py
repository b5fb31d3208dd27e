"""The contacts of a solved assembly, the bodies that they join, and the units by which both are measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.laws import FrictionLaw
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.contact_table import ContactTable
from bemkit.scene.assembly import ContactPair
from bemkit.testing.independent_check.bodies import MeasuredBody
from bemkit.testing.independent_check.boundary import trusted_stress
from bemkit.testing.independent_check.check import Measured, measure
from bemkit.testing.independent_check.nodes import mean_normals
from bemkit.testing.independent_check.sides import Side

LIGHTEST = 1e-3
"""Bodies that carry less than this share of the largest stress of the assembly are measured by this share."""


@dataclass(frozen=True, eq=False)
class Joints:
    """The contacts of an assembly and the bodies that they join.

    Parameters
    ----------
    solution : AssemblySolution
    bodies : mapping of str to MeasuredBody
    pairs : mapping of str to ContactPair
        By name, those between elastic bodies.
    moving : mapping of str to ContactPair
        By name, those with rigid bodies that move.
    owner : mapping of str to str
        The side ``"body.part"`` whose nodes each contact of the table has.
    """

    solution: AssemblySolution
    bodies: Mapping[str, MeasuredBody]
    pairs: Mapping[str, ContactPair]
    moving: Mapping[str, ContactPair]
    owner: Mapping[str, str]

    @classmethod
    def of(cls, solution: AssemblySolution, before: AssemblySolution | None = None) -> Joints:
        """Measure the bodies of a solution, and find whose nodes the rows of its table are.

        What is left of the load step `before` is known no better than that was.
        """
        contacts = solution.assembly.contacts
        pairs = {pair.name: pair for pair in solution.assembly.elastic_contacts}
        moving = {pair.name: pair for pair in contacts if pair.name not in pairs}
        touched: dict[str, list[str]] = {name: [] for name in solution.bodies}
        for pair in contacts:
            for body, part in (side.split(".", 1) for side in pair.elastic_sides):
                touched[body].append(part)
        earlier = {} if before is None else before.bodies
        views = {
            name: MeasuredBody.of(body, tuple(touched[name]), earlier.get(name))
            for name, body in solution.bodies.items()
        }
        most = max(body.largest_stress for body in views.values())
        bodies = {name: body.measured_by(LIGHTEST * most) for name, body in views.items()}
        joints = cls(solution, bodies, pairs, moving, {})
        owner = {name: name for name in solution.contact.parts}
        owner |= {name: joints._owner(pairs[name]) for name in owner if name in pairs}
        owner |= {name: moving[name].elastic_sides[0] for name in owner if name in moving}
        return cls(solution, bodies, pairs, moving, owner)

    def _owner(self, pair: ContactPair) -> str:
        """Return the side on which all nodes of a contact lie, out of whose body the directions point."""
        table, own = self.solution.contact, self.solution.contact.rows(pair.name)
        points, directions = np.column_stack([table.x, table.y])[own], self.solution.contact_directions[own]
        misses = []
        for name in pair.sides:
            side = self.side(name)
            nodes = np.unique(side.body.boundary.nodes[side.elements])
            normals = mean_normals(side.body.fields.solution, side.body.boundary, name.split(".", 1)[1])[nodes]
            apart = np.linalg.norm(points[:, None] - side.body.result.boundary.points[nodes], axis=2)
            facing = np.sum(normals[apart.argmin(axis=1)] * directions, axis=1)
            misses.append(float(apart.min(axis=1).max() / side.body.result.mesh.diameter + np.mean(facing < 0.0)))
        return pair.sides[int(np.argmin(misses))]

    def side(self, name: str) -> Side:
        """Return the side ``"body.part"``."""
        body, part = name.split(".", 1)
        return Side(self.bodies[body], self.bodies[body].result.mesh.part(part))

    def partner(self, name: str) -> str | None:
        """Return the elastic side without the nodes, None of an obstacle."""
        if name not in self.pairs:
            return None
        one, two = self.pairs[name].sides
        return two if one == self.owner[name] else one

    def _law(self, name: str) -> FrictionLaw:
        if pair := self.pairs.get(name) or self.moving.get(name):
            return self.solution.assembly.law_of(pair)
        body, part = name.split(".", 1)
        return self.solution.bodies[body].scene.laws[part]

    def units(self) -> tuple[FloatArray, FloatArray]:
        """Return (n_contact,) lengths [m] and stresses [Pa] by which each row is measured."""
        length, stress = np.ones((2, self.solution.contact.n_contact))
        for name in self.solution.contact.parts:
            partner = self.partner(name)
            sides = [side for side in (self.owner[name], partner) if side is not None]
            bodies = [self.bodies[side.split(".", 1)[0]] for side in sides]
            scales = [body.scales for body in bodies]
            # a body that moves far passes on what is round-off there
            trusted = max(trusted_stress(body.fields.solution, body.fields.before) for body in bodies)
            rows = self.solution.contact.rows(name)
            length[rows] = max(each.length for each in scales)
            stress[rows] = max(min(each.stress for each in scales), trusted)
        return length, stress

    def measured(self, before: AssemblySolution | None) -> Measured:
        """Return the contact quantities that the laws speak of."""
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
        entries = ([getattr(part, entry.name) for part in parts] for entry in fields(Measured))
        return Measured(*(np.concatenate(entry)[order] for entry in entries))

    def _is_supported(self, name: str) -> BoolArray:
        """Return which nodes of a contact a support holds, or another obstacle of the body shares."""
        side, table = self.side(self.owner[name]), self.solution.contact
        points = np.column_stack([table.x, table.y])[table.rows(name)]
        nodes = side.body.supported_nodes()
        if name not in self.pairs:
            others = [
                side.body.boundary.nodes[side.body.result.mesh.part(part.name)].ravel()
                for part in side.body.result.scene.contact_parts
                if f"{side.body.result.name}.{part.name}" != name
            ]
            nodes = np.unique(np.concatenate([nodes, *others]))
        at = side.body.result.boundary.points[nodes]
        apart = np.linalg.norm(points[:, None] - at, axis=2).min(axis=1, initial=np.inf)
        return np.asarray(apart <= 1e-9 * side.body.result.mesh.diameter)
