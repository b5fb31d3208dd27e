"""Load histories with every increment halved."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

import bemkit as bk
from bemkit.cli.main import main
from bemkit.errors import NoResultError
from bemkit.studies.increments import increment_errors, with_halved_increments

LOOP = replace(bk.load_scene("friction-loop"), mesh=bk.MeshOptions(elements=32))


def loop(increments: int) -> bk.Scene:
    """The loop with a number of increments on its way there and back."""
    press, shear = LOOP.steps
    return replace(LOOP, steps=(press, replace(shear, increments=increments)))


@pytest.mark.slow
def test_errors_of_a_loop_fall_with_the_increments() -> None:
    """Slip that begins within an increment counts from its start: of the second order, more or less."""
    few, more = (increment_errors(loop(n)) for n in (10, 20))
    assert (few.n_increments, more.n_increments) == (12, 22)
    assert few.dissipation is not None
    assert more.dissipation is not None
    assert 1.8 < few.dissipation / more.dissipation < 8.0
    # the change is most of the error: three quarters of one of second order, half of one of first
    exact, coarse = (bk.run([loop(n)])[-1].loading.total().dissipation for n in (60, 10))
    assert few.dissipation == pytest.approx(abs(exact - coarse) / exact, rel=0.5)


def test_load_factors_are_halved_on_their_way() -> None:
    scene = replace(bk.load_scene("paper-1"), load_factors=(0.5, 1.0, 0.2), mesh=bk.MeshOptions(elements=40))
    assert with_halved_increments(scene).load_factors == (0.25, 0.5, 0.75, 1.0, 0.6, 0.2)
    errors = increment_errors(scene)
    assert errors.n_increments == 3
    assert errors.tractions is not None
    assert errors.tractions < 0.2


def test_bodies_without_friction_follow_no_path() -> None:
    scene = replace(bk.load_scene("paper-1"), law=bk.Frictionless(), load_factors=(0.5, 1.0))
    errors = increment_errors(replace(scene, mesh=bk.MeshOptions(elements=24)))
    assert errors.dissipation is None
    assert errors.tractions == pytest.approx(0.0, abs=1e-9)  # round-off of the solves


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        (bk.load_scene("paper-1"), "the scene has a single load: increments need"),
        (replace(LOOP, discretisation=bk.Galerkin(2), mesh=bk.MeshOptions(accuracy=0.1)), "the scene has an accuracy"),
    ],
)
def test_refusals(scene: bk.Scene, message: str) -> None:
    with pytest.raises(bk.InputError, match=message):
        increment_errors(scene)


def test_a_history_that_fails_has_no_errors() -> None:
    with pytest.raises(NoResultError, match="the history as stated is not solved: "):
        increment_errors(replace(loop(1), solver=bk.SemismoothNewton(max_steps=1)))


def test_the_command_prints_and_writes_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "errors.json"
    (tmp_path / "loop.toml").write_text(bk.scene_to_toml(loop(4)), "utf-8")
    with pytest.raises(SystemExit, match="0"):
        main(["study", "increments", str(tmp_path / "loop.toml"), "--json", str(file)])
    assert "6 increments; halving all of them changes" in capsys.readouterr().out
    assert json.loads(file.read_text())["n_increments"] == 6
