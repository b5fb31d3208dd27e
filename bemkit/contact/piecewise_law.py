"""Different friction laws on different parts of the contact boundary."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.body import SlipHistory
from bemkit.contact.laws import FrictionLaw, RescaledLaw
from bemkit.errors import InputError


@dataclass(frozen=True, eq=False)
class PiecewiseLaw(FrictionLaw):
    """Each contact node under the law of its part.

    Parameters
    ----------
    laws : sequence of FrictionLaw
        Each for as many nodes as it has below.
    nodes : sequence of (m,) int arrays
        The contact nodes of each law; together every contact node exactly once.

    Raises
    ------
    ValueError
        If a node is missing or has two laws.
    """

    laws: Sequence[FrictionLaw]
    nodes: Sequence[IntArray]

    def __post_init__(self) -> None:
        numbers = np.sort(np.concatenate(list(self.nodes)))
        if len(self.laws) != len(self.nodes) or not np.array_equal(numbers, np.arange(numbers.size)):
            raise InputError(f"nodes = {self.nodes}; give every contact node to exactly one of {len(self.laws)} laws")

    @property
    def is_frictionless(self) -> bool:
        """Whether all the laws are."""
        return all(law.is_frictionless for law in self.laws)

    @property
    def needs_history(self) -> bool:
        """Whether one of the laws does."""
        return any(law.needs_history for law in self.laws)

    def at_slip(self, motion: SlipHistory) -> PiecewiseLaw:
        """Return the laws for one load step."""
        return PiecewiseLaw([law.at_slip(motion.of(nodes)) for law, nodes in self._pairs], self.nodes)

    @cached_property
    def acts_across_gap(self) -> BoolArray:
        """(n_contact,) bool array: what the law of each node says."""
        values = [np.broadcast_to(law.acts_across_gap, nodes.shape) for law, nodes in self._pairs]
        return self._assembled(values).astype(bool)

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return the bound by the law of each node."""
        return self._assembled([law.bound(sigma_n[nodes]) for law, nodes in self._pairs])

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return the derivative by the law of each node."""
        return self._assembled([law.bound_derivative(sigma_n[nodes]) for law, nodes in self._pairs])

    def scaled(self, stress_scale: float) -> PiecewiseLaw:
        """Return the laws in units of `stress_scale`."""
        return PiecewiseLaw([law.scaled(stress_scale) for law in self.laws], self.nodes)

    @property
    def _pairs(self) -> list[tuple[FrictionLaw, IntArray]]:
        return list(zip(self.laws, self.nodes, strict=True))

    def _assembled(self, values: Sequence[FloatArray | BoolArray]) -> FloatArray:
        result = np.empty(sum(nodes.size for nodes in self.nodes))
        for value, (_, nodes) in zip(values, self._pairs, strict=True):
            result[nodes] = value
        return result


def law_name(law: FrictionLaw) -> str:
    """Return the name of the class that the user gave, also of a law wrapped by others, for messages."""
    if isinstance(law, RescaledLaw):
        return law_name(law.law)
    if isinstance(law, PiecewiseLaw):
        return " or ".join(dict.fromkeys(law_name(part) for part in law.laws))
    return type(law).__name__
