"""Sweeps: every row is what a run of its scene gives, shared bodies are made once, failed rows cost no other."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.errors import BemkitError
from bemkit.runs import shared_body as shared_module
from bemkit.scene.keys import Key
from bemkit.studies.sweep.grid import with_values
from bemkit.studies.sweep.table import Sweep
from tests.studies.sweep.tables import equal_rows

SCENE = replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=40))
HEAVY = replace(bk.load_scene("gravity-column"), mesh=bk.MeshOptions(elements=24))
FRICTION = "law.friction_coefficient"
CYLINDERS = replace(bk.load_scene("two-cylinders"), mesh=bk.MeshOptions(elements=24))
RESULTS = ("force_normal", "force_tangential", "energy", "contact_length", "peak_pressure", "largest_slip")


def check_rows(scene: bk.Scene | bk.Scene, table: Sweep) -> None:
    """Compare every row with a run of its scene."""
    assert not table.failed
    for row in table.rows:
        keys = [Key(key) for key in table.keys]
        alone = bk.run(with_values(scene, dict(zip(keys, row.values, strict=True))))
        contacts = alone.contacts
        expected = {
            "force_normal": alone.force_normal,
            "force_tangential": alone.force_tangential,
            "energy": alone.energy,
            "contact_length": sum(contact.contact_length for contact in contacts),
            "peak_pressure": max((contact.peak_pressure for contact in contacts), default=0.0),
            "largest_slip": max((contact.largest_slip for contact in contacts), default=0.0),
        }
        assert row.status == alone.status.name.lower()
        for name, value in expected.items():
            # the same equations, solved from another start: nothing but amplified round-off
            assert getattr(row, name) == pytest.approx(value, rel=1e-9, abs=1e-12 * abs(alone.force_normal)), name
        assert row.transitions.count(";") == max(len(alone.transitions) - 1, 0)


@pytest.fixture
def bodies_made(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Count the bodies that are assembled for several rows."""
    made: list[str] = []

    def counted(name: str) -> None:
        build = getattr(shared_module, name)
        monkeypatch.setattr(shared_module, name, lambda prepared: made.append(name) or build(prepared))

    counted("build_model")
    return made


@pytest.mark.parametrize(
    ("vary", "n_bodies"),
    [
        ({FRICTION: [0.0, 0.1, 0.5, 2.0]}, 1),
        pytest.param({"parts.top-load.condition.y": [-1e-3, -1.0, -1e4]}, 1, marks=pytest.mark.slow),
        pytest.param({"parts.foundation.condition.obstacle.point[1]": [0.0, -1e-5]}, 1, marks=pytest.mark.slow),
        # the obstacle turns: the body is condensed anew, not assembled
        pytest.param(
            {"parts.foundation.condition.obstacle.normal[0]": [0.0, 1e-4], FRICTION: [0.2, 0.4]},
            1,
            marks=pytest.mark.slow,
        ),
        ({"load_factors[0]": [0.5, 3.0]}, 1),
        pytest.param({FRICTION: [0.2, 0.4], "material.poisson_ratio": [0.0, 0.3, 0.5]}, 3, marks=pytest.mark.slow),
        pytest.param({"mesh.elements": [32, 48]}, 0, marks=pytest.mark.slow),
        ({"shape.height": [1.0, 1.5], FRICTION: [0.2, 0.4]}, 2),
        pytest.param({"solver.max_steps": [50, 60]}, 1, marks=pytest.mark.slow),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, dict) else str(value),
)
def test_rows_are_what_runs_give_and_bodies_are_made_once(
    vary: dict[str, list[float]], n_bodies: int, bodies_made: list[str]
) -> None:
    scene = replace(SCENE, solver=bk.SemismoothNewton(max_steps=40))
    table = bk.sweep(scene, vary)
    assert len(bodies_made) == n_bodies
    check_rows(scene, table)


@pytest.mark.slow
def test_load_histories_begin_at_rest_in_every_row(bodies_made: list[str]) -> None:
    scene = replace(SCENE, load_factors=(0.5, 1.0, 0.7))
    table = bk.sweep(scene, {FRICTION: [0.3, 0.5], "load_factors[2]": [0.8, 0.2]})
    assert len(bodies_made) == 1
    check_rows(scene, table)


def test_weight_changes_with_the_rows(bodies_made: list[str]) -> None:
    table = bk.sweep(HEAVY, {"body_forces[0].density": [2400.0, 7800.0]})
    assert len(bodies_made) == 1
    check_rows(HEAVY, table)


@pytest.mark.parametrize(
    ("vary", "n_bodies"),
    [
        ({FRICTION: [0.3], "bodies.upper.parts.pushed.condition.y": [-0.0022, -0.004]}, 1),
        pytest.param({"contacts[0].gap": [0.0, -0.001]}, 1, marks=pytest.mark.slow),
        pytest.param({"bodies.lower.material.youngs_modulus": [0.91, 9.1]}, 0, marks=pytest.mark.slow),
    ],
    ids=["loads", "gaps", "bodies"],
)
def test_rows_of_several_bodies(vary: dict[str, list[float]], n_bodies: int, bodies_made: list[str]) -> None:
    table = bk.sweep(CYLINDERS, vary)
    assert len(bodies_made) == n_bodies
    check_rows(CYLINDERS, table)


