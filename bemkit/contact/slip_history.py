"""How contact nodes have slipped in the course of a load history."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class SlipHistory:
    """Time and slip at the end of an increment, in the units of the user.

    Parameters
    ----------
    time, time_step : float [s]
        Now, and since the increment before.
    slip : (n_contact,) array [m]
        Length of the path that each node has slipped while it was closed, this increment included; never falls.
    last_slip : (n_contact,) array [m]
        What this increment has added.
    """

    time: float
    time_step: float
    slip: FloatArray
    last_slip: FloatArray

    @classmethod
    def at_rest(cls, n_contact: int) -> SlipHistory:
        """Return what is before any load."""
        return cls(0.0, 0.0, np.zeros(n_contact), np.zeros(n_contact))

    @property
    def rate(self) -> FloatArray:
        """(n_contact,) array [m/s]: the speed of slip in this increment."""
        return self.last_slip / self.time_step if self.time_step > 0.0 else np.zeros_like(self.last_slip)

    def followed(self, time: float, slip: FloatArray, is_closed: BoolArray) -> SlipHistory:
        """Return the history after one increment more, in which closed nodes slip by (n_contact,) lengths [m]."""
        added = np.where(is_closed, np.abs(slip), 0.0)
        return SlipHistory(time, time - self.time, self.slip + added, added)

    def of(self, nodes: IntArray) -> SlipHistory:
        """Return that of some of the nodes."""
        return SlipHistory(self.time, self.time_step, self.slip[nodes], self.last_slip[nodes])
