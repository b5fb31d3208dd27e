"""Random scenes and assemblies, solved and judged by the independent check.

    python -m checks.random_scenes 2000 --seed 7 [--first N] [--jobs N] [--save DIR]

Every fourth has several bodies. The exit code is 1 if an answer is wrong or an error has no name.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from os import cpu_count
from pathlib import Path

from bemkit.cli.progress import compute_with_progress
from checks.trials import Outcome, Trial, save_trial, trial_tasks

OUTCOMES = {
    Outcome.SUCCESS: "successes",
    Outcome.WARNED: "warned",
    Outcome.NAMED: "named failures",
    Outcome.WRONG: "wrong successes",
    Outcome.TRACEBACK: "tracebacks",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Solve and judge random scenes; those that fail are on the disk as soon as they are known."""
    parser = argparse.ArgumentParser(prog="python -m checks.random_scenes", description=__doc__.split("\n")[0])
    parser.add_argument("count", type=int, help="number of scenes")
    parser.add_argument("--seed", type=int, default=0, help="equal seeds make equal scenes (0)")
    parser.add_argument("--first", type=int, default=0, help="index of the first scene (0)")
    parser.add_argument("--jobs", type=int, default=cpu_count() or 1, help="number of processes")
    parser.add_argument("--save", type=Path, metavar="DIR", help="keep scenes that fail as TOML in a folder")
    asked = parser.parse_args(arguments)
    if asked.save is not None:
        asked.save.mkdir(parents=True, exist_ok=True)
    tasks = trial_tasks(asked.seed, range(asked.first, asked.first + asked.count))
    trials, processes = [], min(asked.jobs, asked.count)
    for trial in compute_with_progress(tasks, "random scenes", is_live=sys.stderr.isatty(), processes=processes):
        trials.append(trial)
        if asked.save is not None and trial.is_failure:
            save_trial(trial, asked.save)
    print(summary(sorted(trials, key=lambda trial: trial.index)))
    return int(any(trial.is_failure for trial in trials))


def summary(trials: Sequence[Trial]) -> str:
    """Return how many scenes came to which end and why, and the command that repeats each failure."""
    lines = [f"{len(trials)} random scenes"]
    for outcome, plural in OUTCOMES.items():
        own = [trial for trial in trials if trial.outcome is outcome]
        reasons = Counter(trial.reason for trial in own if trial.reason and outcome is not Outcome.WARNED)
        why = ", ".join(f"{reason.replace('_', ' ')} {count}" for reason, count in reasons.most_common())
        lines.append(f"{plural:<16} {len(own):5}  {why}".rstrip())
    for trial in filter(lambda trial: trial.is_failure, trials):
        lines.append(f"{trial.outcome.value}: {trial.reason}: {trial.message.strip().splitlines()[-1]}")
        lines.append(f"  python -m checks.random_scenes 1 --seed {trial.seed} --first {trial.index} --save .")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
