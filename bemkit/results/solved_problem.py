"""Base of the results of one body and of several: how the solve ended, and all steps on the way."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from bemkit.contact.body import SlipHistory
from bemkit.contact.certificate import Certificate
from bemkit.errors import InputError
from bemkit.notebook import Explorable, ShownInNotebooks
from bemkit.operators.counts import OperationCounts
from bemkit.plan import Plan
from bemkit.result_warning import ResultWarning, without_duplicates
from bemkit.results.between_nodes import BetweenNodes, missed_contacts
from bemkit.results.contact_table import ContactTable, Transition, free_contacts
from bemkit.results.load_history import LoadHistory, step_rows
from bemkit.results.solved_body import SolvedBody
from bemkit.results.when_asked import WhenAsked
from bemkit.scene.unit_names import UnitNames
from bemkit.solvers.base import Status, StepRecord
from bemkit.solvers.records import continued

if TYPE_CHECKING:
    from typing import Self

    from bemkit.results.singular_corners import SingularCorner
    from bemkit.scene.assembly import Assembly
    from bemkit.scene.scene import Scene
    from bemkit.scene.steps import Stated


@dataclass(frozen=True, eq=False, kw_only=True)
class SolvedProblem(Explorable):
    """Status, certificate, contact table and history of a solved scene or assembly.

    Parameters
    ----------
    status : Status
    certificate : Certificate
    contact : ContactTable
    history : tuple of StepRecord
    linear_solves, outer_steps : int
    transitions : tuple of Transition
    timings : mapping of str to float [s]
        Of each stage of the run, and of all.
    plan : Plan
    work : OperationCounts
        Counts of integrals, factorisations and solves; equal to ``plan.work`` if all load steps converged.
    message : str
        How the solver ended.
    memory : mapping of str to int [bytes]
        Largest memory of all arrays in each stage of the run; empty unless `tracemalloc` was tracing.
    warnings : tuple of ResultWarning
        See `bemkit.results.warnings`.
    loading : LoadHistory, optional
        The steps up to this one; None without a load history.
    provenance : mapping of str to str
        Versions, platform and time of a result from a file; empty otherwise.
    """

    status: Status
    certificate: Certificate
    contact: ContactTable
    history: tuple[StepRecord, ...]
    linear_solves: int
    outer_steps: int
    transitions: tuple[Transition, ...]
    timings: Mapping[str, float]
    plan: Plan
    work: OperationCounts
    message: str = ""
    memory: Mapping[str, int] = field(default_factory=dict)
    warnings: WhenAsked[tuple[ResultWarning, ...]] = WhenAsked(())  # noqa: RUF009 - a descriptor, shared by all on purpose
    loading: LoadHistory | None = None
    provenance: Mapping[str, str] = field(default_factory=dict)

    if TYPE_CHECKING:  # a field of the one kind, a property of the other

        @property
        def energy(self) -> float:
            """Elastic energy [J/m]."""

    @property
    def _problem(self) -> Scene | Assembly:
        """The scene or assembly; of a load history that of its last step."""
        raise NotImplementedError

    @property
    def solved_bodies(self) -> Sequence[SolvedBody]:
        """The elastic bodies, one or several."""
        raise NotImplementedError

    def _measured_between(
        self, motion: SlipHistory | None, names: Collection[str] | None = None
    ) -> dict[str, BetweenNodes]:
        """Return the violations between the nodes of some contacts, of all without names.

        `motion` is for laws that depend on slip.
        """
        raise NotImplementedError

    def corners_of(self, body: SolvedBody) -> tuple[SingularCorner, ...]:
        """Return the corners of one of the bodies at which contact tractions grow without bound."""
        raise NotImplementedError

    def n_sides(self, contact: str) -> int:
        """Return how many elastic bodies carry the tractions of a contact."""
        return 1

    def _sizes(self) -> dict[str, int]:
        """Return further counts of the summary by name."""
        return {}

    def _parts(self) -> dict[str, Any]:
        """Return the entries of the summary on bodies, parts and contacts."""
        raise NotImplementedError

    @property
    def is_converged(self) -> bool:
        """Whether the result is certified and, if an accuracy was asked for, as accurate."""
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
        Solution or AssemblySolution
            Its `loading` ends there, too.

        Raises
        ------
        InputError
            If there is no such step.
        """
        loading = self.loading
        if loading is None:
            raise InputError("the result has no load history: give [[steps]] or load_factors")
        if not 1 <= number <= len(loading.steps):
            most = len(loading.steps)
            raise InputError(f"step {number} does not exist: give a number from 1 to {most}")
        end = cast(Any, loading.steps[number - 1].end)
        return cast("Self", replace(end, loading=replace(loading, steps=loading.steps[:number])))

    @property
    def n_elements(self) -> int:
        """Number of elements of all bodies."""
        return sum(body.mesh.n_elements for body in self.solved_bodies)

    @cached_property
    def estimated_error(self) -> float | None:
        """Estimated error of all bodies in the energy norm, sqrt(a(u - u_h, u - u_h) / a(u_h, u_h)).

        None without an estimate, and where the energy is not positive, so that an error is measured against nothing;
        zero of bodies at rest, or that only move as a whole. None, too, while contact is missed that no node meets.
        """
        if self.wrongly_free:
            return None
        errors = [float(np.sum(body.element_errors)) for body in self.solved_bodies if body.element_errors is not None]
        unit = sum(body.error_unit for body in self.solved_bodies)
        if len(errors) < len(self.solved_bodies):
            return None
        if max(sum(errors), unit) <= sum(body.energy_of_round_off for body in self.solved_bodies):
            return 0.0
        return float(np.sqrt(sum(errors) / unit)) if unit > 0.0 else None

    @property
    def contact_traction_size(self) -> float:
        """L2 norm of the contact tractions of all bodies [Pa m^(1/2)]; those between two bodies count for both."""
        table = self.contact
        squared = table.weight * (table.sigma_n**2 + table.sigma_t**2)
        return float(np.sqrt(sum(self.n_sides(name) * squared[table.rows(name)].sum() for name in table.parts)))

    def _error_of_nodal_tractions(self) -> float | None:
        """Return the error of contact tractions by `nodal_error`, relative to `contact_traction_size`."""
        from bemkit.results.error_indicators import nodal_error

        bodies = self.solved_bodies
        degree = min(body.scene.discretisation.displacement_space(body.mesh).degree for body in bodies)
        squared = nodal_error(self.contact, degree, self.n_sides)
        return None if squared is None else float(np.sqrt(squared)) / self.contact_traction_size

    @property
    def units(self) -> UnitNames | None:
        """Names of units, if what was solved has them."""
        return self._problem.units

    @property
    def title(self) -> str:
        """The title of what was solved."""
        return self._problem.title

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
        return self._measured_between(self._motion)

    @property
    def _motion(self) -> SlipHistory | None:
        return None if self.loading is None else self.loading.motion

    def between_nodes_of(self, names: Collection[str]) -> dict[str, BetweenNodes]:
        """Return the largest violations between the nodes of some contacts; the others are not measured for it."""
        if "contacts_between_nodes" in vars(self):
            return {name: each for name, each in self.contacts_between_nodes.items() if name in names}
        return self._measured_between(self._motion, names) if names else {}

    @cached_property
    def missed_contacts(self) -> dict[str, tuple[float, float]]:
        """Points where contact is missed, because no node meets it, by contact; see `bemkit.results.missed_contact`."""
        return missed_contacts(self.contact, self.contacts_between_nodes)

    @cached_property
    def wrongly_free(self) -> dict[str, tuple[float, float]]:
        """The missed contacts without any force; those with a force are not measured for it."""
        return missed_contacts(self.contact, self.between_nodes_of(free_contacts(self.contact)))

    @property
    def unasked_warnings(self) -> Any:
        """The warnings, or the function that will find them: what a solution that replaces this one takes over."""
        return WhenAsked.held(self, "warnings")

    def with_warnings(self, warnings: tuple[ResultWarning, ...] | Callable[[Any], tuple[ResultWarning, ...]]) -> Self:
        """Return the same solution, with what it has computed, and other warnings.

        A function of the solution is called when the warnings are first read.
        """
        result = copy(self)
        object.__setattr__(result, "warnings", warnings)
        return result

    def summary(self) -> dict[str, Any]:
        """Return the result without its fields, under the stable names of the JSON output.

        Returns
        -------
        dict
            ``title``, ``units`` (names, None without), ``status`` (a word), ``message`` (how the solver ended),
            ``converged``, ``certified``, ``warnings``, ``n_bodies`` (of an assembly),
            ``n_elements``, ``n_contact``, ``linear_solves``, ``outer_steps``, ``force_normal`` and
            ``force_tangential`` [N/m], ``energy`` [J/m], ``estimated_error`` (None without an estimate),
            of one body ``estimated_traction_error`` and ``estimated_local_traction_error`` (the same),
            ``singular_corners`` (``x``, ``y`` [m], ``exponent``), ``parts``
            (resultants of the tractions on each part) and ``contacts`` (what each contact part feels), of an assembly
            ``contacts``, ``bodies`` and ``rigid``,
            ``transitions``, ``certificate``, ``between_nodes`` (None without contact), ``timings`` [s], ``plan``,
            ``work``, ``memory`` [bytes], ``steps`` (of a load history, see `LoadStep.as_dict`).
        """
        numbers = ("linear_solves", "outer_steps", "force_normal", "force_tangential", "energy", "estimated_error")
        return {
            "title": self.title,
            "units": None if self.units is None else self.units.as_dict(),
            "status": self.status.name.lower(),
            "message": self.message or self.status.value,
            "converged": self.is_converged,
            "certified": self.is_certified,
            "warnings": [warning.as_dict() for warning in self.warnings],
            **self._sizes(),
            "n_elements": self.n_elements,
            "n_contact": self.contact.n_contact,
            **{name: getattr(self, name) for name in numbers},
            **self._parts(),
            "transitions": [transition.as_dict() for transition in self.transitions],
            "certificate": self.certificate.as_dict(),
            "between_nodes": None if self.between_nodes is None else self.between_nodes.as_dict(),
            "timings": dict(self.timings),
            "plan": self.plan.as_dict(),
            "work": self.work.as_dict(),
            "memory": dict(self.memory),
            "steps": step_rows(self.loading),
        }


