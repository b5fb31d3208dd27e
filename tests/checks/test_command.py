"""The command ``python -m checks.random_scenes``."""

from __future__ import annotations

from pathlib import Path

import pytest

from bemkit.cli.progress import compute_with_progress
from bemkit.scene.toml import load_scene
from bemkit.studies.engine import compute
from checks.random_scenes import random_case
from checks.random_scenes.__main__ import main
from checks.trials import Outcome, Trial, trial_tasks


def test_random_scenes_are_counted(capsys) -> None:
    assert main(["4", "--seed", "7", "--first", "40", "--jobs", "1"]) == 0
    printed = capsys.readouterr().out
    for words in ("4 random scenes", "successes", "warned", "named failures", "wrong successes", "tracebacks"):
        assert words in printed


@pytest.mark.slow
def test_random_scenes_are_the_same_in_processes() -> None:
    tasks = trial_tasks(7, range(40, 44))
    together = list(compute_with_progress(tasks, "random scenes", is_live=False, processes=2))
    assert sorted(together, key=lambda trial: trial.index) == list(compute(tasks))


def test_random_scenes_that_fail_are_saved_and_named(tmp_path: Path, monkeypatch, capsys) -> None:
    found = Trial(7, 41, Outcome.WRONG, "status", "status 1.0e+00")
    monkeypatch.setattr("checks.trials.try_case", lambda seed, index: found)
    assert main(["1", "--seed", "7", "--first", "41", "--save", str(tmp_path / "failures")]) == 1
    printed = capsys.readouterr().out
    assert "wrong success: status: status 1.0e+00" in printed
    assert "python -m checks.random_scenes 1 --seed 7 --first 41" in printed
    saved = tmp_path / "failures" / "random-7-41.toml"
    assert saved.read_text().startswith("# wrong success: status")
    assert load_scene(saved) == random_case(7, 41).scenes[0]
