"""Warm starts from other meshes, and nested iteration."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.cli.main import main
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.runs.nested import run_nested
from bemkit.runs.warm_start import state_on
from bemkit.solvers.active_sets import contact_sets
from bemkit.solvers.base import StepRecord
from tests.scene.test_load_history import block
from tests.slow import slow_except

DISCRETISATIONS = {"constant": bk.ConstantCollocation(), "linear": bk.Galerkin(1)}


def example(number: int, discretisation: str, elements: int) -> bk.Scene:
    scene = bk.load_scene(f"paper-{number}")
    mesh = dataclasses.replace(scene.mesh, elements=elements)
    return dataclasses.replace(scene, discretisation=DISCRETISATIONS[discretisation], mesh=mesh)


@pytest.mark.parametrize("number", slow_except((1, 2), 1))
@pytest.mark.parametrize("discretisation", slow_except(DISCRETISATIONS, "constant"))
def test_the_finest_mesh_costs_two_solves(number: int, discretisation: str) -> None:
    scene = example(number, discretisation, 320)
    levels = run_nested(scene)
    assert [level.mesh.n_elements for level in levels] == [40, 80, 160, 320]
    assert all(level.is_converged for level in levels)
    assert levels[-1].linear_solves <= 2
    cold = bk.run(scene)
    assert cold.linear_solves >= 5
    np.testing.assert_array_equal(levels[-1].contact.status, cold.contact.status)
    np.testing.assert_allclose(levels[-1].contact.sigma_n, cold.contact.sigma_n, atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(("number", "discretisation"), [(1, "constant"), (2, "constant"), (2, "linear")])
def test_solves_do_not_grow_with_the_mesh(number: int, discretisation: str) -> None:
    levels = run_nested(example(number, discretisation, 2560), coarsest=320)
    assert [level.mesh.n_elements for level in levels] == [320, 640, 1280, 2560]
    assert max(level.linear_solves for level in levels[1:]) <= 2


def test_a_solution_is_its_own_start() -> None:
    scene = example(1, "linear", 160)
    solution = bk.run(scene)
    again = bk.run(scene, start=solution)
    assert (again.linear_solves, again.outer_steps) == (1, 0)
    np.testing.assert_allclose(again.contact.sigma_n, solution.contact.sigma_n, atol=1e-12)


def test_interpolation_keeps_fields_and_units() -> None:
    scene = example(1, "linear", 160)
    solution = bk.run(scene)
    model = build_model(prepare(example(1, "constant", 240), example(1, "constant", 240).build_mesh()))
    state = state_on(model, solution)
    x = model.units.to_physical(model.prepared.contact_nodes.points)[:, 0]
    contact = solution.contact
    np.testing.assert_allclose(state.u_n * model.units.displacement, np.interp(x, contact.x, contact.u_n), rtol=1e-9)
    np.testing.assert_allclose(state.sigma_t * model.units.stress, np.interp(x, contact.x, contact.sigma_t), atol=1e-12)
    assert contact_sets(model.problem, state).is_closed.sum() == pytest.approx(np.sum(x > 0.2576), abs=2)


def test_starts_need_the_same_parts() -> None:
    solution = bk.run(example(1, "linear", 40))
    with pytest.raises(ValueError, match="the start has no contact 'floor': it has foundation"):
        bk.run(block(), start=solution)
    with pytest.raises(ValueError, match="the start has no contact 'foundation': it has none"):
        bk.run(solution.scene, start=bk.run(bk.load_scene("bending")))
    with pytest.raises(ValueError, match="start is a Scene: give a Solution"):
        bk.run(solution.scene, start=solution.scene)


def test_a_mesh_that_fails_is_no_start() -> None:
    scene = dataclasses.replace(example(1, "linear", 160), solver=bk.SemismoothNewton(max_steps=1))
    levels = run_nested(scene)
    assert not levels[-1].is_converged
    # all of them start cold
    for level in levels:
        cold = bk.run(level.scene)
        assert cold.history == level.history


@pytest.mark.parametrize(
    ("options", "message"),
    [({"coarsest": 2}, "coarsest = 2"), ({"load_factors": (0.5, 1.0)}, "load history of 2 steps")],
)
def test_refusals(options: dict[str, object], message: str) -> None:
    scene = example(1, "linear", 40)
    if "load_factors" in options:
        scene = dataclasses.replace(scene, load_factors=(0.5, 1.0))
        options = {}
    with pytest.raises(ValueError, match=message):
        run_nested(scene, **options)  # type: ignore[arg-type]


def test_the_command_line_cascades(capsys: pytest.CaptureFixture[str]) -> None:
    spent = []
    for options in ([], ["--cascade"]):
        with pytest.raises(SystemExit) as caught:
            main(["run", "paper-1", "--elements", "160", "--json", "-", *options])
        assert caught.value.code == 0
        spent.append(json.loads(capsys.readouterr().out))
    assert spent[1]["linear_solves"] <= 2 < spent[0]["linear_solves"]
    assert spent[1]["force_tangential"] == pytest.approx(spent[0]["force_tangential"], rel=1e-9)


def test_nested_meshes_are_an_option_of_run() -> None:
    scene = example(1, "linear", 160)
    records: list[StepRecord] = []
    solution = bk.run(scene, coarsest=40, callback=records.append)
    assert solution.linear_solves <= 2 < bk.run(scene).linear_solves
    assert len(records) > len(solution.history)  # those of the coarser meshes, too
    with pytest.raises(ValueError, match="coarsest is given with a mesh or a start: nested meshes have their own"):
        bk.run(scene, coarsest=40, start=solution)
    with pytest.raises(ValueError, match="an accuracy is given with coarsest: its meshes start from each other"):
        bk.run(dataclasses.replace(scene, mesh=bk.MeshOptions(accuracy=0.1)), coarsest=40)
    with pytest.raises(ValueError, match="coarsest is given with a sequence of scenes: nested meshes take a single"):
        bk.run([scene], coarsest=40)


def test_a_sequence_has_no_file(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="file is given with a sequence of scenes: a file holds one scene"):
        bk.run([block()], file=tmp_path / "r.h5")