AnySolution = TypeVar("AnySolution", bound="SolvedProblem")


class SolvedSteps(ShownInNotebooks, tuple[AnySolution, ...]):
    """The solutions of load steps in their order, never none."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Return one line."""
        last = self[-1]
        return f"SolvedSteps({last.title!r}: {len(self)} steps, the last one {last.status_words})"


def with_totals(result: AnySolution, solutions: Sequence[AnySolution], names: Sequence[str]) -> AnySolution:
    """Return a solution with the steps, linear solves, times and memory of all solutions on the way, in their order.

    `names`, such as "load step 1 of 3", are put before the messages of the steps of each.
    """
    records: tuple[StepRecord, ...] = ()
    for name, solution in zip(names, solutions, strict=True):
        records = continued(records, solution.history, name)
    return replace(
        with_times(result, solutions),
        warnings=result.unasked_warnings,
        history=records,
        linear_solves=sum(solution.linear_solves for solution in solutions),
        outer_steps=sum(solution.outer_steps for solution in solutions),
    )


def with_times(result: AnySolution, solutions: Sequence[AnySolution]) -> AnySolution:
    """Return a solution with the total times and the largest memory of all solutions on the way."""
    return replace(
        result,
        warnings=result.unasked_warnings,
        timings={name: sum(solution.timings[name] for solution in solutions) for name in result.timings},
        memory={name: max(solution.memory.get(name, 0) for solution in solutions) for name in result.memory},
    )


