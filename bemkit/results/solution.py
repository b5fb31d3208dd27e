"""The result of a scene: physical fields on the boundary, the summary, the plan and the timings.

Everything is in the user's units and holds physical tractions only. Signs: outward normal n, tangent t along the
anticlockwise boundary, traction = stress @ n; a pressed contact has sigma_n <= 0, and u_n <= gap.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.certificate import Certificate
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.notebook import ShownInNotebooks
from bemkit.operators.counts import OperationCounts
from bemkit.plan import Plan
from bemkit.results.between_nodes import BetweenNodes, violations_between_nodes
from bemkit.results.contact_table import ContactTable as ContactTable
from bemkit.results.contact_table import Transition as Transition
from bemkit.results.contact_table import bound_at
from bemkit.results.load_history import LoadHistory, at_step, step_rows
from bemkit.results.part_forces import ContactForce, contact_forces
from bemkit.results.solved_body import BoundaryFields as BoundaryFields
from bemkit.results.solved_body import SolvedBody
from bemkit.scene.scene import Scene
from bemkit.scene.unit_names import UnitNames
from bemkit.solvers.base import Status, StepRecord

if TYPE_CHECKING:
    from bemkit.results.assembly_solution import AssemblySolution
    from bemkit.scene.assembly import Assembly


@dataclass(frozen=True, eq=False)
class Solution(ShownInNotebooks, SolvedBody):
    """What `bemkit.run` returns and a result file holds.

    Parameters
    ----------
    scene : Scene
        Of a load history that of its last step.
    mesh : BoundaryMesh
    status : Status
    certificate : Certificate
    contact : ContactTable
    boundary : BoundaryFields
    history : tuple of StepRecord
    linear_solves, outer_steps : int
    force_normal : float [N/m]
        The total pressing force, positive: minus the integral of sigma_n.
    force_tangential : float [N/m]
        The total friction force on the body along the boundary tangent: the integral of sigma_t.
    energy : float [J/m]
        Elastic energy: half the work of the stresses in the plane on the strains that they cause. In plane strain heat
        also compresses the body along its length, which costs E (alpha T)^2 / 2 per volume, not counted here.
    transitions : tuple of Transition
    timings : mapping of str to float [s]
        Of each stage of the run, and of all.
    plan : Plan
    work : OperationCounts
        What was computed; equal to ``plan.work`` if all load steps converged.
    memory : mapping of str to int [bytes]
        Largest memory of all arrays in each stage of the run; empty unless `tracemalloc` was tracing.
    warnings : tuple of str
        What is doubtful about the result, one sentence each; see `bemkit.results.warnings`.
    loading : LoadHistory, optional
        Of a load history the steps up to this one.
    """

    scene: Scene
    mesh: BoundaryMesh
    status: Status
    certificate: Certificate
    contact: ContactTable
    boundary: BoundaryFields
    history: tuple[StepRecord, ...]
    linear_solves: int
    outer_steps: int
    force_normal: float
    force_tangential: float
    energy: float
    transitions: tuple[Transition, ...]
    timings: Mapping[str, float]
    plan: Plan
    work: OperationCounts
    message: str = ""
    memory: Mapping[str, int] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    loading: LoadHistory | None = None

    def __repr__(self) -> str:
        """Return one line; the fields hold thousands of numbers."""
        nodes = f", {self.contact.n_contact} contact nodes" if self.contact.n_contact else ""
        status = self.status.name.lower().replace("_", " ")
        return f"Solution({self.scene.title!r}: {status}, {self.n_elements} elements{nodes})"

    @property
    def is_converged(self) -> bool:
        """Whether the result is what was asked for: certified, and as accurate as an accuracy demands."""
        return self.status is Status.CONVERGED

    @property
    def is_certified(self) -> bool:
        """Whether contact, friction and equilibrium hold on the mesh, be it fine enough for the accuracy or not."""
        return self.status in (Status.CONVERGED, Status.ACCURACY_NOT_REACHED)

    @cached_property
    def estimated_error(self) -> float | None:
        """Estimated error in the energy norm, sqrt(a(u - u_h, u - u_h) / a(u_h, u_h)).

        None without an estimate, and where the energy is not positive, so that an error is measured against nothing;
        zero of a body at rest.
        """
        if self.element_errors is None:
            return None
        error = float(self.element_errors.sum())
        if error == 0.0:
            return 0.0
        return float(np.sqrt(error / self.error_unit)) if self.error_unit > 0.0 else None

    @cached_property
    def estimated_traction_error(self) -> float | None:
        """Estimated error of the contact tractions in L2, relative to them.

        Of a half-plane that of all tractions but loads, in the mean. None without an estimate and without such
        tractions.
        """
        if self.mean_traction_errors is not None:
            size = self.mean_traction_size
            return float(self.mean_traction_errors.sum()) / size if size > 0.0 else None
        if not self.scene.discretisation.estimates_error or self.contact_traction_size == 0.0:
            return None
        from bemkit.results.error_indicators import contact_errors, place_errors

        if self.coefficient_errors is None:
            degree = max(self.scene.discretisation.displacement_space(self.mesh).degree, 1)
            squared = float(contact_errors(self.contact, degree).sum())
        else:
            squared = float(self.coefficient_errors.traction[self.contact_elements].sum())
            squared += float(place_errors(self.contact, self.mesh, self.transitions).sum())
        return float(np.sqrt(squared)) / self.contact_traction_size

    @cached_property
    def estimated_local_traction_error(self) -> float | None:
        """Estimated largest error of the tractions of a half-plane on an element; None of another body.

        Relative to the traction there or to the mean of all, whichever is larger, and without the worst elements on an
        equally small share of what carries tractions: at infinite ones no element is right.
        """
        if self.local_traction_errors is None or self.mean_traction_size == 0.0:
            return None
        from bemkit.results.error_indicators import largest_but_a_share

        return largest_but_a_share(self.local_traction_errors, self.mesh.lengths)

    @property
    def stated(self) -> Scene:
        """What was asked: the scene, with all its load steps."""
        return self.scene if self.loading is None else cast(Scene, self.loading.asked)

    def at_step(self, number: int) -> Solution:
        """Return the solution at the end of a finished step of its load history, counted from 1; see `LoadHistory`."""
        return at_step(self, number)

    @property
    def units(self) -> UnitNames | None:
        """Names of units, if the scene has them."""
        return self.scene.units

    @property
    def title(self) -> str:
        """The title of the scene."""
        return self.scene.title

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return self.mesh.n_elements

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
        """What each contact part feels of its obstacle."""
        parts = {force.name: force for force in self.part_forces}
        return contact_forces(self.contact, [parts[name] for name in self.contact.parts], self.transitions)

    @property
    def contact_elements(self) -> IntArray:
        """The elements of all contact parts."""
        return np.concatenate([np.zeros(0, np.intp), *(self.mesh.part(part.name) for part in self.scene.contact_parts)])

    @property
    def contact_traction_size(self) -> float:
        """L2 norm of the contact tractions [Pa m^(1/2)]."""
        table = self.contact
        return float(np.sqrt(table.weight @ (table.sigma_n**2 + table.sigma_t**2)))

    @cached_property
    def between_nodes(self) -> BetweenNodes | None:
        """Largest violations of the contact conditions between the nodes, of which the certificate says nothing.

        None without contact.
        """
        displacement, traction_dofs = self.boundary.displacement, self.boundary.traction_dofs
        motion = None if self.loading is None else self.loading.motion
        return violations_between_nodes(self.scene, self.mesh, self.contact, displacement, traction_dofs, motion)

    def with_warnings(self, warnings: tuple[str, ...]) -> Solution:
        """Return the same solution with other warnings, and with all that has been estimated of it."""
        result = copy(self)
        object.__setattr__(result, "warnings", warnings)
        return result

    def summary(self) -> dict[str, Any]:
        """Return the result without its fields, under the stable names of the JSON output.

        Returns
        -------
        dict
            ``title``, ``units`` (names, None without), ``status`` (a word), ``message`` (how the solver ended),
            ``converged``, ``certified``, ``warnings``,
            ``n_elements``, ``n_contact``, ``linear_solves``, ``outer_steps``, ``force_normal`` and
            ``force_tangential`` [N/m], ``energy`` [J/m], ``estimated_error``, ``estimated_traction_error`` and
            ``estimated_local_traction_error`` (None without an estimate),
            ``parts`` (resultants of the tractions on each part), ``contacts`` (what each contact part feels),
            ``transitions``, ``certificate``, ``between_nodes`` (None without contact), ``timings`` [s], ``plan``,
            ``work``, ``memory`` [bytes], ``steps`` (of a load history, see `LoadStep.as_dict`).
        """
        return {
            "title": self.scene.title,
            "units": None if self.units is None else self.units.as_dict(),
            "status": self.status.name.lower(),
            "message": self.message or self.status.value,
            "converged": self.is_converged,
            "certified": self.is_certified,
            "warnings": list(self.warnings),
            "n_elements": self.n_elements,
            "n_contact": self.contact.n_contact,
            **{name: getattr(self, name) for name in ("linear_solves", "outer_steps", "force_normal")},
            **{name: getattr(self, name) for name in ("force_tangential", "energy", "estimated_error")},
            **{name: getattr(self, name) for name in ("estimated_traction_error", "estimated_local_traction_error")},
            "parts": [force.as_dict() for force in self.part_forces],
            "contacts": [contact.as_dict() for contact in self.contacts],
            "transitions": [transition.as_dict() for transition in self.transitions],
            "certificate": self.certificate.as_dict(),
            "between_nodes": None if self.between_nodes is None else self.between_nodes.as_dict(),
            "timings": dict(self.timings),
            "plan": self.plan.as_dict(),
            "work": self.work.as_dict(),
            "memory": dict(self.memory),
            "steps": step_rows(self.loading),
        }


AnySolution = TypeVar("AnySolution", bound="Solution | AssemblySolution")


def with_totals(result: AnySolution, solutions: Sequence[AnySolution], names: Sequence[str]) -> AnySolution:
    """Return a solution with the steps, linear solves, times and memory of all that led to it, in their order.

    The names say what each of them is, for the remarks of its steps: "load step 1 of 3".
    """
    records: list[StepRecord] = []
    for name, solution in zip(names, solutions, strict=True):
        first, spent = (records[-1].step + 1, records[-1].linear_solves) if records else (0, 0)
        for record in solution.history:
            message = "; ".join(filter(None, (name, record.message)))
            total = spent + record.linear_solves
            records.append(replace(record, step=first + record.step, linear_solves=total, message=message))
    return replace(
        with_times(result, solutions),
        history=tuple(records),
        linear_solves=sum(solution.linear_solves for solution in solutions),
        outer_steps=sum(solution.outer_steps for solution in solutions),
    )


def with_times(result: AnySolution, solutions: Sequence[AnySolution]) -> AnySolution:
    """Return a solution with the times and the memory of all that led to it."""
    return replace(
        result,
        timings={name: sum(solution.timings[name] for solution in solutions) for name in result.timings},
        memory={name: max(each.memory.get(name, 0) for each in solutions) for name in result.memory},
    )


def following(
    so_far: AnySolution | None, solution: AnySolution, asked: Scene | Assembly, number: int, n_steps: int
) -> AnySolution:
    """Return a step of a load history with the records, solves, times, memory and warnings of all before it as well.

    Of warnings that differ in numbers alone the last one stands for all; `at_step` keeps those of a step.

    Parameters
    ----------
    so_far : Solution or AssemblySolution, optional
        What this function returned for the step before.
    solution : Solution or AssemblySolution
        Of the step.
    asked : Scene or Assembly
        With all steps.
    number, n_steps : int
        Of the step, counted from 1, and of all.
    """
    if n_steps == 1:
        return solution
    name = f"load step {number} of {n_steps}"
    before = () if so_far is None else (so_far,)
    total: AnySolution = with_totals(solution, [*before, solution], [*("" for _ in before), name])
    warnings = unlike((*solution.warnings, *(text for each in before for text in each.warnings)))
    loading = None if solution.loading is None else replace(solution.loading, asked=asked)
    message = f"{name}: {solution.message}"
    whole: AnySolution = replace(total, message=message, warnings=warnings, loading=loading)
    return whole


def unlike(texts: Iterable[str]) -> tuple[str, ...]:
    """Return the first of all sentences that differ in numbers, and in what else these count, alone."""
    first: dict[str, str] = {}
    for text in texts:
        kind = re.sub(r", and \d+ more [a-z]+ like it|(?<=node)s|\d+(\.\d+)?(e[-+]?\d+)?", "", text)
        first.setdefault(kind, text)
    return tuple(first.values())
