"""Load histories in files: each step as soon as it is there, and runs that go on where another one was killed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.cli.main import main
from bemkit.results.load_history import LoadHistory
from bemkit.runs import checkpoint, load_path
from bemkit.solvers.base import Status
from tests.runs.test_rigid_bodies import driven
from tests.slow import slow_except, slow_only

LOOP = replace(bk.load_scene("friction-loop"), mesh=bk.MeshOptions(elements=24))
LOOP = replace(LOOP, steps=(LOOP.steps[0], replace(LOOP.steps[1], increments=8)))
PUNCH_STEPS = (
    bk.Step(1.0, {"rigid.punch.force_y": "-1e-3*t"}, increments=2),
    bk.Step(3.0, {"rigid.punch.x": "1e-3*sin(pi*(t - 1))"}, increments=4),
)
PUNCH = replace(driven(x=0.0, force_y=-1e-3), law=bk.SlipWeakening(0.3, 0.2, 1e-3), steps=PUNCH_STEPS)
COMPRESSED = replace(
    bk.load_scene("paper-1"),
    mesh=bk.MeshOptions(elements=240),
    linear_solver=bk.Hierarchical(),
    steps=(
        bk.Step(1.0, {"parts.left-load.condition.x": 0.0}),
        bk.Step(5.0, {"parts.left-load.condition.x": "0.25*(t - 1)"}, increments=4),
    ),
)


class Killed(BaseException):
    """As a signal would end a process."""


def kill_after(monkeypatch: pytest.MonkeyPatch, n_steps: int) -> list[Status]:
    """End a run as soon as some steps are in its file."""
    seen: list[Status] = []

    def write(path: Path, solution: bk.Solution | bk.AssemblySolution) -> None:
        bk.write_result(path, solution)
        seen.append(solution.status)
        if len(seen) == n_steps:
            raise Killed

    monkeypatch.setattr(checkpoint, "write_result", write)
    return seen


def loading_of(solution: bk.Solution | bk.AssemblySolution) -> LoadHistory:
    assert solution.loading is not None
    return solution.loading


@pytest.mark.parametrize("scene", slow_except((LOOP, PUNCH), LOOP), ids=["one body", "punch"])
def test_a_killed_run_is_continued_to_the_same_bits(
    scene: bk.Scene | bk.Assembly, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = bk.run_to_file(scene, tmp_path / "whole.h5")
    file = tmp_path / "killed.h5"
    with monkeypatch.context() as patch:
        seen = kill_after(patch, 4)
        with pytest.raises(Killed):
            bk.run_to_file(scene, file)
        assert seen == [Status.UNFINISHED] * 4
    part = bk.read_result(file)
    assert part.status is Status.UNFINISHED
    assert not part.is_certified
    assert len(loading_of(part).steps) == 4
    solved: list[int] = []
    resumed = bk.run_to_file(scene, file, callback=lambda record: solved.append(record.step))
    assert len(solved) < len(whole.history)  # what was there is not solved again
    for other in (resumed, bk.read_result(file)):
        for name, column in whole.contact.columns().items():
            np.testing.assert_array_equal(other.contact.columns()[name], column)
        own, expected = ({**each.summary(), "timings": None} for each in (other, whole))
        assert own == expected
        assert other.history == whole.history
        for one, two in zip(loading_of(other).steps, loading_of(whole).steps, strict=True):
            assert one.as_dict() == two.as_dict()
            np.testing.assert_array_equal(one.contact.status, two.contact.status)
            np.testing.assert_array_equal(one.slip, two.slip)


def test_compressed_equations_solve_the_steps_that_are_left_to_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever loads they have been solved under before."""
    whole = bk.run(COMPRESSED)
    with monkeypatch.context() as patch:
        kill_after(patch, 3)
        with pytest.raises(Killed):
            bk.run_to_file(COMPRESSED, tmp_path / "killed.h5")
    resumed = bk.run_to_file(COMPRESSED, tmp_path / "killed.h5")
    assert resumed.plan.is_compressed
    for name, column in whole.contact.columns().items():
        np.testing.assert_array_equal(resumed.contact.columns()[name], column)