_EARLIER = "Load step "
"""How warnings begin that are those of an earlier step."""


def following(
    so_far: AnySolution | None, solution: AnySolution, stated: Stated, number: int, n_steps: int
) -> AnySolution:
    """Return a step of a load history with the records, solves, times, memory and warnings of all before it.

    Of each kind and subject of warnings the last one is kept, and names its step unless that is this one; `at_step` has
    those of a step.

    Parameters
    ----------
    so_far : Solution or AssemblySolution, optional
        The result of this function for the step before.
    solution : Solution or AssemblySolution
        Of the step.
    stated : Scene or Assembly
        With all steps.
    number, n_steps : int
        Of the step, counted from 1, and of all.
    """
    if n_steps == 1:
        return solution
    name = f"load step {number} of {n_steps}"
    before = () if so_far is None else (so_far,)
    total: AnySolution = with_totals(solution, [*before, solution], [*("" for _ in before), name])
    earlier = [
        each
        if each.text.startswith(_EARLIER)
        else replace(each, text=f"{_EARLIER}{number - 1} of {n_steps}: {each.text}")
        for each in (() if so_far is None else so_far.warnings)
    ]
    warnings = without_duplicates((*solution.warnings, *earlier))
    loading = None if solution.loading is None else replace(solution.loading, asked=stated)
    message = f"{name}: {solution.message}"
    whole: AnySolution = replace(total, message=message, warnings=warnings, loading=loading)
    return whole