def test_rows_with_an_accuracy_have_their_own_meshes(bodies_made: list[str]) -> None:
    scene = replace(SCENE, mesh=bk.MeshOptions(accuracy=0.1), discretisation=bk.Galerkin(1))
    table = bk.sweep(scene, {FRICTION: [0.3, 0.6]})
    assert not bodies_made
    assert all(0.0 < row.estimated_error < 0.1 for row in table.rows)
    check_rows(scene, table)


def test_rows_start_near_by_or_cold() -> None:
    values = {FRICTION: [0.5, 0.51, 0.52]}
    near, cold = bk.sweep(SCENE, values), bk.sweep(SCENE, values, cold=True)
    alone = bk.run(replace(SCENE, law=bk.Coulomb(0.52)))
    assert cold.rows[-1].linear_solves == alone.linear_solves > near.rows[-1].linear_solves
    for name in RESULTS:
        assert near.column(name) == pytest.approx(cold.column(name), rel=1e-10)


def test_failed_rows_are_named_and_cost_no_other() -> None:
    table = bk.sweep(SCENE, {FRICTION: [0.2, -1.0, 0.4], "material.poisson_ratio": [0.2, 0.7]})
    assert [row.values for row in table.solved] == [(0.2, 0.2), (0.4, 0.2)]
    assert [row.values for row in table.failed] == [(0.2, 0.7), (-1.0, 0.2), (-1.0, 0.7), (0.4, 0.7)]
    assert table.failed[0].message == "material: poisson_ratio is 0.7: it must lie in (-1, 0.5]"
    assert "friction_coefficient = -1; give a number >= 0" in table.failed[1].message
    assert {row.status for row in table.failed} == {"refused"}
    assert np.isnan(table.failed[0].energy)
    check_rows(SCENE, Sweep(SCENE, table.keys, table.solved))


def test_loads_that_nothing_holds_and_solves_that_end_early_are_failed_rows() -> None:
    lifted = bk.sweep(SCENE, {"parts.top-load.condition.y": [1.0, -1.0, -2.0]})
    assert [row.values for row in lifted.failed] == [(1.0,)]
    assert lifted.failed[0].message.startswith("the load pushes the body upward with 0.5")
    hasty = bk.sweep(replace(SCENE, solver=bk.SemismoothNewton(max_steps=9)), {"solver.max_steps": [1, 40]}, cold=True)
    assert [(row.status, row.certified) for row in hasty.rows] == [("max_steps", 0), ("converged", 1)]
    assert np.isnan(hasty.rows[0].force_normal)
    assert hasty.rows[0].message


def test_a_sweep_without_any_valid_row_is_refused() -> None:
    with pytest.raises(BemkitError, match="no row is a valid scene: law: friction_coefficient = -1"):
        bk.sweep(SCENE, {FRICTION: [-1.0, -2.0]})


def test_scenes_with_python_functions_are_refused() -> None:
    load = bk.Part("load", bk.Traction(y=lambda x, y: -x), sides=("top",))
    parts = [load if part.name == "top-load" else part for part in SCENE.parts]
    with pytest.raises(BemkitError, match=r"a Python function cannot be written to TOML: use Expression"):
        bk.sweep(replace(SCENE, parts=tuple(parts)), {FRICTION: [0.1]})


def test_rows_are_on_disk_and_more_can_be_added(tmp_path: Path) -> None:
    path = tmp_path / "table.jsonl"
    first = bk.sweep(SCENE, {FRICTION: [0.4, 0.2]}, file=path)
    assert equal_rows(Sweep.read(path).rows, first.rows[::-1])
    assert Sweep.read(path).scene == SCENE
    again = bk.sweep(SCENE, {FRICTION: [0.4, 0.2]}, file=path).rows
    assert repr(again) == repr(first.rows)  # with the times of the first solves
    more = bk.sweep(SCENE, {FRICTION: [0.2, 0.3]}, file=path)
    assert equal_rows(more.rows[:1], first.rows[1:])
    assert [row.values for row in Sweep.read(path).rows] == [(0.2,), (0.3,), (0.4,)]
    with pytest.raises(BemkitError, match="holds a study with keys"):
        bk.sweep(SCENE, {"material.poisson_ratio": [0.3]}, file=path)
    with pytest.raises(BemkitError, match="holds a study with starts near, not cold"):
        bk.sweep(SCENE, {FRICTION: [0.2]}, file=path, cold=True)


@pytest.mark.slow
def test_executors_give_the_same_rows() -> None:
    values = {FRICTION: [0.1, 0.3], "material.poisson_ratio": [0.0, 0.3]}
    with ThreadPoolExecutor(2) as executor:
        spread = bk.sweep(SCENE, values, executor=executor)
    for name in RESULTS:
        assert spread.column(name) == pytest.approx(bk.sweep(SCENE, values).column(name), rel=1e-9)


def test_a_cluster_gives_the_same_rows() -> None:
    distributed = pytest.importorskip("distributed")
    values = {FRICTION: [0.1, 0.3]}
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as local:
        with distributed.Client(local) as client:
            spread = bk.sweep(SCENE, values, executor=client.get_executor())
    assert spread.column("energy") == pytest.approx(bk.sweep(SCENE, values).column("energy"), rel=1e-9)
