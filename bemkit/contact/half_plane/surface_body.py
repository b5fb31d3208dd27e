"""Base of all half-planes as a `LinearBody`: tractions on elements, and rigid motions far away.

The displacement of the surface is ``u = F t + u_0 + R q``: F t is caused by the unknown tractions t of contact and
supports, u_0 by the given forces and motions, and R q are the motions that forces far away drive, whose work with all
tractions is known. Vectors are complex numbers: at contact nodes the tangential component is the real part and the
normal one the imaginary part, as in `ReducedConditions`; at supports these are those of the surface.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.contact.body import ContactState, FreeMotion, LinearBody, separated
from bemkit.contact.contact_nodes import ContactNodes
from bemkit.contact.equilibrium import Imbalance
from bemkit.contact.reduced_conditions import ReducedConditions, as_complex, as_pairs
from bemkit.geometry.spaces import dof_points
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.counts import OperationCounts
from bemkit.operators.half_plane.surface import SurfaceElasticity
from bemkit.operators.linear_solvers import SingularMatrixError
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions

_ROUND_OFF = 1e-10
"""Share of a motion that counts as none."""
_NOISE = 16.0 * float(np.finfo(float).eps)
"""Round-off of a displacement, relative to the largest."""


@dataclass(frozen=True, eq=False)
class SurfaceBody(LinearBody):
    """A half-plane with its contact nodes and supports.

    Parameters
    ----------
    elastic : SurfaceElasticity
    conditions : NodalConditions
        Of the elements; none is both in contact and held.
    nodes : ContactNodes
    force : (n_nodes, 2) array [N/m]
        Given nodal forces in x and y, beside the contact nodes.

    Raises
    ------
    SingularMatrixError
        If loads far away drive a motion that neither contact nor supports could resist.
    """

    elastic: SurfaceElasticity
    conditions: NodalConditions
    nodes: ContactNodes
    force: FloatArray

    condensed = None
    """No stiffness is formed."""

    def __post_init__(self) -> None:
        _check_resisted(self)

    @property
    def weights(self) -> FloatArray:  # type: ignore[override]  # read-only here
        """(n_contact,) array [m]: lengths of the elements."""
        return self.nodes.weights

    @cached_property
    def stiffness_scale(self) -> float:
        """E' by the median length of an element [Pa/m]."""
        lengths = self.weights if self.n_contact else self.elastic.mesh.lengths
        return self.elastic.material.plane_modulus / float(np.median(lengths))

    @property
    def work(self) -> OperationCounts:
        """Integrals of the surface, and the order of the contact system."""
        return self.elastic.work + OperationCounts(contact_unknowns=2 * self.n_contact)

    def under(self, force: FloatArray, displacement: FloatArray, inside: ForcesInside | None = None) -> SurfaceBody:
        """Return the same body under other nodal forces in x and y, and displacements of supports in their frames."""
        return replace(self, force=force, conditions=replace(self.conditions, displacement=displacement))

    @cached_property
    def acting(self) -> IntArray:
        """(n_acting,) array: elements with unknown tractions, first those in contact, then those held."""
        return np.concatenate([self.nodes.nodes, self._held])

    @cached_property
    def _held(self) -> IntArray:
        return np.flatnonzero(self.conditions.is_fixed.any(axis=1))

    @cached_property
    def turn(self) -> ComplexArray:
        """(n_acting,) array: the direction of the real part at each of them; one along the surface."""
        return np.append(self.elastic.to_complex(self.nodes.frame[:, 1]), np.ones(self._held.size))

    def on_surface(self, numbers: ComplexArray) -> ComplexArray:
        """Return a field at the acting elements, in their frames, as one on all elements, zero elsewhere."""
        field = np.zeros(self.elastic.mesh.n_elements, complex)
        field[self.acting] = numbers * self.turn
        return field

    def at_acting(self, field: ComplexArray) -> ComplexArray:
        """Return a field on all elements at the acting ones, in their frames."""
        return np.asarray(field[self.acting] * self.turn.conj())

    def displacement_by(self, traction: ComplexArray) -> ComplexArray:
        """Return the displacements (n_acting,) that tractions (n_acting,) cause."""
        return self.at_acting(self.elastic.displaced(self.on_surface(traction)))

    @cached_property
    def _unit_motions(self) -> ComplexArray:
        """(3, n_elements) array: unit motions along x and y and a unit turn, all over the surface."""
        at_elements = self.elastic.far_motion.motions_at(dof_points(self.elastic.displacement_space))
        return np.asarray(np.einsum("c,ncm->mn", self.elastic.axes, at_elements))

    @cached_property
    def motions(self) -> ComplexArray:
        """(n_driven, n_acting) array: the motions that forces far away drive."""
        return np.asarray(
            self._unit_motions[list(self.elastic.far_motion.load_controlled)][:, self.acting] * self.turn.conj()
        )

    @cached_property
    def works(self) -> ComplexArray:
        """(n_driven, n_acting) array: weighted driven motions; the real part of a product with tractions is work."""
        return np.asarray(self.elastic.mesh.lengths[self.acting] * self.motions.conj())

    @cached_property
    def load(self) -> FloatArray:
        """(n_driven,) array: the work of all given forces on the driven motions."""
        far_motion = self.elastic.far_motion
        of_force = (self._unit_motions.conj() @ self.elastic.to_complex(self.force)).real
        return np.asarray((np.array(far_motion.load) + of_force)[list(far_motion.load_controlled)])

    @cached_property
    def _displacement_at_rest(self) -> ComplexArray:
        """(n_elements,) array [m]: displacements under the given forces and motions."""
        elastic, far_motion = self.elastic, self.elastic.far_motion
        of_force = elastic.to_complex(elastic.strain_displacement(self.force))
        along = elastic.to_complex(dof_points(elastic.displacement_space) - np.array(far_motion.centre)).real
        return np.asarray(of_force + np.array(far_motion.motion) @ self._unit_motions + far_motion.strain * along)

    @cached_property
    def rest(self) -> ComplexArray:
        """(n_acting,) array [m]: the same at the acting elements."""
        return self.at_acting(self._displacement_at_rest)

    @cached_property
    def _supports(self) -> LinearConditions:
        """Conditions on held elements: displacements in some directions, zero reactions in others."""
        held, conditions = self._held, self.conditions
        along = as_pairs(self.elastic.to_complex(conditions.frame[held]))
        is_fixed = conditions.is_fixed[held]
        value = np.where(is_fixed, conditions.displacement[held], 0.0)
        on_displacement, on_traction = (np.where(rows[:, :, None], along, 0.0) for rows in (is_fixed, ~is_fixed))
        return LinearConditions(on_displacement, on_traction, value)

    @cached_property
    def _free(self) -> FloatArray:
        """(n_motions, n_driven) array: combinations of the driven motions that no support resists."""
        moved, n_motions = as_pairs(self.motions[:, self.n_contact :]), len(self.motions)
        if not moved.size:
            return np.eye(n_motions)
        changes = np.einsum("nij,mnj->nim", self._supports.on_displacement, moved).reshape(-1, n_motions)
        _, singular, directions = np.linalg.svd(np.linalg.qr(changes, mode="r"))
        return np.asarray(directions[np.count_nonzero(singular > _ROUND_OFF * singular.max(initial=1.0)) :])

    def rigid_motions(self) -> FloatArray:
        """Return the motions that forces far away drive and no support resists."""
        return as_pairs(self._free @ self.motions[:, : self.n_contact])

    def rigid_load(self) -> FloatArray:
        """Return the work of these forces, and of those given on the surface."""
        return np.asarray(self._free @ self.load)

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return the response; see `LinearBody.respond`."""
        if len(conditions.free_motions(self.rigid_motions())):
            raise FreeMotion
        traction, motion = self._solved(ReducedConditions.of(_joined(conditions, self._supports)))
        displacement, n = self.rest + self.displacement_by(traction) + motion @ self.motions, self.n_contact
        return ContactState(
            conditions.with_given_displacements(as_pairs(displacement[:n])),
            conditions.with_given_tractions(as_pairs(traction[:n])),
        )

    def _solved(self, reduced: ReducedConditions) -> tuple[ComplexArray, FloatArray]:
        """Return tractions (n_acting,) and driven motions (n_driven,).

        A long rigid motion is subtracted first, since the deformation would lose digits beside it.
        """
        known = reduced.given
        if reduced.n_unknowns == 0:
            return known, np.zeros(len(self.motions))
        right = reduced.value - reduced.rows(self.rest + self.displacement_by(known), known)
        columns = [reduced.rows(motion, np.zeros_like(known)) for motion in self.motions]
        travel, right = _fitted(columns, right)
        unknowns, motion = self.solve(reduced, right, self.motions, -self.load - (self.works @ known).real)
        return reduced.tractions(unknowns), travel + motion

    @abstractmethod
    def solve(
        self, reduced: ReducedConditions, right: FloatArray, motions: ComplexArray, load: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Solve for unknown tractions (n_unknowns,) and amounts of motions (n_motions,).

        Parameters
        ----------
        reduced : ReducedConditions
            Of the acting elements.
        right : (n_unknowns,) array [m]
            Left-hand sides of the equations of the unknown tractions.
        motions : (n_motions, n_acting) array
            Those that follow: all the driven ones, or none.
        load : (n_motions,) array
            Work of the unknown tractions on these motions.

        Raises
        ------
        SingularResponse
            If the equations do not determine the unknowns.
        """

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return the largest displacement that is missing, and the work of all forces on the driven motions.

        The former relative to the largest displacement beside driven motions, the latter to the sum of all forces; see
        `LinearBody.imbalance`.
        """
        traction, _, misfit = self._completed(state)
        lengths = self.elastic.mesh.lengths[self.acting]
        total = float(np.abs(lengths * traction).sum() + np.abs(self.force).sum())
        work = float(np.abs((self.works @ traction).real + self.load).max(initial=0.0))
        strained = self._displacement_at_rest + self.elastic.displaced(self.on_surface(traction))
        missing = float(np.abs(misfit).max(initial=0.0))
        moved = float(np.abs(state.displacement).max(initial=0.0))
        size = float(np.abs(strained).max()) or moved or 1.0  # forces that are next to nothing strain nothing
        if total == 0.0:
            return Imbalance(float(work > 0.0 or missing > _NOISE * moved), float(work > 0.0))
        return Imbalance(
            max(self.missing(misfit, traction, size), work / total),
            work / total,
            max(_NOISE * moved / size, self.noise),
        )

    noise = 0.0
    """Imbalance that the accuracy of responses leaves."""

    def missing(self, misfit: ComplexArray, traction: ComplexArray, size: float) -> float:
        """Return the size of displacements (n_contact,) that are missing, relative to the largest one."""
        return float(np.abs(misfit).max(initial=0.0)) / size

    def recover(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return displacement (n_nodes, 2) and total force (n_nodes, 2) of all elements, in x and y."""
        traction, amounts, _ = self._completed(state)
        elastic, n = self.elastic, self.n_contact
        of_traction = self.on_surface(traction)
        displacement = self._displacement_at_rest + elastic.displaced(of_traction)
        displacement = displacement + amounts @ self._unit_motions[list(elastic.far_motion.load_controlled)]
        displacement[self.nodes.nodes] = as_complex(state.displacement) * self.turn[:n]
        force = self.force + elastic.mesh.lengths[:, None] * elastic.to_vectors(of_traction)
        return elastic.to_vectors(displacement), force

    def _completed(self, state: ContactState) -> tuple[ComplexArray, FloatArray, ComplexArray]:
        """Return tractions (n_acting,), driven motions (n_driven,), and what displacements (n_contact,) miss.

        Supports react to the tractions of contact; the motions are those that fit the displacements of contact and the
        balance of forces best.
        """
        n, modulus = self.n_contact, self.elastic.material.plane_modulus
        of_contact: ComplexArray = np.asarray(np.append(as_complex(state.traction), np.zeros(self._held.size)), complex)
        traction, displacement = self._supported(of_contact, self.rest, self._supports.value)
        misfit = as_complex(state.displacement) - displacement[:n]
        if not len(self.motions):
            return traction, np.zeros(0), misfit
        unloaded, nothing = np.zeros(self.acting.size, complex), np.zeros_like(self._supports.value)
        moved = [self._supported(unloaded, motion, nothing) for motion in self.motions]
        rows = [
            np.concatenate([as_pairs(by_motion[:n]).ravel(), (self.works @ reactions).real / modulus])
            for reactions, by_motion in moved
        ]
        unbalanced = self.load + (self.works @ traction).real
        amounts, _ = _fitted(rows, np.concatenate([as_pairs(misfit).ravel(), -unbalanced / modulus]))
        for amount, (reactions, by_motion) in zip(amounts, moved, strict=True):
            traction, misfit = traction + amount * reactions, misfit - amount * by_motion[:n]
        return traction, amounts, misfit

    def _supported(
        self, traction: ComplexArray, displacement: ComplexArray, value: FloatArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return tractions with reactions and displacements (n_acting,) where supports prescribe `value` (n_held, 2).

        Parameters
        ----------
        traction, displacement : (n_acting,) arrays [Pa], [m]
            Given tractions, and displacements without any.
        value : (n_held, 2) array
        """
        if self._held.size:
            supports = replace(self._supports, value=value)
            reduced = ReducedConditions.of(_joined(separated(self.n_contact), supports))
            right = reduced.value - reduced.rows(displacement + self.displacement_by(traction), traction)
            unknowns, _ = self.solve(reduced, right, self.motions[:0], np.zeros(0))
            traction = traction + reduced.changes(unknowns)
        return traction, displacement + self.displacement_by(traction)


def _joined(one: LinearConditions, two: LinearConditions) -> LinearConditions:
    """Return the conditions of some nodes and of others."""
    names = ("on_displacement", "on_traction", "value")
    return LinearConditions(*(np.concatenate([getattr(one, name), getattr(two, name)]) for name in names))


def _fitted(columns: Sequence[FloatArray], values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the least-squares amounts of columns (n,) for values (n,), and the residual (n,)."""
    if not len(columns):
        return np.zeros(0), values
    matrix = np.stack(columns, axis=1)
    amounts: FloatArray = np.asarray(np.linalg.lstsq(matrix, values, rcond=None)[0], dtype=float)
    return amounts, values - matrix @ amounts


def _check_resisted(body: SurfaceBody) -> None:
    """Refuse loads far away that drive a motion which no direction resists, and a turn about one node."""
    conditions, driven = body.conditions, body.elastic.far_motion.load_controlled
    along = conditions.frame @ body.elastic.far_motion.motions_at(dof_points(body.elastic.displacement_space))
    motions = along[~conditions.is_free][:, list(driven)]
    least = _ROUND_OFF * max(float(np.abs(motions).max(initial=0.0)), 1.0)
    if np.linalg.matrix_rank(motions, least) < len(driven):
        loads = " and ".join(f"far.{('force_x', 'force_y', 'moment')[k]}" for k in driven)
        raise SingularMatrixError(
            f"{loads} drive the half-plane along a motion that its {len(motions)} directions in contact or held leave "
            "free: give the motion instead of the load, or more elements in contact"
        )
