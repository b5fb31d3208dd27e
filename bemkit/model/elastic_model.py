"""Scenes without contact: one linear solve, certified by the equilibrium of all forces."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState
from bemkit.contact.certificate import Certificate
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.model.boundary_data import Units, find_units, nodal_forces, supports_on
from bemkit.model.contact_model import check_position, check_same_body, elastic_map, physical_fields
from bemkit.operators.counts import Work
from bemkit.operators.equilibrium import Imbalance, resultant_imbalance, round_off_of
from bemkit.operators.rigid_modes import possible_motions
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, supported, unsupported_motions
from bemkit.plan import Plan, make_plan
from bemkit.scene.scene import Scene
from bemkit.scene.symmetry import check_symmetry
from bemkit.solvers.base import ContactSolution, Status, StepRecord

_TOLERANCE = 1e-9
"""Of the certificate, as for contact."""
_STRAIGHT = 1e-9
"""A free motion that turns by less than this does not turn."""


class FreeBodyError(InputError):
    """Supports that leave the body free to move, where no contact could hold it."""


@dataclass(frozen=True, eq=False)
class ElasticModel:
    """A scene without contact, made ready to solve; compare `bemkit.model.contact_model.Model`.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh
        In physical units.
    units : Units
    elastic : SteklovPoincare
        Dimensionless.
    conditions : NodalConditions
        Supports; every other direction is free.
    force : (n_nodes, 2) array [-]
        Given nodal forces.
    condensed : CondensedMap
        Without open directions: all that is unknown has been solved for.
    """

    scene: Scene
    mesh: BoundaryMesh
    units: Units
    elastic: SteklovPoincare
    conditions: NodalConditions
    force: FloatArray
    condensed: CondensedMap

    @property
    def work(self) -> Work:
        """What it took to come here, from the operators on."""
        return self.condensed.work

    def under(self, scene: Scene) -> ElasticModel:
        """Return the same body under the loads of another scene; nothing is factored again.

        Parameters
        ----------
        scene : Scene
            Differs from this model's in numbers of its conditions alone.

        Raises
        ------
        ValueError
            If the scene has another body, other parts, or other kinds of conditions.
        """
        check_same_body(self.scene, scene)
        check_symmetry(scene, self.mesh)
        space = self.elastic.displacement_space
        conditions = supported(space, supports_on(scene, self.mesh, self.units, space))
        force = nodal_forces(scene, self.mesh, space, self.units)
        condensed = self.condensed.under(force, conditions.displacement)
        condensed = replace(condensed, work=self.condensed.work + condensed.work)
        return replace(self, scene=scene, conditions=conditions, force=force, condensed=condensed)

    def boundary_fields(self) -> tuple[FloatArray, FloatArray, float]:
        """Return displacement (n_nodes, 2) [m], traction (n_elements, 2) [Pa] and energy [J/m] of the boundary."""
        displacement, force = self._fields
        traction = self.elastic.element_tractions(displacement, force)
        return physical_fields(self.scene, self.mesh, self.units, displacement, force, traction)

    @property
    def _fields(self) -> tuple[FloatArray, FloatArray]:
        return self.condensed.recover(np.zeros(0))

    def certified(self) -> ContactSolution:
        """Return the verdict on the solution, in the form in which contact problems have theirs.

        Returns
        -------
        ContactSolution
            Without contact nodes. CONVERGED if all forces are in equilibrium.
        """
        displacement, force = self._fields
        certificate = self._certificate(displacement, force)
        if not np.isfinite(displacement).all():
            status, message = Status.NOT_FINITE, Status.NOT_FINITE.value
        elif certificate.is_below(_TOLERANCE):
            status, message = Status.CONVERGED, "All forces are in equilibrium to the tolerance asked for."
        else:
            status = Status.STALLED
            message = "Round-off leaves the forces out of equilibrium; use fewer or less unequal elements."
        message += f" [worst certificate entry {certificate.worst:.1e}]"
        record = StepRecord(0, 1, certificate, float("inf"), 0, 0, 0, 0, "")
        none = np.zeros((0, 2))
        return ContactSolution(
            ContactState(none, none), status, certificate, np.zeros(0, np.intp), 0, 1, message, (record,)
        )

    def _certificate(self, displacement: FloatArray, force: FloatArray) -> Certificate:
        points = dof_points(self.elastic.displacement_space)
        round_off = round_off_of(displacement, self.condensed.sensitivity)
        balanced = possible_motions(self.elastic.displacement_space.mesh)
        total = float(np.abs(force).sum()) or 1.0
        missing = np.einsum("nkc,nc->nk", self.conditions.frame, force - self.force)[self.conditions.is_free]
        residual = Imbalance(float(np.abs(missing).max(initial=0.0)) / total, 0.0, round_off / total)
        off = residual.joined(resultant_imbalance(points, force, balanced, round_off))
        return Certificate(0.0, 0.0, 0.0, 0.0, 0.0, off.force, off.moment, off.round_off)


def build_elastic_model(
    scene: Scene, mesh: BoundaryMesh, units: Units | None = None, plan: Plan | None = None
) -> ElasticModel:
    """Assemble the operators of a scene without contact and solve.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh
        As made by `Scene.build_mesh`, or a refinement of it.
    units : Units, optional
        By default `find_units` of the scene.
    plan : Plan, optional
        Whose decisions are followed; by default those for the scene.

    Returns
    -------
    ElasticModel

    Raises
    ------
    FreeBodyError
        If the supports leave a rigid motion free, which the message names.
    TooFarError, ConflictingSupportsError, SingularMatrixError, ValueError
        As for `bemkit.model.contact_model.build_model`.
    """
    check_position(mesh)
    check_symmetry(scene, mesh)
    units = find_units(scene, mesh) if units is None else units
    plan = make_plan(scene, mesh) if plan is None else plan
    elastic = elastic_map(plan.decisions, mesh.unit, scene.material.scaled(units.modulus))
    space = elastic.displacement_space
    conditions = supported(space, supports_on(scene, mesh, units, space))
    _check_held(space, conditions, units)
    force = nodal_forces(scene, mesh, space, units)
    condensed = elastic.condense(conditions, force)
    return ElasticModel(scene, mesh, units, elastic, conditions, force, condensed)


def _check_held(space: BoundarySpace, conditions: NodalConditions, units: Units) -> None:
    """Refuse supports that leave a rigid motion free."""
    motions = unsupported_motions(space, conditions)
    if not len(motions):
        return
    x, y = dof_points(space).T
    one, none = np.ones_like(x), np.zeros_like(x)
    basis = np.stack([[one, none], [none, one], [-y, x]], axis=2).transpose(1, 0, 2).reshape(-1, 3)
    # (n_motions, 3): shift of the centre, and turn
    free = np.linalg.lstsq(basis, motions.reshape(len(motions), -1).T, rcond=None)[0].T
    raise FreeBodyError(
        f"nothing holds the body: it may {_named(free, units)}; give it a part that is clamped, a roller, in contact "
        "or of given displacement, or a symmetry"
    )


def _named(free: FloatArray, units: Units) -> str:
    """Say how a body may move: by the shifts of its centre and the turns (n_motions, 3) of a basis of its motions."""
    size = float(np.linalg.norm(free[:, 2]))
    turns = size > _STRAIGHT
    if turns:  # a basis in which only the first motion turns
        directions = np.linalg.svd(free[None, :, 2] / size)[2]
        free = directions @ free
    shifts = free[int(turns) :, :2]
    words = []
    if len(shifts) == 2:
        words.append("move in any direction")
    elif len(shifts):
        x, y = (shifts[0] / np.linalg.norm(shifts[0])).tolist()
        is_axis = min(abs(x), abs(y)) < _STRAIGHT
        words.append(f"move along {'xy'[abs(y) > abs(x)] if is_axis else f'({x:.3g}, {y:.3g})'}")
    if turns and len(shifts):
        words.append("turn")
    elif turns:
        pivot = units.to_physical(np.array([-free[0, 1], free[0, 0]]) / free[0, 2])
        x, y = np.where(np.abs(pivot) < _STRAIGHT * units.length, 0.0, pivot).tolist()
        words.append(f"turn about ({x:.4g}, {y:.4g})")
    return " and ".join(words)
