"""The command ``python -m checks.rolls``."""

from __future__ import annotations

import pytest

from checks.rolls import drawn_roll, main, try_roll
from checks.trials import Outcome

WRONG = "inside without contact"


@pytest.mark.parametrize(("count", "seed"), [(3, 4), pytest.param(200, 1, marks=pytest.mark.slow)])
def test_no_roll_is_converged_without_contact_inside_of_its_obstacle(count: int, seed: int, capsys) -> None:
    assert main([str(count), "--seed", str(seed), "--jobs", "1"]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert sum(int(line.split()[0]) for line in printed) == count


def test_a_roll_that_is_not_found_is_wrong(monkeypatch) -> None:
    """Without the search between nodes the first rolls are silently without contact."""
    monkeypatch.setattr("bemkit.runs.steps.with_missed_contact_named", lambda solution: solution)
    indices = [index for index in range(40) if drawn_roll(1, index).scene.mesh.accuracy is None][:4]
    assert any(try_roll(1, index).reason == WRONG for index in indices)


def test_rolls_are_drawn_alike() -> None:
    assert drawn_roll(7, 3) == drawn_roll(7, 3)
    assert try_roll(1, 0).outcome is not Outcome.TRACEBACK
