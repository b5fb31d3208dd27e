"""Loads of clusters that are factored once: those that are expected are solved for at the same time, and their sums."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bemkit.arrays import BoolArray, FloatArray

_MOST = 8
"""Loads that are solved for one by one."""
_SAME = 1e-14
"""Round-off of a load, relative to its largest value."""


class KnownLoads:
    """Loads on some elements, and the sum of them that acts.

    Parameters
    ----------
    has_loads : (n_elements,) bool array
        The elements; values on others are ignored.
    expected : iterable of (n_elements, 4) arrays
        Loads that will act one after another, with others between them; if eight do not make all of them, none.

    Attributes
    ----------
    each : (n_elements, 4, n_loads) array
        The loads: those expected or, as soon as another one acts that is not a sum of them, the one that acts.
    shares : (n_loads,) array
        Those of the loads in the sum.
    """

    def __init__(self, has_loads: BoolArray, expected: Iterable[FloatArray] = ()) -> None:
        self._has_loads = has_loads
        self.each, self.shares = np.zeros((has_loads.size, 4, 0)), np.zeros(0)
        for given in expected:
            if self._shares_of(own := self._own(given)) is None:
                self.each = np.concatenate([self.each, own[:, :, None]], axis=2)
            if self.each.shape[2] > _MOST:
                break
        self._is_expected = 0 < self.each.shape[2] <= _MOST

    def take(self, given: FloatArray, before: FloatArray) -> BoolArray:
        """Take over a load that acts after another one, (n_elements, 4) each.

        Returns
        -------
        (n_elements,) bool array
            Where it asks for new solutions: nowhere if it was expected.
        """
        own = self._own(given)
        if self._is_expected:
            if (shares := self._shares_of(own)) is not None:
                self.shares = shares
                return np.zeros(len(given), bool)
            self._is_expected, before = False, np.full((1, 4), np.nan)
        self.each, self.shares = own[:, :, None], np.ones(1)
        return np.asarray(np.any(given != before, axis=1) & self._has_loads)

    def _own(self, given: FloatArray) -> FloatArray:
        return np.where(self._has_loads[:, None], given, 0.0)

    def _shares_of(self, given: FloatArray) -> FloatArray | None:
        """Return by which the loads add up to another one; None if they do not."""
        shares, loads = np.zeros(self.each.shape[2]), self.each.reshape(given.size, -1)
        for _ in range(2):  # the round-off of the first is that of a sum over all elements
            shares += np.linalg.lstsq(loads, (given - self.each @ shares).ravel())[0]
        left = np.abs(given - self.each @ shares)
        return shares if left.max() <= _SAME * np.abs(given).max() else None
