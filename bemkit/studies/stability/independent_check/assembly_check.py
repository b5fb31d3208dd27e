"""The independent check of an assembly: each body alone, each contact from both its sides, all forces together."""

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
from bemkit.scene.conditions import Contact
from bemkit.studies.stability.independent_check.bodies import MeasuredBody
from bemkit.studies.stability.independent_check.boundary import EPSILON, beyond, largest, trusted_stress
from bemkit.studies.stability.independent_check.check import Measured, measure, slip_opposition, status_mismatch
from bemkit.studies.stability.independent_check.joints import Side, measure_flat, sampled_overlap
from bemkit.studies.stability.independent_check.nodes import distance_to, mean_normals
from bemkit.studies.stability.independent_check.verdict import COARSE_LIMIT, COARSE_SHARE, Entries

_LIGHTEST = 1e-3
"""Contacts of bodies that carry less than this share of the largest stress are measured by this share."""


@dataclass(frozen=True, kw_only=True)
class AssemblyCheck(Entries):
    """Violations found in the fields of an assembly, dimensionless; zero is perfect.

    Parameters
    ----------
    numbers : float
        Infinite if a field holds a number that is not finite, zero otherwise.
    gaps : float
        Gaps of the table against distances measured again, of obstacles and of flat sides.
    means : float
        Mean relative displacements of flat sides against those of the table; its clearances against gaps.
    supports : float
        Held displacements and loads against what is given.
    penetration, tension, complementarity, cone_excess, slip_opposition, status : float
        See `IndependentCheck`.
    reactions : float
        Forces that the elements of a side feel, against what the table says, with the other sign on the partner's.
    equilibrium : float
        Resultant of loads, contacts and forces inside on each body, along free translations.
    negative_energy, energy : float
        Elastic energy of a body below zero; of all against half the work of loads and of contacts.
    reciprocity, coarseness, hidden_overlap
        See `Entries`: the worst of the bodies, the moments on them among them; how deep points between nodes are in
        the partner, over the displacement that strains the body.
    """

    numbers: float
    gaps: float
    means: float
    supports: float
    penetration: float
    tension: float
    complementarity: float
    cone_excess: float
    slip_opposition: float
    status: float
    reactions: float
    equilibrium: float
    negative_energy: float
    energy: float

    @property
    def needs_warning(self) -> str:
        """What a solution must warn of: "reciprocity" or "hidden_overlap" of a coarse mesh."""
        if self.hidden_overlap > max(COARSE_LIMIT, COARSE_SHARE * self.coarseness):
            return "hidden_overlap"
        return "reciprocity" if self.is_coarse else ""


def check_assembly(solution: AssemblySolution, before: AssemblySolution | None = None) -> AssemblyCheck:
    """Check the fields of an assembly; see `AssemblyCheck`. Slip counts from the end of the load step before."""
    if not _is_finite(solution):
        unknown = dict.fromkeys((entry.name for entry in fields(AssemblyCheck)), float("nan"))
        return AssemblyCheck(**{**unknown, "numbers": float("inf")})
    joints = Joints.of(solution)
    measured = joints.measured(before)
    bodies = joints.bodies.values()
    return AssemblyCheck(
        numbers=0.0,
        gaps=joints.gap_mismatch(),
        means=joints.mean_mismatch(),
        supports=max(body.supports() for body in bodies),
        penetration=largest(-measured.clearance),
        tension=largest(-measured.pressure),
        complementarity=largest(np.minimum(measured.held, np.abs(measured.clearance))),
        cone_excess=largest((np.abs(measured.shear) - measured.bound)[measured.obeys_friction]),
        slip_opposition=slip_opposition(measured),
        status=status_mismatch(solution.contact.status, measured),
        reactions=joints.reaction_mismatch(),
        equilibrium=joints.imbalance(),
        negative_energy=max(body.negative_energy() for body in bodies),
        energy=joints.energy_mismatch(),
        reciprocity=max(max(body.reciprocity(), body.moment()) for body in bodies),
        coarseness=max(body.coarseness for body in bodies),
        hidden_overlap=joints.hidden_overlap(),
    )


def _is_finite(solution: AssemblySolution) -> bool:
    columns = solution.contact.columns()
    distances = [columns.pop(name) for name in ("gap", "clearance")]
    of_bodies = (
        field
        for body in solution.bodies.values()
        for field in (body.boundary.displacement, body.boundary.traction_dofs, np.array(body.energy))
    )
    is_finite = all(bool(np.isfinite(field).all()) for field in (*columns.values(), *of_bodies))
    return is_finite and not any(np.isnan(field).any() for field in distances)


