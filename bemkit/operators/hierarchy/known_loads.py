"""Loads on clusters that are factored once: announced loads are solved for with the factorisation, then summed."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bemkit.arrays import BoolArray, FloatArray

_MOST = 8
"""Largest number of announced loads that are solved for."""
_SAME = 1e-14
"""Round-off of a load, relative to its largest value."""


class KnownLoads:
    """Loads on some elements, and their weighted sum that acts now.

    Parameters
    ----------
    has_loads : (n_elements,) bool array
        The elements; values on others are ignored.
    expected : iterable of (n_elements, 4) arrays
        Announced loads, which will act one after another. If more than eight are linearly independent, none is kept.

    Attributes
    ----------
    each : (n_elements, 4, n_loads) array
        The announced loads or, as soon as a load acts that is not a sum of these, that load.
    shares : (n_loads,) array
        Weights of the loads in the sum.
    """

    def __init__(self, has_loads: BoolArray, expected: Iterable[FloatArray] = ()) -> None:
        self._has_loads = has_loads
        self.each, self.shares = np.zeros((has_loads.size, 4, 0)), np.zeros(0)
        for given in expected:
            if self._shares_of(load := self._on_elements(given)) is None:
                self.each = np.concatenate([self.each, load[:, :, None]], axis=2)
            if self.each.shape[2] > _MOST:
                break
        self._is_expected = 0 < self.each.shape[2] <= _MOST

    def take(self, given: FloatArray, before: FloatArray) -> BoolArray:
        """Replace the load by another one, (n_elements, 4) each.

        Returns
        -------
        (n_elements,) bool array
            Elements whose leaves must be solved again: none if the load is a sum of announced loads.
        """
        load = self._on_elements(given)
        if self._is_expected:
            if (shares := self._shares_of(load)) is not None:
                self.shares = shares
                return np.zeros(len(given), bool)
            self._is_expected, before = False, np.full((1, 4), np.nan)
        self.each, self.shares = load[:, :, None], np.ones(1)
        return np.asarray(np.any(given != before, axis=1) & self._has_loads)

    def _on_elements(self, given: FloatArray) -> FloatArray:
        return np.where(self._has_loads[:, None], given, 0.0)

    def _shares_of(self, given: FloatArray) -> FloatArray | None:
        """Return the weights with which the loads add up to another one; None if none fit."""
        shares, loads = np.zeros(self.each.shape[2]), self.each.reshape(given.size, -1)
        for _ in range(2):  # the second round removes the round-off of sums over all elements
            shares += np.linalg.lstsq(loads, (given - self.each @ shares).ravel())[0]
        residual = np.abs(given - self.each @ shares)
        return shares if residual.max() <= _SAME * np.abs(given).max() else None
