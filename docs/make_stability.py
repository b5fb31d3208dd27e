"""Fill the tables of ``docs/stability.md``: ``python docs/make_stability.py`` runs all sweeps again (some minutes)."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from markers import between

import bemkit as bk
from bemkit.scene.toml import with_overrides
from bemkit.studies.stability.axes import AXES
from bemkit.studies.stability.records import Verdict, to_markdown
from bemkit.studies.stability.sweep import sweep

PAGE = Path(__file__).parent / "stability.md"
RUNS = (("paper-1", "linear"), ("paper-2", "constant"), ("paper-1", "constant"), ("paper-2", "linear"))
N_FULL = 2  # the others are counted only


def main() -> None:
    """Run the sweeps and write their tables between the markers of the page."""
    text = PAGE.read_text("utf-8")
    summary = ["| scene | elements | rows | " + " | ".join(v.value for v in Verdict) + " |", "|---|---|" + "---:|" * 6]
    for number, (name, discretisation) in enumerate(RUNS):
        scene = with_overrides(bk.load_scene(name), discretisation=discretisation)
        rows = list(sweep(scene, AXES))
        counts = Counter(row.verdict for row in rows)
        numbers = " | ".join(str(counts[verdict.value]) for verdict in Verdict)
        summary.append(f"| `{name}` | {discretisation} | {len(rows)} | {numbers} |")
        if number < N_FULL:
            text = between(text, f"{name}-{discretisation}", to_markdown(AXES, rows))
    PAGE.write_text(between(text, "summary", "\n".join(summary)), "utf-8")


if __name__ == "__main__":
    main()