@dataclass(frozen=True, eq=False)
class Joints:
    """The contacts of an assembly and the bodies that they join.

    Parameters
    ----------
    solution : AssemblySolution
    bodies : mapping of str to MeasuredBody
    pairs : mapping of str to ContactPair
        By name, those between bodies.
    owner : mapping of str to str
        The side ``"body.part"`` whose nodes each contact of the table has.
    """

    solution: AssemblySolution
    bodies: Mapping[str, MeasuredBody]
    pairs: Mapping[str, ContactPair]
    owner: Mapping[str, str]

    @classmethod
    def of(cls, solution: AssemblySolution) -> Joints:
        """Measure the bodies of a solution, and find whose nodes the rows of its table are."""
        pairs = {pair.name: pair for pair in solution.assembly.contacts}
        touched: dict[str, list[str]] = {name: [] for name in solution.bodies}
        for pair in pairs.values():
            for body, part in (side.split(".", 1) for side in pair.sides):
                touched[body].append(part)
        bodies = {name: MeasuredBody.of(body, tuple(touched[name])) for name, body in solution.bodies.items()}
        joints = cls(solution, bodies, pairs, {})
        owner = {name: joints._owner(pairs[name]) if name in pairs else name for name in solution.contact.parts}
        return cls(solution, bodies, pairs, owner)

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
        """Return the side without the nodes, None of an obstacle."""
        if name not in self.pairs:
            return None
        one, two = self.pairs[name].sides
        return two if one == self.owner[name] else one

    def _law(self, name: str) -> FrictionLaw:
        if name in self.pairs:
            return self.solution.assembly.law_of(self.pairs[name])
        body, part = name.split(".", 1)
        return self.solution.bodies[body].scene.laws[part]

    def units(self) -> tuple[FloatArray, FloatArray]:
        """Return (n_contact,) lengths [m] and stresses [Pa] by which each row is measured."""
        length, stress = np.ones((2, self.solution.contact.n_contact))
        most = max(body.scales.stress for body in self.bodies.values())
        for name in self.solution.contact.parts:
            partner = self.partner(name)
            sides = [side for side in (self.owner[name], partner) if side is not None]
            bodies = [self.bodies[side.split(".", 1)[0]] for side in sides]
            scales = [body.scales for body in bodies]
            # a body that moves far passes on what is round-off there
            trusted = max(trusted_stress(body.fields.solution) for body in bodies)
            rows = self.solution.contact.rows(name)
            length[rows] = max(each.length for each in scales)
            stress[rows] = max(min(each.stress for each in scales), trusted, _LIGHTEST * most)
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
            law = self._law(name).at(points[rows])
            supported = self._is_supported(name)
            parts.append(measure(own, law, own.u_n, slip[rows], supported, (units[0][rows], units[1][rows])))
        order = np.argsort(np.concatenate([np.flatnonzero(table.rows(name)) for name in table.parts]))
        entries = ([getattr(part, entry.name) for part in parts] for entry in fields(Measured))
        return Measured(*(np.concatenate(entry)[order] for entry in entries))

    def _is_supported(self, name: str) -> BoolArray:
        """Tell which nodes of a contact a support holds, or another obstacle of the body shares."""
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

    def gap_mismatch(self) -> float:
        """Return the largest difference [-] of gaps from distances measured again."""
        table, worst = self.solution.contact, [0.0]
        length, _ = self.units()
        for name in table.parts:
            rows = table.rows(name)
            scales = self.side(self.owner[name]).body.scales
            partner = self.partner(name)
            if partner is not None:
                gap = self.pairs[name].gap
                flat = measure_flat(self.side(self.owner[name]), self.side(partner), gap)
                if flat is None:
                    continue
                differences = np.abs(table.gap[rows] - flat.distance - gap)
            else:
                differences = self._from_obstacle(name)
            coordinates = max(scales.coordinates, 64.0 * EPSILON * float(np.abs([table.x, table.y]).max()))
            worst.append(beyond(differences, coordinates, float(length[rows][0])))
        return float(np.max(worst))

    def _from_obstacle(self, name: str) -> FloatArray:
        """Return differences [m] of gaps from the distances of a rigid obstacle."""
        table, rows = self.solution.contact, self.solution.contact.rows(name)
        points = np.column_stack([table.x, table.y])[rows]
        body, part = name.split(".", 1)
        measured = self.bodies[body]
        nodes = np.linalg.norm(points[:, None] - measured.result.boundary.points, axis=2).argmin(axis=1)
        normals = mean_normals(measured.fields.solution, measured.boundary, part)[nodes]
        (condition,) = (each.condition for each in measured.result.scene.parts if each.name == part)
        assert isinstance(condition, Contact)
        distance, _ = distance_to(condition.obstacle, points, normals)
        known = np.isfinite(table.gap[rows])
        return np.abs(table.gap[rows] - distance)[known]

    def mean_mismatch(self) -> float:
        """Return the largest difference [-] of relative displacements of flat sides from their means in the table."""
        table, worst = self.solution.contact, [0.0]
        lengths, _ = self.units()
        known = np.isfinite(table.gap)
        clearance = np.abs(table.clearance - (table.gap - table.u_n))[known]
        worst.append(largest(clearance / lengths[known]))
        for name in table.parts:
            rows, partner = table.rows(name), self.partner(name)
            if partner is None:
                continue
            flat = measure_flat(self.side(self.owner[name]), self.side(partner), self.pairs[name].gap)
            weight = table.weight[rows]
            if flat is None or abs(weight.sum() - flat.length) > 1e-9 * flat.length:
                continue  # slivers beside nodes that others hold carry no multiplier
            sums = np.array([weight @ table.u_n[rows], weight @ table.u_t[rows]])
            turned = max(self.side(side).body.scales.turned for side in self.pairs[name].sides)
            worst.append(beyond(np.abs(sums - flat.means) / flat.length, turned, float(lengths[rows][0])))
        return float(np.max(worst))

    def forces(self) -> dict[str, tuple[FloatArray, float]]:
        """Return the resultant (2,) and size [N/m] of the forces on each side of the table."""
        table, found = self.solution.contact, dict[str, tuple[FloatArray, float]]()
        normal = self.solution.contact_directions
        tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
        acting = table.weight[:, None] * (table.sigma_n[:, None] * normal + table.sigma_t[:, None] * tangent)
        for name in table.parts:
            own = acting[table.rows(name)]
            for side, sign in ((self.owner[name], 1.0), (self.partner(name), -1.0)):
                if side is not None:
                    force, size = found.get(side, (np.zeros(2), 0.0))
                    found[side] = force + sign * own.sum(axis=0), size + float(np.abs(own).sum())
        return found

    def reaction_mismatch(self) -> float:
        """Return the largest difference [-] of what the elements of a side feel from what its contacts transmit."""
        worst = [0.0]
        for name, (force, size) in self.forces().items():
            side = self.side(name)
            felt, felt_size = side.body.force_on(side.elements)
            unit = size + felt_size + side.body.scales.stress * float(side.body.boundary.lengths.min())
            if not np.isin(side.body.boundary.nodes[side.elements], side.body.supported_nodes()).any():
                worst.append(float(np.abs(felt - force).max()) / unit)
        return float(np.max(worst))

    def imbalance(self) -> float:
        """Return the largest resultant on a body [-], of its loads, contacts and forces inside."""
        total = {name: (np.zeros(2), 0.0) for name in self.bodies}
        for name, (force, size) in self.forces().items():
            body = name.split(".", 1)[0]
            total[body] = total[body][0] + force, total[body][1] + size
        return max(body.imbalance(*total[name]) for name, body in self.bodies.items())

    def energy_mismatch(self) -> float:
        """Return the difference [-] of the elastic energy from half the work of loads and contacts.

        As for one body nothing is compared where displacements are given or forces act inside.
        """
        work = size = 0.0
        for body in self.bodies.values():
            given = any(np.any(held.values != 0.0) for held in body.boundary.held)
            if body.result.scene.body_forces or given:
                return 0.0
            is_load = ~body.is_touched
            for elements, _, _ in body.boundary.held:
                is_load[elements] = False
            forces = np.where(is_load[:, None], body.boundary.shares, 0.0)[..., None] * body.boundary.traction
            each = forces * body.boundary.interpolated(body.result.boundary.displacement)
            work, size = work + 0.5 * float(each.sum()), size + 0.5 * float(np.abs(each).sum())
            motion = float(np.abs(body.result.boundary.displacement).max())
            size += 1e-3 * body.scales.stress * (body.scales.length + 1e-3 * motion) * body.result.mesh.diameter
        table = self.solution.contact
        each = table.weight[:, None] * np.column_stack([table.sigma_n * table.u_n, table.sigma_t * table.u_t])
        work, size = work + 0.5 * float(each.sum()), size + 0.5 * float(np.abs(each).sum())
        return abs(self.solution.energy - work) / size if size > 0.0 else 0.0

    def hidden_overlap(self) -> float:
        """Return how deep points of one side are in the other one, over the displacement that strains the bodies."""
        worst = [0.0]
        for pair in self.pairs.values():
            one, two = (self.side(name) for name in pair.sides)
            flat = measure_flat(one, two, pair.gap)
            reach = 0.25 * min(one.body.result.mesh.diameter, two.body.result.mesh.diameter)
            overlap = sampled_overlap(one, two, pair.gap, reach) if flat is None else flat.overlap
            worst.append(overlap / max(one.body.scales.length, two.body.scales.length))
        return float(np.max(worst))
