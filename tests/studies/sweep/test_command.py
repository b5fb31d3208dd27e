"""``bemkit sweep``: tables, files, figures, processes, kill and resume, and one line for every wrong input."""

from __future__ import annotations

import contextlib
import csv
import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from click.testing import CliRunner, Result

import bemkit as bk
from bemkit.cli.main import commands
from bemkit.errors import BemkitError
from bemkit.studies import engine
from bemkit.studies.engine import MOST_TOGETHER, Task, compute
from bemkit.studies.row_file import RowFileError
from bemkit.studies.sweep.figures import draw_sweep, figure_name
from bemkit.studies.sweep.records import FILE
from bemkit.studies.sweep.table import Sweep
from tests.studies.sweep.tables import equal_results

FRICTION = "law.friction_coefficient"
FAST = ("sweep", "paper-1", "--elements", "32")
SCENE = replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=32))
MANY = (*FAST, "--vary", f"{FRICTION}=0:0.7:8", "--vary", "material.poisson_ratio=0,0.4", "-q")
KILLED = f"""
import sys
from bemkit.cli.main import main
main([*{MANY}, "-o", sys.argv[1]])
"""


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(commands, [str(argument) for argument in arguments], standalone_mode=False)


def test_a_grid_with_an_impossible_value_is_printed_written_and_drawn(tmp_path: Path) -> None:
    files = {name: tmp_path / f"table.{name}" for name in ("jsonl", "csv", "json")}
    grid = ("--vary", f"{FRICTION}=0:1:3", "--vary", "material.poisson_ratio=0.2,0.7")
    outputs = ("-o", files["jsonl"], "--csv", files["csv"], "--json", files["json"], "--plot", tmp_path / "figures")
    result = call(*FAST, *grid, *outputs, "--show", "energy", "--show", "peak_pressure")
    assert result.exception is None
    assert result.return_value == 1
    assert "friction_coefficient   poisson_ratio   normal force" in result.output
    named = "law.friction_coefficient = 0.5, material.poisson_ratio = 0.7: refused: material: poisson_ratio is 0.7"
    assert named in result.output
    lines = list(csv.DictReader(files["csv"].read_text().splitlines()))
    assert [(line[FRICTION], line["material.poisson_ratio"], line["certified"]) for line in lines] == [
        (friction, ratio, certified)
        for friction in ("0.0", "0.5", "1.0")
        for ratio, certified in (("0.2", "1"), ("0.7", "0"))
    ]
    written = json.loads(files["json"].read_text())
    assert [row[FRICTION] for row in written["rows"]] == [0.0, 0.5, 1.0]
    assert [row["status"] for row in written["failed"]] == ["refused"] * 3
    table = Sweep.read(files["jsonl"])
    assert table.keys == (FRICTION, "material.poisson_ratio")
    assert [float(line["energy"]) for line in lines] == pytest.approx([row.energy for row in table.rows], nan_ok=True)
    for name in ("energy", "peak_pressure"):
        picture = matplotlib.image.imread(tmp_path / "figures" / f"{name}-over-{FRICTION}.png")
        assert picture[..., :3].std() > 0.05  # not blank


def test_a_killed_sweep_goes_on_and_ends_with_the_same_table(tmp_path: Path) -> None:
    path, whole = tmp_path / "killed.jsonl", tmp_path / "whole.jsonl"
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(path)])
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline and process.poll() is None:
        with contextlib.suppress(RowFileError):
            if FILE.read(path)[1]:
                break
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    finished = FILE.read(path)[1]
    assert 0 < len(finished) < 16
    assert call(*MANY, "-o", path).return_value == 0
    assert repr(FILE.read(path)[1][: len(finished)]) == repr(finished)  # run times too: not computed again
    assert call(*MANY, "-o", whole).return_value == 0
    assert len(Sweep.read(whole).rows) == 16
    assert equal_results(Sweep.read(path).rows, Sweep.read(whole).rows)


@pytest.mark.slow
def test_processes_give_the_same_table(tmp_path: Path) -> None:
    paths = tmp_path / "one.jsonl", tmp_path / "two.jsonl"
    for path, jobs in zip(paths, ("1", "2"), strict=True):
        assert call(*MANY, "-o", path, "--jobs", jobs).return_value == 0
    assert equal_results(*(Sweep.read(path).rows for path in paths))


def test_tasks_of_a_group_travel_together() -> None:
    bundles: list[int] = []

    class Counting:
        def submit(self, function: object, bundle: list[object]) -> object:
            bundles.append(len(bundle))
            raise KeyboardInterrupt

    tasks = [Task(number, "", int, "a" if number < 20 else None) for number in range(24)]
    for n_workers, first in ((1, MOST_TOGETHER), (4, 6)):
        bundles.clear()
        with pytest.raises(KeyboardInterrupt):
            list(compute(tasks, Counting(), n_workers=n_workers))  # type: ignore[arg-type]
        assert bundles == [first]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--vary", "law.fricton_coefficient=0:1:3"), "did you mean 'friction_coefficient'"),
        (("--vary", f"{FRICTION}=0:1"), "give a range as FIRST:LAST:COUNT"),
        (("--vary", f"{FRICTION}=-1"), "no row is a valid scene: law: friction_coefficient = -1"),
        (("--vary", f"{FRICTION}=1", "--vary", f"{FRICTION}=2"), "is given twice: give all its values at once"),
        (("--vary", f"{FRICTION}=1", "--jobs", "2", "--on", "tcp://x:1"), "give one of them"),
        (("--vary", f"{FRICTION}=1", "--show", "energy"), "--over and --show go with figures: add --plot DIR"),
        (("--vary", f"{FRICTION}=1", "--plot", "x", "--show", "energi"), "'energi' is not a column of numbers"),
        (("--vary", f"{FRICTION}=1", "--csv", "-", "--json", "-"), "two outputs go to the same file"),
    ],
)
def test_wrong_words_are_named_before_anything_is_computed(arguments: tuple[str, ...], message: str) -> None:
    result = call(*FAST, *arguments)
    assert result.exception is not None
    assert message in getattr(result.exception, "message", str(result.exception))


