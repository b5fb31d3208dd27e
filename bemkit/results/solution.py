"""The result of a scene: physical fields of its bodies, the contacts, how the solve ended, the plan and the timings.

Everything is in the user's units and holds physical tractions only. Signs: outward normal n, tangent t along the
anticlockwise boundary, traction = stress @ n; a pressed contact has sigma_n <= 0, and u_n <= gap.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from bemkit.contact.certificate import Certificate
from bemkit.errors import InputError, ResultWarning
from bemkit.notebook import Explorable
from bemkit.operators.counts import OperationCounts
from bemkit.plan.plan import Plan
from bemkit.results.between_nodes import (
    BetweenNodes,
    missed_contacts,
    unfound_contacts,
    violations_between_nodes,
)
from bemkit.results.contact_table import ContactTable as ContactTable
from bemkit.results.contact_table import narrow_contacts
from bemkit.results.solved_body import BoundaryFields as BoundaryFields
from bemkit.results.solved_scene import SolvedScene, contact_facts, part_facts
from bemkit.results.transitions import Transition as Transition
from bemkit.solvers.base import Status, StepRecord

if TYPE_CHECKING:
    from typing import Self

    from bemkit.results.contact_places import ContactPlaces
    from bemkit.results.singular_corners import SingularCorner


def stated_warnings(warnings: tuple[ResultWarning, ...], solution: Any) -> tuple[ResultWarning, ...]:
    """Return known warnings of a solution, for `Solution.warnings_of`."""
    return warnings


@dataclass(frozen=True, eq=False, kw_only=True)
class Solution(SolvedScene, Explorable):
    """The solution of a scene, as `bemkit.run` returns it and result files hold it.

    Bodies and contacts are entries of `SolvedScene`.

    Parameters
    ----------
    status : Status
    certificate : Certificate
    history : tuple of StepRecord
    linear_solves, outer_steps : int
    timings : mapping of str to float [s]
        Times of each stage of the run, and of all.
    plan : Plan
    work : OperationCounts
        Counts of integrals, factorisations and solves; equal to ``plan.work`` if all load steps converged.
    message : str
        How the solver ended.
    memory : mapping of str to int [bytes]
        Largest memory of all arrays in each stage of the run; empty unless `tracemalloc` was tracing.
    warnings_of : callable (solution) -> tuple of ResultWarning
        Called when `warnings` are first read; none by default.
    provenance : mapping of str to str
        Versions, platform and time of a result from a file; empty otherwise.
    """

    status: Status
    certificate: Certificate
    history: tuple[StepRecord, ...]
    linear_solves: int
    outer_steps: int
    timings: Mapping[str, float]
    plan: Plan
    work: OperationCounts
    message: str = ""
    memory: Mapping[str, int] = field(default_factory=dict)
    warnings_of: Callable[[Any], tuple[ResultWarning, ...]] = partial(stated_warnings, ())  # noqa: RUF009 - it is pure
    provenance: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return one line; the fields hold thousands of numbers."""
        named = f"{len(self.bodies)} bodies, " if "" not in self.bodies else ""
        nodes = f", {self.contact.n_contact} contact nodes" if self.contact.n_contact else ""
        return f"Solution({self.title!r}: {self.status_words}, {named}{self.n_elements} elements{nodes})"

    @property
    def is_converged(self) -> bool:
        """Whether the result is certified and reaches the accuracy that the scene asks for, if any."""
        return self.status is Status.CONVERGED

    @property
    def is_certified(self) -> bool:
        """Whether contact, friction and equilibrium hold on the mesh, even if it is too coarse for the accuracy."""
        return self.status in (Status.CONVERGED, Status.ACCURACY_NOT_REACHED)

    def at_step(self, number: int) -> Self:
        """Return the solution at the end of an earlier step of its load history.

        Parameters
        ----------
        number : int
            Of the step, counted from 1.

        Returns
        -------
        Solution
            Its `loading` ends there, too.

        Raises
        ------
        InputError
            If there is no such step.
        """
        loading = self.loading
        if loading is None:
            raise InputError("the result has no load history: give [[steps]] or load_factors")
        if number not in range(1, len(loading.steps) + 1):
            most = len(loading.steps)
            raise InputError(f"step {number} does not exist: give a number from 1 to {most}")
        number = int(number)
        end: Any = loading.steps[number - 1].end
        return cast("Self", replace(end, loading=replace(loading, steps=loading.steps[:number])))

    def each_step(self) -> list[Solution]:
        """Return the solutions at the ends of all finished load steps; the solution itself without a load history."""
        n_steps = 0 if self.loading is None else len(self.loading.steps)
        return [self.at_step(1 + k) for k in range(n_steps)] or [self]

    @cached_property
    def estimated_error(self) -> float | None:
        """Estimated error of all bodies in the energy norm, sqrt(a(u - u_h, u - u_h) / a(u_h, u_h)).

        Zero for bodies at rest or in rigid motion. None without an estimate, without a positive energy to which an
        error is relative, and while contact between the nodes is missed.
        """
        if self.unfound_contacts:
            return None
        errors = [
            float(np.sum(body.element_errors)) for body in self.bodies.values() if body.element_errors is not None
        ]
        unit = self.error_unit
        if len(errors) < len(self.bodies):
            return None
        if max(sum(errors), unit) <= self.energy_of_round_off:
            return 0.0
        squared = sum(errors) + self.places.squared_energy_error()
        return float(np.sqrt(squared / unit)) if unit > 0.0 else None

    @cached_property
    def places(self) -> ContactPlaces:
        """Singular corners, edges and ends of zones of the contacts."""
        from bemkit.results.contact_places import ContactPlaces

        return ContactPlaces(self)

    @property
    def singular_corners(self) -> tuple[SingularCorner, ...]:
        """Corners of all bodies at which contact tractions grow without bound; see `ContactPlaces.corners`."""
        return tuple(corner for corners in self.places.corners.values() for corner in corners)

    @cached_property
    def estimated_traction_error(self) -> float | None:
        """Estimated error of the contact tractions of all bodies in L2, relative to their norm.

        Tractions at `singular_corners` and at edges that press into another side are excluded. For a half-plane, the
        mean error of all tractions except loads. None without an estimate, without such tractions, and if fewer than
        three nodes carry them.
        """
        bodies = tuple(self.bodies.values())
        if len(bodies) == 1 and bodies[0].surface_errors is not None:
            return bodies[0].surface_errors.in_the_mean
        size = self.contact_traction_size
        if size == 0.0 or not all(body.scene.discretisation.estimates_error for body in bodies):
            return None
        from bemkit.results.error_indicators import stiffness_error

        squared = self.places.squared_traction_error()
        if squared is None:
            return None
        stiffness = stiffness_error(self.estimated_error or 0.0, self.places.lowest_degree)
        return float(np.hypot(np.sqrt(squared) / size, stiffness))

    @cached_property
    def estimated_local_traction_error(self) -> float | None:
        """Estimated largest error of the tractions of a half-plane on an element; None for other bodies.

        Relative to the traction on the element or to the mean of all, whichever is larger. The worst elements are
        excluded, on a share of the loaded length no larger than the error itself: no element is right where tractions
        are infinite.
        """
        errors = [body.surface_errors for body in self.bodies.values()]
        return errors[0].largest if len(errors) == 1 and errors[0] is not None else None

    @property
    def status_words(self) -> str:
        """How the solve ended, in lower case."""
        return self.status.name.lower().replace("_", " ")

    @cached_property
    def between_nodes(self) -> BetweenNodes | None:
        """Largest violations of the contact conditions between the nodes, which the certificate does not measure.

        None without contact.
        """
        return BetweenNodes.largest(self.contacts_between_nodes.values())

    @cached_property
    def contacts_between_nodes(self) -> dict[str, BetweenNodes]:
        """Largest violations between the nodes of each contact, by its name in the contact table."""
        return violations_between_nodes(self, known=self.narrow_contacts_between_nodes)

    @cached_property
    def missed_contacts(self) -> dict[str, tuple[float, float]]:
        """Points where contact is missed, because no node meets it, by contact; see `bemkit.results.between_nodes`."""
        return missed_contacts(self.contact, self.contacts_between_nodes)

    @cached_property
    def unfound_contacts(self) -> dict[str, tuple[float, float]]:
        """The missed contacts without force, and those of a few nodes that overlap deeply; see `unfound_contacts`."""
        return unfound_contacts(self.contact, self.narrow_contacts_between_nodes)

    @cached_property
    def narrow_contacts_between_nodes(self) -> dict[str, BetweenNodes]:
        """Largest violations between the nodes of contacts with a force at a few nodes at most."""
        names = narrow_contacts(self.contact)
        return violations_between_nodes(self, names) if names else {}

    @cached_property
    def warnings(self) -> tuple[ResultWarning, ...]:
        """Warnings about the result; see `bemkit.results.warnings`."""
        return self.warnings_of(self)

    def with_warnings(self, warnings: tuple[ResultWarning, ...]) -> Self:
        """Return the same solution, with what it has computed, and other warnings."""
        result = copy(self)
        vars(result).update(warnings=warnings, warnings_of=partial(stated_warnings, warnings))
        return result

    def summary(self) -> dict[str, Any]:
        """Return the result without its fields, under the stable names of the JSON output.

        Returns
        -------
        dict
            ``title``, ``units`` (names, None without), ``thickness`` [m] (None if forces are per unit of it),
            ``status`` (a word), ``message`` (how the solver ended),
            ``converged``, ``certified``, ``warnings``, ``n_bodies``, ``n_elements``, ``n_contact``, ``linear_solves``,
            ``outer_steps``, ``force_normal`` and ``force_tangential`` [N/m], ``energy`` [J/m], ``estimated_error``,
            ``estimated_traction_error`` and ``estimated_local_traction_error`` (None without an estimate),
            ``singular_corners`` (``x``, ``y`` [m], ``exponent``), ``parts`` (resultants of the tractions on each part),
            ``contacts`` (what each contact transmits), ``bodies`` (``n_elements``, ``energy``), ``rigid``,
            ``transitions``, ``certificate``, ``between_nodes`` (None without contact), ``timings`` [s], ``plan``,
            ``work``, ``memory`` [bytes], ``steps`` (of a load history, see `LoadStep.as_dict`). The only body
            of a scene that names none is called ``body``.
        """
        errors = ("estimated_error", "estimated_traction_error", "estimated_local_traction_error")
        numbers = ("linear_solves", "outer_steps", "force_normal", "force_tangential", "energy", *errors)
        return {
            "title": self.title,
            "units": None if self.units is None else self.units.as_dict(),
            "thickness": self.scene.thickness,
            "status": self.status.name.lower(),
            "message": self.message or self.status.value,
            "converged": self.is_converged,
            "certified": self.is_certified,
            "warnings": [warning.as_dict() for warning in self.warnings],
            "n_bodies": len(self.bodies),
            "n_elements": self.n_elements,
            "n_contact": self.contact.n_contact,
            **{name: getattr(self, name) for name in numbers},
            "singular_corners": [
                ({"body": name} if name else {}) | corner.as_dict()
                for name, corners in self.places.corners.items()
                for corner in corners
            ],
            "parts": part_facts(self),
            "contacts": contact_facts(self),
            "bodies": {
                name or "body": {"n_elements": body.mesh.n_elements, "energy": body.energy}
                for name, body in self.bodies.items()
            },
            "rigid": {name: body.as_dict() for name, body in self.rigid.items()},
            "transitions": [transition.as_dict() for transition in self.transitions],
            "certificate": self.certificate.as_dict(),
            "between_nodes": None if self.between_nodes is None else self.between_nodes.as_dict(),
            "timings": dict(self.timings),
            "plan": self.plan.as_dict(),
            "work": self.work.as_dict(),
            "memory": dict(self.memory),
            "steps": [step.as_dict() for step in (() if self.loading is None else self.loading.steps)],
        }


def continued(records: Sequence[StepRecord], further: Iterable[StepRecord], words: str = "") -> tuple[StepRecord, ...]:
    """Return the records of a solve after those of the solves before it.

    Parameters
    ----------
    records : sequence of StepRecord
        Of the solves before.
    further : iterable of StepRecord
        Of the next one: its steps and linear solves are counted from the end of those before.
    words : str
        Begin the messages of the further records.
    """
    first, solves = (records[-1].step + 1, records[-1].linear_solves) if records else (0, 0)
    return (
        *records,
        *(
            replace(
                record,
                step=first + record.step,
                linear_solves=solves + record.linear_solves,
                message="; ".join(filter(None, (words, record.message))),
            )
            for record in further
        ),
    )
