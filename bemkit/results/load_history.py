"""Results of the steps of a load history: forces, status and work of each, position of the last."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import astuple, dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState, SlipHistory
from bemkit.errors import ResultWarning
from bemkit.results.contact_table import ContactTable

if TYPE_CHECKING:
    from bemkit.scene.scene import Scene


class StepEnd(Protocol):
    """Members of a solution that a step needs, as `Solution` has them."""

    @property
    def energy(self) -> float:
        """Elastic energy [J/m]."""

    @property
    def contact(self) -> ContactTable:
        """The table of contact nodes."""

    @property
    def force_normal(self) -> float:
        """Sum of the pressing forces of all contacts [N/m]."""

    @property
    def force_tangential(self) -> float:
        """Sum of the friction forces of all contacts [N/m]."""


_COARSE = 0.01
"""Share of the external work that increments may lose without a warning."""
_MISSED = 0.05
"""Share of the dissipation that increments may miss without a warning."""
_LITTLE = 1e-3
"""Share of the external work below which missed dissipation does not matter."""


@dataclass(frozen=True)
class StepWork:
    """Work in one step, or in several.

    Parameters
    ----------
    external_work : float [J/m]
        Work of loads, of the reactions of moving supports, and of obstacles that move towards the body. With body
        forces or heat it is the remainder of the balance.
    dissipation : float [J/m]
        Work dissipated by friction at nodes that are closed at both ends of an increment. It is never negative: a
        negative value of the trapezoidal rule is part of `increment_work`.
    increment_work : float [J/m]
        Error of the size of the increments: the work of tractions where clearances open or close within one, or where
        slip reverses under a falling friction bound. It vanishes as increments become smaller.
    friction_gain : float [J/m]
        Work of friction where it acts along the slip of an increment at its end; round-off wherever friction opposes
        slip. It is no part of the balance.
    missed_dissipation : float [J/m]
        Estimate of what the trapezoidal rule misses in `dissipation` at nodes that begin to slip, or slip the other
        way, within an increment: it takes the mean of the friction at both ends, but they slip under their bound.
        It is no part of the balance.

    Notes
    -----
    All by the trapezoidal rule on each increment, with which, for a body with a symmetric stiffness, ``external_work =
    change of elastic energy + dissipation + increment_work`` but for round-off.
    """

    external_work: float = 0.0
    dissipation: float = 0.0
    increment_work: float = 0.0
    friction_gain: float = 0.0
    missed_dissipation: float = 0.0

    def __add__(self, other: StepWork) -> StepWork:
        """Return the work in both."""
        return StepWork(*(one + two for one, two in zip(astuple(self), astuple(other), strict=True)))


@dataclass(frozen=True, eq=False)
class LoadStep:
    """One finished step of a load history.

    Parameters
    ----------
    work : StepWork
        In this step.
    n_increments : int
        One, or the number of increments into which a failed step was divided.
    linear_solves : int
    end : Solution
        All fields at its end; see `Solution.at_step`.
    state : ContactState
        Dimensionless, at its end.
    motion : SlipHistory
        At the end of its last increment.
    """

    work: StepWork
    n_increments: int
    linear_solves: int
    end: StepEnd = field(repr=False)
    state: ContactState = field(repr=False)
    motion: SlipHistory = field(repr=False)

    @property
    def time(self) -> float:
        """At its end [s]."""
        return self.motion.time

    @property
    def elastic_energy(self) -> float:
        """At its end [J/m]."""
        return self.end.energy

    @property
    def contact(self) -> ContactTable:
        """At its end."""
        return self.end.contact

    @property
    def slip(self) -> FloatArray:
        """(n_contact,) array [m]: accumulated slip of each node."""
        return self.motion.slip

    @property
    def force_normal(self) -> float:
        """Total pressing force [N/m], positive."""
        return self.end.force_normal

    @property
    def force_tangential(self) -> float:
        """Integral of sigma_t [N/m]."""
        return self.end.force_tangential

    @property
    def mean_displacement(self) -> float:
        """Mean tangential displacement of the contact nodes [m]."""
        table = self.contact
        return float(table.weight @ table.u_t) / float(table.weight.sum()) if table.n_contact else 0.0

    def as_dict(self) -> dict[str, float | int]:
        """Return the numbers by the names of the JSON output."""
        words = self.contact.status_words()
        return {
            "time": self.time,
            "external_work": self.work.external_work,
            "elastic_energy": self.elastic_energy,
            "dissipation": self.work.dissipation,
            "increment_work": self.work.increment_work,
            "friction_gain": self.work.friction_gain,
            "force_normal": self.force_normal,
            "force_tangential": self.force_tangential,
            "mean_displacement": self.mean_displacement,
            **{f"n_{word}": words.count(word) for word in ("separated", "slip", "stick")},
            "n_increments": self.n_increments,
            "linear_solves": self.linear_solves,
        }


@dataclass(frozen=True, eq=False)
class LoadHistory:
    """The finished steps of a load history.

    Parameters
    ----------
    asked : Scene
        With all steps; the scene of a solution is that of its own step.
    n_steps : int
        Number of steps of the whole history.
    steps : tuple of LoadStep
    """

    asked: Scene
    n_steps: int
    steps: tuple[LoadStep, ...]

    @property
    def motion(self) -> SlipHistory:
        """At the end of the last increment."""
        return self.steps[-1].motion

    def __repr__(self) -> str:
        """Return one line; the steps hold thousands of numbers."""
        return f"LoadHistory({self.where()})"

    @property
    def is_complete(self) -> bool:
        """Whether all steps are finished."""
        return len(self.steps) == self.n_steps

    @property
    def times(self) -> FloatArray:
        """(n_finished,) array [s]: the ends of the steps."""
        return np.array([step.time for step in self.steps])

    def total(self, first: int = 0, last: int | None = None) -> StepWork:
        """Return the work in the steps from `first` (counted from 0) up to, not including, `last`."""
        return sum((step.work for step in self.steps[first:last]), StepWork())

    @property
    def has_coarse_increments(self) -> bool:
        """Whether the size of the increments leaves more than a hundredth of the external work unexplained."""
        work = self.total()
        return abs(work.increment_work) > _COARSE * abs(work.external_work)

    def warnings(self) -> Iterator[ResultWarning]:
        """Warn of increments in which so much slip begins or turns that the dissipation is too small."""
        work = self.total()
        missed = work.missed_dissipation
        if self.is_complete and missed > max(_MISSED * (work.dissipation + missed), _LITTLE * abs(work.external_work)):
            share = 100.0 * missed / (work.dissipation + missed)
            text = (
                f"Slip begins or turns inside increments: the dissipation is about {share:.2g} % too small. "
                "Use more increments."
            )
            yield ResultWarning("coarse increments", "", text, missed)

    def where(self) -> str:
        """Describe how far the history has come."""
        return f"Finished: {self.progress}."

    @property
    def progress(self) -> str:
        """The number of finished steps in words, up to a load factor, or a time where the scene has no factors."""
        count, factors = len(self.steps), self.asked.load_factors
        has_factors = not self.asked.steps and len(factors) == self.n_steps
        last = f"load factor {factors[count - 1]:.6g}" if has_factors else f"t = {self.steps[-1].time:.6g}"
        return f"{count} of {self.n_steps} steps, up to {last}"
