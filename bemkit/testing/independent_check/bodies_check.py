"""The independent check of a scene: each body separately, each contact from both its sides, all forces together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.results.solution import Solution
from bemkit.results.solved_body import SideName
from bemkit.testing.independent_check.balance import trusted_work
from bemkit.testing.independent_check.check import contact_violations, is_finite, violations_of_body
from bemkit.testing.independent_check.distances import gap_mismatch, hidden_overlaps, mean_mismatch
from bemkit.testing.independent_check.interfaces import Interfaces
from bemkit.testing.independent_check.verdict import COARSE_LIMIT, COARSE_SHARE, Violations


@dataclass(frozen=True, kw_only=True)
class BodiesCheck(Violations):
    """Violations found in the fields of a scene, dimensionless; zero is perfect.

    Of reciprocity, with the moments, coarseness and the like the worst of all bodies is reported; hidden overlap is how
    deep points between nodes are in the partner, over the displacement that strains the body.

    Parameters
    ----------
    gaps : float
        Gaps of the table against distances measured again, of obstacles and of flat sides.
    means : float
        Mean relative displacements of flat sides against those of the table; its clearances against gaps.
    reactions : float
        Forces on the elements of a side against those of the table, with the opposite sign on the partner.
    rigid : float
        Motions and loads of rigid bodies against what is given, and the balance of each.
    between_nodes : float
        Excess of the overlap of both sides over that of the solution.
    """

    gaps: float
    means: float
    reactions: float
    rigid: float
    between_nodes: float

    @property
    def needs_warning(self) -> str:
        """Warnings that a solution must have: "reciprocity" or "hidden_overlap" of a coarse mesh."""
        if self.hidden_overlap > max(COARSE_LIMIT, COARSE_SHARE * self.coarseness):
            return "hidden_overlap"
        return "reciprocity" if self.is_coarse else ""


def violations_of_bodies(solution: Solution, before: Solution | None = None) -> BodiesCheck:
    """Check the fields of a scene; see `BodiesCheck`.

    Slip counts from the end of the load step before. Without that, friction against slip is not checked at the end of a
    load history.
    """
    if not is_finite(solution):
        return BodiesCheck.not_finite()
    joints = Interfaces.of(solution, before)
    bodies = joints.bodies.values()
    deepest, unsaid = hidden_overlaps(joints)
    return BodiesCheck(
        numbers=0.0,
        gaps=gap_mismatch(joints),
        means=mean_mismatch(joints),
        supports=max(body.supports() for body in bodies),
        **contact_violations(joints.measured(before), solution, knows_slip=before is not None),
        reactions=reaction_mismatch(joints),
        equilibrium=largest_imbalance(joints),
        negative_energy=max(body.negative_energy() for body in bodies),
        energy=energy_mismatch(joints),
        elasticity=max(body.elasticity() for body in bodies),
        rigid=rigid_mismatch(joints),
        between_nodes=unsaid,
        reciprocity=max(max(body.reciprocity(), body.moment()) for body in bodies),
        coarseness=max(body.coarseness for body in bodies),
        hidden_overlap=deepest,
    )


def violations_of(step: Solution, before: Solution | None) -> Violations:
    """Check a solution of one body or of several, of a load history with the step before it.

    Slip counts from the last increment, which is unknown if the step was divided into several.
    """
    if step.loading is not None and step.loading.steps[-1].n_increments > 1:
        before = None
    if len(step.bodies) > 1 or step.scene.contacts:
        return violations_of_bodies(step, before)
    return violations_of_body(step, before)


def forces(joints: Interfaces) -> dict[SideName, tuple[FloatArray, float]]:
    """Return the resultant (2,) and size [N/m] of the forces on each side of the table."""
    table, found = joints.solution.contact, dict[SideName, tuple[FloatArray, float]]()
    acting = _nodal(joints)
    for name in table.parts:
        own = acting[table.rows(name)]
        for side, sign in ((joints.owner(name), 1.0), (joints.partner(name), -1.0)):
            if side is not None:
                force, size = found.get(side, (np.zeros(2), 0.0))
                found[side] = force + sign * own.sum(axis=0), size + float(np.abs(own).sum())
    return found


def _nodal(joints: Interfaces) -> FloatArray:
    """Return the forces (n_contact, 2) [N/m] on the bodies with the nodes."""
    table, normal = joints.solution.contact, joints.solution.contact_directions
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    return np.asarray(table.weight[:, None] * (table.sigma_n[:, None] * normal + table.sigma_t[:, None] * tangent))


def rigid_mismatch(joints: Interfaces) -> float:
    """Return the largest difference [-] of the motions and loads of rigid bodies from the prescribed ones.

    The load on each balances its contacts, at the points that the nodes may touch.
    """
    solution, table, worst = joints.solution, joints.solution.contact, [0.0]
    points, acting = np.column_stack([table.x, table.y]), _nodal(joints)
    for body in solution.scene.rigid:
        total, size, found = np.zeros(3), 0.0, solution.rigid[body.name]
        for name, pair in joints.moving.items():
            if pair.rigid_body != body.name or name not in table.parts:
                continue
            rows = table.rows(name) & np.isfinite(table.gap)
            distance = (table.gap[rows] - pair.gap_at(points[rows]))[:, None] * solution.contact_directions[rows]
            arm, force = points[rows] + distance - body.centre, acting[rows]
            total += [*force.sum(axis=0), float(np.sum(arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]))]
            scales = joints.side(joints.owner(name)).body.scales
            size += float(np.abs(force).sum()) + scales.stress * float(table.weight[rows].min())
        reach = np.array([1.0, 1.0, max(each.result.mesh.diameter for each in joints.bodies.values())])
        reaction = np.array([found.force_x, found.force_y, found.moment]) / solution.scene.depth
        unexplained = (
            reaction - total,
            np.where(body.is_load_controlled, reaction - solution.scene.load_on(body), 0.0),
        )
        worst += [float(np.abs(each / reach).max()) / (size or 1.0) for each in unexplained]
        motion = np.array([found.x, found.y, found.turn])
        worst.append(float(np.abs(np.where(body.is_load_controlled, 0.0, motion - body.motion)).max()))
    return float(np.max(worst))


def reaction_mismatch(joints: Interfaces) -> float:
    """Return the largest difference [-] of the forces on the elements of a side from those of its contacts."""
    worst = [0.0]
    for name, (force, size) in forces(joints).items():
        side = joints.side(name)
        force_on_elements, size_on_elements = side.body.force_on(side.elements)
        unit = size + size_on_elements + side.body.scales.stress * float(side.body.boundary.lengths.min())
        if not np.isin(side.body.boundary.nodes[side.elements], side.body.supported_nodes()).any():
            worst.append(float(np.abs(force_on_elements - force).max()) / unit)
    return float(np.max(worst))


def largest_imbalance(joints: Interfaces) -> float:
    """Return the largest resultant on a body [-], of its loads, contacts and forces inside."""
    total = {name: (np.zeros(2), 0.0) for name in joints.bodies}
    for name, (force, size) in forces(joints).items():
        total[name.body] = total[name.body][0] + force, total[name.body][1] + size
    return max(body.imbalance(*total[name]) for name, body in joints.bodies.items())


def energy_mismatch(joints: Interfaces) -> float:
    """Return the difference [-] of the elastic energy from half the work of loads and contacts.

    As for one body nothing is compared where displacements are given or forces act inside, nor where half-planes move
    or are loaded far away.
    """
    work = size = 0.0
    for body in joints.bodies.values():
        given = any(np.any(held.values != 0.0) for held in body.boundary.held)
        if body.result.scene.body_forces or body.result.scene.far is not None or given:
            return 0.0
        is_load = ~body.is_touched
        for elements, _, _ in body.boundary.held:
            is_load[elements] = False
        forces = np.where(is_load[:, None], body.boundary.shares, 0.0)[..., None] * body.boundary.traction
        each = forces * body.boundary.interpolated(body.result.boundary.displacement)
        work, size = work + 0.5 * float(each.sum()), size + 0.5 * float(np.abs(each).sum())
        size += 1e-3 * body.scales.stress * body.scales.length * body.result.mesh.diameter + trusted_work(body.fields)
    table = joints.solution.contact
    each = table.weight[:, None] * np.column_stack([table.sigma_n * table.u_n, table.sigma_t * table.u_t])
    work, size = work + 0.5 * float(each.sum()), size + 0.5 * float(np.abs(each).sum())
    depth = joints.solution.scene.depth
    for found in joints.solution.rigid.values():  # relative displacements exclude the motion of obstacles
        of_motion = np.array([found.force_x * found.x, found.force_y * found.y, found.moment * found.turn]) / depth
        work, size = work + 0.5 * float(of_motion.sum()), size + 0.5 * float(np.abs(of_motion).sum())
    return abs(joints.solution.energy / depth - work) / size if size > 0.0 else 0.0
