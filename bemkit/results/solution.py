"""The result of a scene: physical fields on the boundary, the summary, the plan and the timings.

Everything is in the user's units and holds physical tractions only. Signs: outward normal n, tangent t along the
anticlockwise boundary, traction = stress @ n; a pressed contact has sigma_n <= 0, and u_n <= gap.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.body import SlipHistory
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.results.between_nodes import BetweenNodes, violations_between_nodes
from bemkit.results.contact_table import ContactTable as ContactTable
from bemkit.results.contact_table import Transition as Transition
from bemkit.results.contact_table import bound_at, resolved_transitions, unresolved_contacts
from bemkit.results.resultants import contact_facts
from bemkit.results.solved_body import BoundaryFields as BoundaryFields
from bemkit.results.solved_body import SolvedBody
from bemkit.results.solved_problem import SolvedProblem
from bemkit.scene.scene import Scene

if TYPE_CHECKING:
    from bemkit.results.part_forces import ContactForce
    from bemkit.results.singular_corners import SingularCorner
    from bemkit.results.zone_ends import ZoneEnd


@dataclass(frozen=True, eq=False, kw_only=True)
class Solution(SolvedProblem, SolvedBody):
    """The solution of a scene, as `bemkit.run` returns it and result files hold it.

    Status, certificate, contact table and history are entries of `SolvedProblem`.

    Parameters
    ----------
    scene : Scene
        Of a load history that of its last step.
    mesh : BoundaryMesh
    boundary : BoundaryFields
    force_normal : float [N/m]
        The total pressing force, positive: minus the integral of sigma_n.
    force_tangential : float [N/m]
        The total friction force on the body along the boundary tangent: the integral of sigma_t.
    energy : float [J/m]
        Elastic energy: half the work of the stresses in the plane on the strains that they cause. In plane strain heat
        also compresses the body along its length, which costs E (alpha T)^2 / 2 per volume, not counted here.
    """

    scene: Scene
    mesh: BoundaryMesh
    boundary: BoundaryFields
    force_normal: float
    force_tangential: float
    energy: float

    def __repr__(self) -> str:
        """Return one line; the fields hold thousands of numbers."""
        nodes = f", {self.contact.n_contact} contact nodes" if self.contact.n_contact else ""
        return f"Solution({self.scene.title!r}: {self.status_words}, {self.n_elements} elements{nodes})"

    @cached_property
    def estimated_traction_error(self) -> float | None:
        """Estimated error of the contact tractions in L2, relative to them.

        From degree 3 on without those at `singular_corners`, which no element holds. Of a half-plane that of all
        tractions but loads, in the mean. None without an estimate and without such tractions.
        """
        if self.surface_errors is not None:
            return self.surface_errors.in_the_mean
        if not self.scene.discretisation.estimates_error or self.contact_traction_size == 0.0:
            return None
        if self.coefficient_errors is None:
            return self._error_of_nodal_tractions()
        from bemkit.results.error_indicators import place_error
        from bemkit.results.zone_ends import zone_end

        squared = float(self.coefficient_errors.traction[self.contact_elements].sum())
        squared += sum(
            place_error(self.contact, each, self.transitions, zone_end(self.mesh, self.contact, each))
            for each in self.transitions
        )
        return float(np.sqrt(squared)) / self.contact_traction_size

    @cached_property
    def estimated_local_traction_error(self) -> float | None:
        """Estimated largest error of the tractions of a half-plane on an element; None for another body.

        Relative to the traction on the element or to the mean of all, whichever is larger. The worst elements are
        excluded, on a share of the loaded length no larger than the error itself: no element is right where tractions
        are infinite.
        """
        return None if self.surface_errors is None else self.surface_errors.largest

    @property
    def stated(self) -> Scene:
        """The scene that was solved, with all its load steps."""
        return self.scene if self.loading is None else cast(Scene, self.loading.asked)

    @property
    def _problem(self) -> Scene:
        return self.scene

    @property
    def solved_bodies(self) -> tuple[Solution]:
        """The one body: the solution itself."""
        return (self,)

    def part_length(self, part: str) -> float:
        """Return the length of boundary of a part [m]."""
        return float(self.mesh.lengths[self.mesh.part(part)].sum())

    @cached_property
    def friction_bound(self) -> FloatArray | None:
        """(n_contact,) array [Pa]: the largest friction at each contact node; None if there is none anywhere."""
        table = self.contact
        law = self.scene.law_at(table.part, np.stack([table.x, table.y], axis=1))
        return bound_at(table, law if self.loading is None else law.at_slip(self.loading.motion))

    @cached_property
    def contacts(self) -> tuple[ContactForce, ...]:
        """The forces on each contact part, with contact length, peak pressure and largest slip."""
        from bemkit.results.part_forces import contact_forces

        parts = {force.name: force for force in self.part_forces}
        return contact_forces(self.contact, [parts[name] for name in self.contact.parts], self.transitions)

    @cached_property
    def singular_corners(self) -> tuple[SingularCorner, ...]:
        """Corners with singular contact tractions; see `bemkit.results.singular_corners`."""
        from bemkit.results.singular_corners import singular_corners

        return singular_corners(self, self.contact, motion=None if self.loading is None else self.loading.motion)

    def corners_of(self, body: SolvedBody) -> tuple[SingularCorner, ...]:
        """Return the singular corners of the one body."""
        return self.singular_corners

    @property
    def contact_elements(self) -> IntArray:
        """The elements of all contact parts, from degree 3 on without those at `singular_corners`."""
        elements = np.concatenate(
            [np.zeros(0, np.intp), *(self.mesh.part(part.name) for part in self.scene.contact_parts)]
        )
        if self.coefficient_errors is None:
            return elements
        return np.setdiff1d(elements, [k for corner in self.singular_corners for k in corner.elements])

    @cached_property
    def zone_ends(self) -> tuple[ZoneEnd, ...]:
        """Resolved ends of zones of one status, missed and unresolved contact.

        See `resolved_transitions`, `missed_contacts` and `unresolved_contacts`.
        """
        from bemkit.results.zone_ends import Side, zone_end

        resolved = resolved_transitions(self.contact, self.transitions)
        places = (*unresolved_contacts(self.contact, resolved), *self.missed_contacts.items())
        missed = (Side("", self.mesh, part).near(np.array(place)) for part, place in places)
        return (*(zone_end(self.mesh, self.contact, each) for each in resolved), *missed)

    @cached_property
    def reversal_ends(self) -> tuple[ZoneEnd, ...]:
        """Reversals of slip without a resolved stick zone; see `slip_reversals`."""
        from bemkit.results.slip_reversals import slip_reversals
        from bemkit.results.zone_ends import zone_end

        return tuple(zone_end(self.mesh, self.contact, each.place) for each in slip_reversals(self.contact))

    def _measured_between(
        self, motion: SlipHistory | None, names: Collection[str] | None = None
    ) -> dict[str, BetweenNodes]:
        return violations_between_nodes(self, self.contact, motion, names)

    def _parts(self) -> dict[str, Any]:
        return {
            **{name: getattr(self, name) for name in ("estimated_traction_error", "estimated_local_traction_error")},
            "singular_corners": [corner.as_dict() for corner in self.singular_corners],
            "parts": [force.as_dict() for force in self.part_forces],
            "contacts": contact_facts(self),
        }
