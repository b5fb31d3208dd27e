"""Distribution of contact pressures: the share of a contact in each interval of pressures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bemkit.results.contact_table import ContactTable
from bemkit.table import column

_FEWEST, _MOST, _NODES = 8, 32, 8
"""Least number of intervals of equal width from zero to the largest pressure, and the mean number of nodes in each if
there are more."""


@dataclass(frozen=True)
class PressureShare:
    """An interval of pressures on one contact; row of the table `pressures`."""

    part: str = column("name of the contact")
    pressure_from: float = column("lower end of the interval", "Pa", ".6g")
    pressure_to: float = column("upper end of the interval", "Pa", ".6g")
    share: float = column("share of the length of the contact with a pressure in it", "", ".6g")
    density: float = column("probability density, the share by the width of the interval", "1/Pa", ".6g")


def pressure_shares(contact: ContactTable, part: str) -> Iterator[PressureShare]:
    """Yield the distribution of the pressures of a contact that are not zero; each node counts by its length."""
    rows = contact.rows(part)
    pressure, length = -contact.sigma_n[rows], contact.weight[rows]
    if not (largest := float(pressure.max(initial=0.0))) > 0.0:
        return
    touches = pressure > 0.0
    n_intervals = min(max(_FEWEST, int(touches.sum()) // _NODES), _MOST)
    counts, edges = np.histogram(pressure[touches], n_intervals, (0.0, largest), weights=length[touches])
    for low, high, share in zip(edges[:-1].tolist(), edges[1:].tolist(), (counts / length.sum()).tolist(), strict=True):
        yield PressureShare(part, low, high, share, share / (high - low))
