"""Estimated over true errors of random scenes, of each degree: percentiles, and the share within 0.5 and 3.

    python -m checks.calibration 50 --seed 7 [--bodies 2] [--jobs N]

True errors are differences from an hp solution of 1e-4. A scene counts at a degree if both solutions are certified, at
least five nodes carry pressure, and the fine solution is five times more accurate.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence

import numpy as np

from bemkit.cli.progress import compute_with_progress
from checks.calibration.trials import DEGREES, Row, trial_tasks

LOW, HIGH = 0.5, 3.0
"""What an estimate may be, in units of the true error."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a table of the calibration."""
    parser = argparse.ArgumentParser(prog="python -m checks.calibration", description=__doc__.split("\n")[0])
    parser.add_argument("count", type=int, help="number of scenes")
    parser.add_argument("--seed", type=int, default=0, help="equal seeds make equal scenes (0)")
    parser.add_argument("--bodies", type=int, default=1, choices=(1, 2), help="number of elastic bodies (1)")
    parser.add_argument("--jobs", type=int, default=1, help="number of processes (1)")
    asked = parser.parse_args(arguments)
    tasks = list(trial_tasks(asked.bodies, asked.seed, asked.count))
    processes = min(asked.jobs, asked.count)
    trials = compute_with_progress(tasks, "scenes", is_live=sys.stderr.isatty(), processes=processes)
    print(table([row for trial in trials for row in trial.rows]))
    return 0


def table(rows: Sequence[Row]) -> str:
    """Return percentiles of estimate over error at 5, 50, 95 %, and the share within `LOW` and `HIGH`."""
    lines = ["degree  scenes  energy at 5, 50, 95 %  within  tractions at 5, 50, 95 %  within  do not count"]
    for degree in DEGREES:
        own = [row for row in rows if row.degree == degree]
        good = [row for row in own if not row.reason]
        reasons = Counter(row.reason for row in own if row.reason).most_common()
        words = ", ".join(f"{count} {reason.replace('_', ' ')}" for reason, count in reasons)
        columns = [_shares(np.array([getattr(row, name) for row in good])) for name in ("energy", "tractions")]
        lines.append(f"{degree:6}  {len(good):6}  {columns[0]}  {columns[1]}     {words}".rstrip())
    return "\n".join(lines)


def _shares(ratios: np.ndarray) -> str:
    if not ratios.size:
        return f"{'-':>21}  {'-':>6}"
    within = np.mean((ratios >= LOW) & (ratios <= HIGH))
    return "  ".join(f"{value:5.2f}" for value in np.percentile(ratios, (5, 50, 95))) + f"  {100.0 * within:5.0f} %"


if __name__ == "__main__":
    sys.exit(main())