SHORT = replace(LOOP, steps=(LOOP.steps[0], replace(LOOP.steps[1], increments=2)), mesh=bk.MeshOptions(accuracy=0.01))
CYLINDERS = replace(
    bk.load_scene("two-cylinders"),
    mesh=bk.MeshOptions(accuracy=0.1),
    steps=(bk.Step(1.0, load_factor=0.5), bk.Step(2.0, load_factor=1.0)),
)


@pytest.mark.parametrize("scene", slow_except((SHORT, CYLINDERS), SHORT), ids=["one body", "two bodies"])
def test_a_killed_run_with_an_accuracy_goes_on_on_its_mesh(
    scene: bk.Scene | bk.Assembly, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    n_elements: list[int] = []

    def write(path: Path, solution: bk.Solution | bk.AssemblySolution) -> None:
        bk.write_result(path, solution)
        n_elements.append(solution.n_elements)
        if len(n_elements) == n_writes:
            raise Killed

    n_writes = 0
    monkeypatch.setattr(checkpoint, "write_result", write)
    whole = bk.run_to_file(scene, tmp_path / "whole.h5")
    meshes = sorted(set(n_elements))
    assert len(meshes) >= 2
    # each step but the last on each mesh, and the result
    assert n_elements == [n for n in meshes for _ in range(scene.n_steps - 1)] + [whole.n_elements]
    n_writes = len(n_elements) - 1  # the last but one step on the last mesh
    n_elements.clear()
    with pytest.raises(Killed):
        bk.run_to_file(scene, tmp_path / "killed.h5")
    assert len(loading_of(bk.read_result(tmp_path / "killed.h5")).steps) == scene.n_steps - 1
    n_elements.clear()
    n_writes, records = 0, []
    resumed = bk.run_to_file(scene, tmp_path / "killed.h5", callback=lambda record: records.append(record))
    # coarser meshes are solved again but do not replace what is in the file, and of the last mesh one step is missing
    assert n_elements == [whole.n_elements]
    assert len(records) < len(whole.history)
    for other in (resumed, bk.read_result(tmp_path / "killed.h5")):
        own, expected = ({**each.summary(), "timings": None} for each in (other, whole))
        assert own == expected
        for name, column in whole.contact.columns().items():
            np.testing.assert_array_equal(other.contact.columns()[name], column)


@pytest.mark.parametrize("scene", slow_except((LOOP, PUNCH), PUNCH), ids=["one body", "punch"])
def test_files_hold_all_fields_of_all_steps(scene: bk.Scene | bk.Assembly, tmp_path: Path) -> None:
    whole = bk.run_to_file(scene, tmp_path / "a.h5")
    read = bk.read_result(tmp_path / "a.h5")
    of_the_run = {"history", "linear_solves", "outer_steps", "timings", "message", "work", "plan", "memory", "warnings"}
    for number in range(1, scene.n_steps + 1):
        one, two = whole.at_step(number).summary(), read.at_step(number).summary()
        assert {k: v for k, v in one.items() if k not in of_the_run} == {
            k: v for k, v in two.items() if k not in of_the_run
        }
    first, last = read.at_step(1), read.at_step(scene.n_steps)
    assert first.energy != last.energy
    assert last.energy == read.energy
    bk.write_result(tmp_path / "first.h5", first)
    assert bk.read_result(tmp_path / "first.h5").energy == first.energy
    for number in (0, scene.n_steps + 1):
        with pytest.raises(bk.InputError, match=f"step {number} is none of the finished ones: give a number from 1 to"):
            read.at_step(number)


def test_another_scene_begins_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "loop.h5"
    short = replace(LOOP, steps=(LOOP.steps[0], replace(LOOP.steps[1], increments=2)))
    with monkeypatch.context() as patch:
        kill_after(patch, 2)
        with pytest.raises(Killed):
            bk.run_to_file(short, file)
    rough = replace(short, law=bk.Coulomb(0.35))
    assert bk.run_to_file(rough, file).history == bk.run(rough).history


def test_a_failed_step_leaves_the_finished_ones_in_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(load_path, "MOST_HALVINGS", 0)
    hopeless = bk.SemismoothNewton(max_steps=1)
    shear = bk.Step(2.0, {"parts.top.condition.x": 0.01})
    scene = replace(LOOP, steps=(LOOP.steps[0], shear), solver=hopeless)
    (tmp_path / "scene.toml").write_text(bk.scene_to_toml(scene))
    with pytest.raises(SystemExit) as ended:
        main(["run", str(tmp_path / "scene.toml"), "-o", str(tmp_path / "a.h5")])
    assert ended.value.code == 1
    assert "Finished: 2 of 3 steps, up to t = 1." in " ".join(capsys.readouterr().out.split())
    read = bk.read_result(tmp_path / "a.h5")
    assert [step.time for step in loading_of(read).steps] == [0.5, 1.0]
    assert read.stated == scene
    assert read.scene == bk.run(replace(scene, steps=LOOP.steps[:1])).scene


@pytest.mark.parametrize("scene", slow_except([LOOP, PUNCH], PUNCH), ids=["one body", "punch"])
@pytest.mark.parametrize("ending", slow_only(["h5", "hdf5", "json", "csv", "npz", "vtu"], "hdf5"))
def test_histories_are_written_in_every_format(scene: bk.Scene | bk.Assembly, ending: str, tmp_path: Path) -> None:
    if ending == "vtu":
        pytest.importorskip("meshio")
    short = replace(scene, steps=scene.steps[:1])
    (tmp_path / "scene.toml").write_text(bk.scene_to_toml(short))
    with pytest.raises(SystemExit) as ended:
        main(["run", str(tmp_path / "scene.toml"), "-q", "-o", str(tmp_path / f"a.{ending}")])
    assert ended.value.code == 0
    assert (tmp_path / f"a.{ending}").stat().st_size > 100
    bk.export_result(tmp_path / f"b.{ending}", bk.run(short))


def test_the_command_line_shows_steps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "loop.h5"
    bk.write_result(file, bk.run(LOOP))
    for arguments in (
        ["--csv", "-", "--table", "steps"],
        ["--scene"],
        ["--json", "-"],
        ["--plot", str(tmp_path / "figures"), "--what", "friction-loop,work"],
        [],
    ):
        with pytest.raises(SystemExit) as ended:
            main(["show", str(file), *arguments])
        assert ended.value.code == 0
    shown = capsys.readouterr().out
    assert shown.startswith("time,external_work,elastic_energy,dissipation,increment_work,friction_gain,force_normal,")
    assert "[[steps]]" in shown
    assert "10 of 10 steps, up to t = 6" in shown
    with pytest.raises(SystemExit) as ended:
        main(["show", str(file), "--step", "3"])
    assert ended.value.code == 0
    assert "3 of 10 steps, up to t = 1.625" in capsys.readouterr().out
    with pytest.raises(SystemExit) as ended:
        main(["show", str(file), "--step", "11"])
    assert ended.value.code == 2
    assert "step 11 is none of the finished ones: give a number from 1 to 10" in capsys.readouterr().err
    assert {path.name for path in (tmp_path / "figures").iterdir()} == {"friction-loop.png", "work.png"}


def test_results_without_steps_say_so() -> None:
    solution = bk.run(replace(LOOP, steps=()))
    with pytest.raises(bk.InputError, match=r"the result has no load history: give \[\[steps\]\]"):
        solution.at_step(1)
    from bemkit.results.tables import to_csv

    with pytest.raises(bk.InputError, match=r"the result has no load history: give \[\[steps\]\]"):
        to_csv(solution, "steps")
