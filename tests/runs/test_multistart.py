"""Scenes with more than one solution."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.cli.main import main
from bemkit.runs.adaptive import run_adaptive
from bemkit.runs.distinct_solutions import distinct_solutions
from bemkit.runs.run import UnsolvableSceneError
from bemkit.runs.steps import RunOptions, guess_from
from bemkit.scene.toml import scene_to_toml
from tests.scene.test_load_history import block


def leg(friction: float) -> bk.Scene:
    """A slanted leg, clamped at its top, with its foot on the floor; pressing it sideways wedges it or lifts it."""
    return bk.Scene(
        title="leg",
        shape=bk.Polygon(((0.0, 0.0), (0.2, 0.0), (1.2, 1.0), (1.0, 1.0))),
        material=bk.Material(1.0, 0.3),
        law=bk.Coulomb(friction),
        parts=(
            bk.Part("foot", bk.Contact(bk.RigidHalfPlane()), sides=("side-1",)),
            bk.Part("top", bk.Clamped(), sides=("side-3",)),
            bk.Part(
                "load",
                bk.Traction(x=-1e-3 * np.cos(np.pi / 6), y=-0.5e-3),
                sides=("side-2",),
                where=bk.Expression("y < 0.3"),
            ),
        ),
        mesh=bk.MeshOptions(elements=80),
    )


@pytest.mark.slow
def test_a_leg_with_high_friction_has_two_answers() -> None:
    found = distinct_solutions(leg(3.0))
    assert len(found) == 2
    assert all(solution.is_converged and solution.certificate.worst <= 1e-9 for solution in found)
    assert sorted(solution.force_normal > 0.0 for solution in found) == [False, True]
    assert len(distinct_solutions(leg(0.3))) == 1
    # each is a solution of its own when it is the start
    for solution in found:
        again = bk.run(leg(3.0), start=solution)
        np.testing.assert_array_equal(again.contact.status, solution.contact.status)


@pytest.mark.slow
def test_a_probe_takes_the_mesh_that_an_accuracy_needs() -> None:
    scene = dataclasses.replace(leg(0.3), mesh=bk.MeshOptions(accuracy=0.1))
    (found,) = distinct_solutions(scene)
    assert found.mesh.n_elements == bk.run(scene).mesh.n_elements


@pytest.mark.slow
def test_a_start_chooses_the_solution_of_the_first_of_adaptive_meshes() -> None:
    scene = dataclasses.replace(leg(3.0), mesh=bk.MeshOptions(accuracy=0.1))
    for start in distinct_solutions(leg(3.0)):
        first, *_ = run_adaptive(scene, RunOptions(guess_from(scene, start)))
        assert first.mesh.n_elements != start.mesh.n_elements
        assert (first.force_normal > 0.0) == (start.force_normal > 0.0)


def test_refusals() -> None:
    with pytest.raises(ValueError, match="a load history of 2 steps cannot be searched for distinct solutions"):
        distinct_solutions(dataclasses.replace(leg(1.0), load_factors=(0.5, 1.0)))
    with pytest.raises(ValueError, match="n_starts = -1"):
        distinct_solutions(leg(1.0), n_starts=-1)
    with pytest.raises(UnsolvableSceneError, match="slides the body to the right"):
        distinct_solutions(block(push=0.6))


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as caught:
        main(["study", "solutions", *arguments])
    assert isinstance(caught.value.code, int)
    return caught.value.code


def test_the_command_says_how_many(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "leg.toml"
    path.write_text(scene_to_toml(leg(3.0)))
    assert call(str(path)) == 0
    assert "2 distinct solutions from 8 starts" in capsys.readouterr().out
    assert call(str(path), "--json", "-", "--starts", "4") == 0
    result = json.loads(capsys.readouterr().out)
    assert result["starts"] == 4
    assert all(solution["converged"] for solution in result["solutions"])
    assert call("paper-1", "--elements", "40") == 0
    assert "1 distinct solution from 8 starts" in capsys.readouterr().out
    assert call("paper-1", "--elements", "40", "--starts", "0") == 1
    assert "none of 0 starts" in capsys.readouterr().out
    assert call("missing") == 2
    assert call("paper-1", "--starts", "-1") == 2
    bad = tmp_path / "bad.toml"
    text = scene_to_toml(leg(3.0))
    bad.write_text(text.replace("friction_coefficient = 3.0", 'friction_coefficient = "x - 0.1"'))
    history = tmp_path / "history.toml"
    history.write_text(text.replace("[law]", "load_factors = [0.5, 1.0]\n[law]"))
    for path in (bad, history):
        assert path.read_text() != text
        assert call(str(path)) == 2
    with pytest.raises(SystemExit) as caught:
        main(["run", str(history), "--cascade"])
    assert caught.value.code == 2
    errors = [line for line in capsys.readouterr().err.splitlines() if line]
    assert len(errors) == 5
    assert all(line.startswith("bemkit: error: ") for line in errors)
    assert "part 'foot': friction law: friction_coefficient" in errors[2]


def test_a_single_load_factor_scales_the_load() -> None:
    scene = block()
    (found,) = distinct_solutions(dataclasses.replace(scene, load_factors=(2.0,)), n_starts=1)
    (single,) = distinct_solutions(scene, n_starts=1)
    assert found.force_normal == pytest.approx(2.0 * single.force_normal, rel=1e-9)
