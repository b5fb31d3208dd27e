"""The paper's two examples by elements of rising degree, made by bemkit itself (`docs/make_references.py`).

Plane strain, one static step, friction coefficients 0.5 and 0.1. Finite elements that share nothing with bemkit agree
to the 1e-7 that they can claim (`tests/reference/test_paper.py`).
"""

from __future__ import annotations

import io
import json
from importlib import resources

import numpy as np

from bemkit.reference.values import Answer, Places, Reference, Zone


def paper_reference(number: int) -> Reference:
    """Return the reference of example 1 or 2 along the part ``foundation``."""
    folder = resources.files("bemkit") / "reference" / "data"
    table = (folder / f"paper-{number}.csv").read_text("utf-8")
    s, weight, u_n, u_t, sigma_n, sigma_t = np.loadtxt(io.StringIO(table), delimiter=",", skiprows=1, unpack=True)
    record = json.loads((folder / f"paper-{number}.json").read_text("utf-8"))
    zones = tuple(Zone(record["part"], **zone) for zone in record["zones"])
    energy, force_normal, force_tangential = (record[name] for name in ("energy", "force_normal", "force_tangential"))
    answer = Answer(u_n, u_t, sigma_n, sigma_t, energy, force_normal, force_tangential, zones)
    return Reference(record["source"], (Places(record["part"], s, weight),), answer, record["own_errors"])
