"""The paper's two examples by an adaptive p-version of finite elements, which shares nothing with bemkit.

Degree 4 to 6, elements that shrink geometrically to 1e-8 towards transition points, corners and load jumps; plane
strain, one static step, friction coefficients 0.5 and 0.1. Every number comes with an estimate of its error.
"""

from __future__ import annotations

import io
import json
from importlib import resources

import numpy as np

from bemkit.reference.values import Answer, Places, Reference, Zone

_WORDS = {"gap": "separated", "slip-": "slip", "slip+": "slip", "stick": "stick"}


def paper_reference(number: int) -> Reference:
    """Return the reference of example 1 or 2 along the part ``foundation``."""
    folder = resources.files("bemkit") / "reference" / "data"
    table = np.genfromtxt(io.StringIO((folder / f"paper-{number}.csv").read_text("utf-8")), delimiter=",", names=True)
    data = json.loads((folder / f"paper-{number}.json").read_text("utf-8"))
    scalars = data["scalars"]
    weight = np.gradient(table["x"])
    weight[[0, -1]] *= 0.5  # the trapezoidal rule
    zones = []
    for entry in data["transitions"]:
        before, after = (_WORDS[word] for word in entry["type"].split("->"))
        zones.append(Zone("foundation", entry["x"], before, after))
    answer = Answer(
        u_n=table["u_n"].copy(),
        u_t=table["u_t"].copy(),
        sigma_n=table["sigma_n"].copy(),
        sigma_t=table["sigma_t"].copy(),
        energy=scalars["energy"]["value"],
        force_normal=scalars["Fn"]["value"],
        force_tangential=scalars["Ft"]["value"],
        zones=tuple(zones),
    )

    def relative(*names: str) -> float:
        error, size = (sum(weight @ table[prefix + name] ** 2 for name in names) for prefix in ("err_", ""))
        return float(np.sqrt(error / size))

    own = {measure: abs(scalars[key]["err"] / scalars[key]["value"]) for measure, key in _SCALARS.items()}
    own |= {"sigma_n": relative("sigma_n"), "sigma_t": relative("sigma_t"), "displacement": relative("u_n", "u_t")}
    own["transitions"] = max(entry["err"] for entry in data["transitions"]) / float(weight.sum())
    return Reference(
        "adaptive p-version of finite elements", (Places("foundation", table["x"].copy(), weight),), answer, own
    )


_SCALARS = {"energy": "energy", "force_normal": "Fn", "force_tangential": "Ft"}
