"""Make the reference solutions of the paper's examples again; takes a few minutes.

python docs/make_references.py
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

import bemkit as bk
from bemkit.reference import Reference, over_resolved

FOLDER = Path(bk.__file__).parent / "reference" / "data"
MOST_ELEMENTS = 1200


def main() -> None:
    """Write a table and a record for each example."""
    for number in (1, 2):
        write(over_resolved(bk.load_scene(f"paper-{number}"), MOST_ELEMENTS), FOLDER / f"paper-{number}")


def write(reference: Reference, path: Path) -> None:
    """Write a reference along one contact part."""
    (places,), answer = reference.places, reference.answer
    columns = [places.s, places.weight, answer.u_n, answer.u_t, answer.sigma_n, answer.sigma_t]
    header = "s,weight,u_n,u_t,sigma_n,sigma_t"
    np.savetxt(path.with_suffix(".csv"), np.stack(columns, axis=1), "%.14g", ",", header=header, comments="")
    record = {
        "source": reference.source,
        "part": places.part,
        "energy": answer.energy,
        "force_normal": answer.force_normal,
        "force_tangential": answer.force_tangential,
        "zones": [{"s": zone.s, "before": zone.before, "after": zone.after} for zone in answer.zones],
        "own_errors": {name: error for name, error in reference.own_errors.items() if np.isfinite(error)},
    }
    path.with_suffix(".json").write_text(json.dumps(record, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