def test_files_of_others_stay(tmp_path: Path) -> None:
    path = tmp_path / "table.jsonl"
    path.write_text("my thesis")
    assert "is not a complete file of the format" in str(call(*FAST, "--vary", f"{FRICTION}=1", "-o", path).exception)
    assert path.read_text() == "my thesis"


def test_a_cluster_that_is_not_there_is_named(without: Callable[..., None]) -> None:
    without("distributed")
    result = call(*FAST, "--vary", f"{FRICTION}=0.1,0.2", "--on", "tcp://127.0.0.1:1", "-q")
    assert 'a cluster needs distributed: pip install "bemkit[cluster]"' in str(result.exception)


def test_a_cluster_is_reached_by_its_address_or_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(engine, "CONNECT_SECONDS", 0.5)
    arguments = (*FAST, "--vary", f"{FRICTION}=0.1,0.2", "-q", "-o", tmp_path / "table.jsonl", "--on")
    message = str(call(*arguments, "tcp://127.0.0.1:1").exception)
    assert "cluster tcp://127.0.0.1:1: no scheduler answers" in message
    assert "start one with 'dask scheduler'" in message
    with distributed.LocalCluster(n_workers=0, processes=False, dashboard_address=None) as local:
        assert "it has no workers" in str(call(*arguments, local.scheduler_address).exception)
        local.scale(1)
        local.wait_for_workers(1)
        assert call(*arguments, local.scheduler_address).return_value == 0
    assert len(Sweep.read(tmp_path / "table.jsonl").solved) == 2


def test_data_frames_need_their_packages(without: Callable[..., None]) -> None:
    table = bk.sweep(SCENE, {FRICTION: [0.2]})
    for package, kind in (("pandas", "data frames"), ("xarray", "data sets")):
        without(package)
        with pytest.raises(BemkitError, match=rf'{kind} need {package}: pip install "bemkit\[pandas\]"'):
            getattr(table, f"as_{package}")()


def test_pandas_and_xarray_hold_the_solved_rows() -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    table = bk.sweep(SCENE, {FRICTION: [0.4, 0.2], "material.poisson_ratio": [0.2, 0.7]})
    frame = table.as_pandas()
    assert list(frame[FRICTION]) == [0.4, 0.2]
    energies = table.as_xarray()["energy"]
    assert energies.dims == (FRICTION, "material.poisson_ratio")
    assert energies.sel({FRICTION: 0.4, "material.poisson_ratio": 0.2}) == table.rows[0].energy
    assert np.isnan(energies.sel({FRICTION: 0.4, "material.poisson_ratio": 0.7}))


def test_any_column_is_drawn_over_any_other() -> None:
    table = bk.sweep(SCENE, {FRICTION: [0.4, 0.2, 0.6], "material.poisson_ratio": [0.0, 0.2]})
    axes = draw_sweep(table, FRICTION, "energy").axes[0]
    assert [line.get_label() for line in axes.lines] == ["material.poisson_ratio = 0", "material.poisson_ratio = 0.2"]
    for number, line in enumerate(axes.lines):
        assert list(line.get_xdata()) == [0.2, 0.4, 0.6]
        rows = {row.values: row.energy for row in table.rows}
        assert list(line.get_ydata()) == [rows[x, (0.0, 0.2)[number]] for x in (0.2, 0.4, 0.6)]
    assert axes.get_ylabel() == "energy"  # the scene names no units
    both = draw_sweep(table, "energy", "force_tangential").axes[0]
    assert both.get_xlabel() == "energy"
    named = replace(table, scene=replace(SCENE, units=bk.UnitNames(length="mm", stress="MPa", force="N/mm")))
    assert draw_sweep(named, FRICTION, "energy").axes[0].get_ylabel() == "energy [N mm/mm]"
    assert draw_sweep(named, FRICTION, "peak_pressure").axes[0].get_ylabel() == "peak pressure [MPa]"
    assert draw_sweep(table, FRICTION, "seconds").axes[0].get_ylabel() == "seconds [s]"
    assert [list(line.get_ydata()) for line in both.lines] == [
        [row.force_tangential for row in sorted(table.rows, key=lambda row: row.values) if row.values[1] == ratio]
        for ratio in (0.0, 0.2)
    ]
    with pytest.raises(BemkitError, match=r"column 'energi': .*did you mean 'energy'"):
        draw_sweep(table, FRICTION, "energi")
    assert figure_name('parts."a/b".x', "energy") == "energy-over-parts.-a-b-.x"


def test_a_sweep_shows_itself_in_one_line() -> None:
    table = bk.sweep(SCENE, {FRICTION: [0.2, -1.0]})
    assert repr(table).endswith("over law.friction_coefficient: 2 rows, 1 of them failed)")
