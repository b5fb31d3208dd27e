"""What a solution is compared with: fields at places of the contact boundary, resultants, and ends of zones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from bemkit.arrays import FloatArray, read_only

MEASURES: Mapping[str, str] = MappingProxyType(
    {
        "energy": "energy",
        "sigma_n": "normal traction",
        "sigma_t": "tangential traction",
        "displacement": "displacement",
        "force_normal": "normal force",
        "force_tangential": "friction force",
        "transitions": "transition points",
    }
)
"""The relative errors that `errors_of` measures, by name, with words for tables and figures."""


@dataclass(frozen=True)
class Zone:
    """The end of a contact zone.

    Parameters
    ----------
    part : str
    s : float [m]
        Arc length from the start of the part.
    before, after : str
        ``"separated"``, ``"slip"`` or ``"stick"``; without friction every node in contact slips.
    """

    part: str
    s: float
    before: str
    after: str


@dataclass(frozen=True, eq=False)
class Places:
    """Where fields are compared along one contact part.

    Parameters
    ----------
    part : str
    s : (n,) array [m]
        Arc lengths from the start of the part.
    weight : (n,) array [m]
        Length of boundary that each place stands for.
    """

    part: str
    s: FloatArray
    weight: FloatArray

    def __post_init__(self) -> None:
        read_only(self.s)
        read_only(self.weight)


@dataclass(frozen=True, eq=False)
class Answer:
    """What is compared; columns run over all places of all parts.

    Parameters
    ----------
    u_n, u_t : (n,) arrays [m]
    sigma_n, sigma_t : (n,) arrays [Pa]
    energy : float [J/m]
        1/2 a(u, u).
    force_normal, force_tangential : float [N/m]
        As in `bemkit.Solution`.
    zones : tuple of Zone
    """

    u_n: FloatArray
    u_t: FloatArray
    sigma_n: FloatArray
    sigma_t: FloatArray
    energy: float
    force_normal: float
    force_tangential: float
    zones: tuple[Zone, ...]

    def __post_init__(self) -> None:
        for name in ("u_n", "u_t", "sigma_n", "sigma_t"):
            read_only(getattr(self, name))


@dataclass(frozen=True, eq=False)
class Reference:
    """The answer that others are measured against.

    Parameters
    ----------
    source : str
        Where it comes from, in a few words.
    places : tuple of Places
    answer : Answer
    own_errors : mapping of str to float
        How far it may itself be wrong, by the names of `MEASURES`; round-off where left out.
    """

    source: str
    places: tuple[Places, ...]
    answer: Answer
    own_errors: Mapping[str, float] = field(default_factory=dict)


def errors_of(answer: Answer, reference: Reference) -> dict[str, float]:
    """Return the relative errors of an answer at the places of a reference.

    Returns
    -------
    dict of str to float
        By the names of `MEASURES`: L2 errors of fields relative to the L2 norm of the exact field, of numbers relative
        to the exact number, of transition points relative to the length of their part. nan where the exact value is
        zero or there is no transition point; infinite if a transition point is missing.
    """
    exact = reference.answer
    weight = np.concatenate([places.weight for places in reference.places])

    def of_fields(*names: str) -> float:
        miss = sum(float(weight @ (getattr(answer, name) - getattr(exact, name)) ** 2) for name in names)
        size = sum(float(weight @ getattr(exact, name) ** 2) for name in names)
        return float(np.sqrt(miss / size)) if size > 0.0 else float("nan")

    def of_number(name: str) -> float:
        value = float(getattr(exact, name))
        return abs(float(getattr(answer, name)) / value - 1.0) if value else float("nan")

    return {
        "energy": of_number("energy"),
        "sigma_n": of_fields("sigma_n"),
        "sigma_t": of_fields("sigma_t"),
        "displacement": of_fields("u_n", "u_t"),
        "force_normal": of_number("force_normal"),
        "force_tangential": of_number("force_tangential"),
        "transitions": _of_zones(answer, reference),
    }


def _of_zones(answer: Answer, reference: Reference) -> float:
    """Return the largest distance from an exact end of a zone to the nearest one of the same kind."""
    worst = float("nan")
    lengths = {places.part: float(places.weight.sum()) for places in reference.places}
    for zone in reference.answer.zones:
        kind = (zone.part, zone.before, zone.after)
        found = [abs(other.s - zone.s) for other in answer.zones if (other.part, other.before, other.after) == kind]
        distance = min(found, default=float("inf")) / lengths[zone.part]
        worst = distance if np.isnan(worst) else max(worst, distance)
    return worst
