"""Load histories in files: each step as soon as it is there, and runs that go on where another one was killed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import bemkit as bk
from bemkit.cli.main import main
from bemkit.errors import ResultWarning
from bemkit.results.export import export_result
from bemkit.results.load_history import LoadHistory
from bemkit.results.result_file import ResultWriter
from bemkit.runs import load_path
from bemkit.sealed_file import USER_BLOCK
from bemkit.solvers.base import Status, StepRecord
from tests.runs.test_rigid_bodies import driven
from tests.slow import slow_except

LOOP = replace(bk.load_scene("friction-loop"), mesh=bk.MeshOptions(elements=24))
LOOP = replace(LOOP, steps=(LOOP.steps[0], replace(LOOP.steps[1], increments=4)))
PUNCH_STEPS = (
    bk.Step(1.0, {"rigid.punch.force_y": "-1e-3*t"}),
    bk.Step(3.0, {"rigid.punch.x": "1e-3*sin(pi*(t - 1))"}, increments=3),
)
PUNCH = replace(driven(x=0.0, force_y=-1e-3), law=bk.SlipWeakening(0.3, 0.2, 1e-3), steps=PUNCH_STEPS)
COMPRESSED = replace(
    bk.load_scene("paper-1"),
    mesh=bk.MeshOptions(elements=240),
    linear_solver=bk.Hierarchical(),
    steps=(
        bk.Step(1.0, {"parts.left-load.condition.x": 0.0}),
        bk.Step(3.0, {"parts.left-load.condition.x": "0.5*(t - 1)"}, increments=2),
    ),
)


class Killed(BaseException):
    """As a signal would end a process."""


def kill_after(file: Path, n_steps: int) -> Callable[[StepRecord], None]:
    """Return a callback that ends a run as soon as some steps are in its file."""

    size = 0

    def callback(record: StepRecord) -> None:
        nonlocal size
        if file.exists() and file.stat().st_size != size:  # it has grown by a step
            size = file.stat().st_size
            if len(loading_of(bk.read_result(file)).steps) == n_steps:
                raise Killed

    return callback


def loading_of(solution: bk.Solution) -> LoadHistory:
    assert solution.loading is not None
    return solution.loading


@pytest.mark.parametrize("scene", slow_except((LOOP, PUNCH), LOOP), ids=["one body", "punch"])
def test_a_killed_run_is_continued_to_the_same_bits(scene: bk.Scene | bk.Scene, tmp_path: Path) -> None:
    whole = bk.run(scene, file=tmp_path / "whole.h5")
    file, n_finished = tmp_path / "killed.h5", scene.n_steps - 1
    with pytest.raises(Killed):
        bk.run(scene, file=file, callback=kill_after(file, n_finished))
    part = bk.read_result(file)
    assert part.status is Status.UNFINISHED
    assert not part.is_certified
    assert len(loading_of(part).steps) == n_finished
    solved: list[int] = []
    resumed = bk.run(scene, file=file, callback=lambda record: solved.append(record.step))
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


@pytest.mark.slow
def test_compressed_equations_solve_the_steps_that_are_left_to_the_same_bits(tmp_path: Path) -> None:
    """Whatever loads they have been solved under before."""
    whole = bk.run(COMPRESSED)
    file = tmp_path / "killed.h5"
    with pytest.raises(Killed):
        bk.run(COMPRESSED, file=file, callback=kill_after(file, 2))
    resumed = bk.run(COMPRESSED, file=file)
    assert resumed.plan.is_compressed
    for name, column in whole.contact.columns().items():
        np.testing.assert_array_equal(resumed.contact.columns()[name], column)


SHORTER = replace(LOOP, steps=(LOOP.steps[0], replace(LOOP.steps[1], increments=2)))
SHORT = replace(LOOP, steps=(LOOP.steps[0], replace(LOOP.steps[1], increments=2)), mesh=bk.MeshOptions(accuracy=0.02))
CYLINDERS = replace(
    bk.load_scene("two-cylinders"),
    mesh=bk.MeshOptions(accuracy=0.05),
    steps=(bk.Step(1.0, load_factor=0.5), bk.Step(2.0, load_factor=1.0)),
)


@pytest.mark.parametrize("scene", slow_except((SHORT, CYLINDERS), SHORT), ids=["one body", "two bodies"])
def test_a_killed_run_with_an_accuracy_goes_on_on_its_mesh(scene: bk.Scene | bk.Scene, tmp_path: Path) -> None:
    file, in_file = tmp_path / "killed.h5", dict[int, int]()  # number of elements -> finished steps

    size = 0

    def look(record: StepRecord) -> None:
        nonlocal size
        if file.exists() and file.stat().st_size != size:  # it has grown by a step
            size = file.stat().st_size
            part = bk.read_result(file)
            in_file[part.n_elements] = len(loading_of(part).steps)
            if stop_at == (part.n_elements, len(loading_of(part).steps)):
                raise Killed

    stop_at = (0, 0)
    whole = bk.run(scene, file=file, callback=look)
    n_last = scene.n_steps - 1
    assert len(in_file) >= 2
    assert in_file == dict.fromkeys(sorted(in_file), n_last)  # each step but the last on each mesh
    assert max(in_file) == whole.n_elements
    stop_at = (whole.n_elements, n_last)
    file.unlink()
    with pytest.raises(Killed):
        bk.run(scene, file=file, callback=look)
    assert len(loading_of(bk.read_result(file)).steps) == n_last
    in_file.clear()
    stop_at, size, records = (0, 0), 0, []
    resumed = bk.run(scene, file=file, callback=lambda record: (look(record), records.append(record))[0])
    # coarser meshes are solved again but do not replace what is in the file, and of the last mesh one step is missing
    assert in_file == {whole.n_elements: n_last}
    assert len(records) < len(whole.history)
    for other in (resumed, bk.read_result(file)):
        own, expected = ({**each.summary(), "timings": None} for each in (other, whole))
        assert own == expected
        for name, column in whole.contact.columns().items():
            np.testing.assert_array_equal(other.contact.columns()[name], column)


@pytest.fixture(scope="module")
def whole() -> bk.Solution:
    return bk.run(LOOP)


@pytest.fixture(scope="module")
def growing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a file of a run that was killed after four steps."""
    file = tmp_path_factory.mktemp("growing") / "killed.h5"
    with pytest.raises(Killed):
        bk.run(LOOP, file=file, callback=kill_after(file, 4))
    return file


@pytest.mark.slow
@pytest.mark.parametrize("share", slow_except([0.3, 0.6, 0.9, 0.99], 0.6))
def test_a_write_that_was_cut_off_loses_no_earlier_step(
    growing: Path, whole: bk.Solution, tmp_path: Path, share: float
) -> None:
    content, file = growing.read_bytes(), tmp_path / "cut.h5"
    n_first = USER_BLOCK + int(content[:USER_BLOCK].rstrip(b"\0").rpartition(b"\n")[2])
    file.write_bytes(content[: n_first + int(share * (len(content) - n_first))])
    part = bk.read_result(file)
    steps = loading_of(part).steps
    assert part.status is Status.UNFINISHED
    assert len(steps) == 1 + int(3 * share)  # each of the last three steps takes about as many bytes
    for one, two in zip(steps, loading_of(bk.read_result(growing)).steps, strict=False):
        np.testing.assert_array_equal(one.contact.sigma_n, two.contact.sigma_n)
    assert bk.run(LOOP, file=file).history == whole.history


def test_a_damaged_step_and_those_after_it_are_not_read(growing: Path, tmp_path: Path) -> None:
    content, file = bytearray(growing.read_bytes()), tmp_path / "damaged.h5"
    content[-5] ^= 1
    file.write_bytes(content)
    assert len(loading_of(bk.read_result(file)).steps) == 3


def test_any_program_reads_the_first_step_of_a_file_that_grows(growing: Path) -> None:
    with h5py.File(growing) as file:
        assert list(file["steps"]) == ["0001"]


def test_writing_is_a_stage_of_its_own(tmp_path: Path) -> None:
    written, plain = bk.run(SHORTER, file=tmp_path / "a.h5"), bk.run(SHORTER)
    assert written.timings["write"] > 0.0
    assert plain.timings["write"] == 0.0


@pytest.mark.parametrize("scene", slow_except((LOOP, PUNCH), PUNCH), ids=["one body", "punch"])
def test_files_hold_all_fields_of_all_steps(scene: bk.Scene | bk.Scene, tmp_path: Path) -> None:
    whole = bk.run(scene, file=tmp_path / "a.h5")
    read = bk.read_result(tmp_path / "a.h5")
    for number in range(1, scene.n_steps + 1):
        assert whole.at_step(number).summary() == read.at_step(number).summary()
        assert whole.at_step(number).history == read.at_step(number).history
    first, last = read.at_step(1), read.at_step(scene.n_steps)
    assert first.energy != last.energy
    assert last.energy == read.energy
    bk.write_result(tmp_path / "first.h5", first)
    assert bk.read_result(tmp_path / "first.h5").energy == first.energy
    for number in (0, scene.n_steps + 1, "1", None):
        with pytest.raises(bk.InputError, match=f"step {number} does not exist: give a number from 1 to"):
            read.at_step(number)


def test_the_first_step_without_load_has_the_warnings_in_its_file_that_it_has_in_memory(tmp_path: Path) -> None:
    """A load history may begin at rest, so neither warns that nothing is loaded."""
    rest = bk.Step(1.0, {"parts.top.condition.y": 0.0})
    whole = bk.run(replace(SHORTER, steps=(rest, bk.Step(2.0))), file=tmp_path / "a.h5")
    assert not whole.at_step(1).contact.u_n.any()
    for number in (1, 2):
        assert bk.read_result(tmp_path / "a.h5").at_step(number).warnings == whole.at_step(number).warnings


def test_warnings_of_a_step_are_found_once_for_its_file_and_for_the_steps_after_it(tmp_path: Path) -> None:
    found: list[bk.Solution] = []

    def warnings_of(solution: bk.Solution) -> tuple[ResultWarning, ...]:
        found.append(solution)
        return (ResultWarning("kind", "", "Text."),)

    step = replace(bk.run(SHORTER), warnings_of=warnings_of)
    with ResultWriter(tmp_path / "a.h5") as writer:
        writer.append(step)
    assert [str(warning) for warning in step.warnings] == ["Text."]
    assert found == [step]
    read = bk.read_result(tmp_path / "a.h5")
    assert read.at_step(SHORTER.n_steps).warnings == step.warnings


def test_another_scene_begins_anew(tmp_path: Path) -> None:
    file = tmp_path / "loop.h5"
    short = replace(LOOP, steps=(LOOP.steps[0], replace(LOOP.steps[1], increments=2)))
    with pytest.raises(Killed):
        bk.run(short, file=file, callback=kill_after(file, 2))
    rough = replace(short, law=bk.Coulomb(0.35))
    assert bk.run(rough, file=file).history == bk.run(rough).history


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
@pytest.mark.parametrize("ending", slow_except(["h5", "hdf5", "json", "csv", "npz", "vtu"], "csv"))
def test_histories_are_written_in_every_format(scene: bk.Scene | bk.Scene, ending: str, tmp_path: Path) -> None:
    if ending == "vtu":
        pytest.importorskip("meshio")
    short = replace(scene, steps=scene.steps[:1])
    (tmp_path / "scene.toml").write_text(bk.scene_to_toml(short))
    with pytest.raises(SystemExit) as ended:
        main(["run", str(tmp_path / "scene.toml"), "-q", "-o", str(tmp_path / f"a.{ending}")])
    assert ended.value.code == 0
    assert (tmp_path / f"a.{ending}").stat().st_size > 100
    export_result(tmp_path / f"b.{ending}", bk.run(short))


def test_the_command_line_shows_steps(whole: bk.Solution, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "loop.h5"
    bk.write_result(file, whole)
    for arguments in (
        ["--csv", "-", "--table", "steps"],
        ["--scene"],
        ["--json", "-"],
        [],
    ):
        with pytest.raises(SystemExit) as ended:
            main(["show", str(file), *arguments])
        assert ended.value.code == 0
    shown = capsys.readouterr().out
    assert shown.startswith("time,external_work,elastic_energy,dissipation,increment_work,friction_gain,force_normal,")
    assert "[[steps]]" in shown
    assert "6 of 6 steps, up to t = 6" in shown
    with pytest.raises(SystemExit) as ended:
        main(["show", str(file), "--step", "3"])
    assert ended.value.code == 0
    assert "3 of 6 steps, up to t = 2.25" in capsys.readouterr().out
    with pytest.raises(SystemExit) as ended:
        main(["show", str(file), "--step", "7"])
    assert ended.value.code == 2
    assert "step 7 does not exist: give a number from 1 to 6" in capsys.readouterr().err


def test_results_without_steps_say_so() -> None:
    solution = bk.run(replace(LOOP, steps=()))
    with pytest.raises(bk.InputError, match=r"the result has no load history: give \[\[steps\]\]"):
        solution.at_step(1)
    from bemkit.results.tables import to_csv

    with pytest.raises(bk.InputError, match=r"the result has no load history: give \[\[steps\]\]"):
        to_csv(solution, "steps")


def test_a_file_goes_with_no_mesh_of_its_own(tmp_path: Path) -> None:
    with pytest.raises(bk.InputError, match="file is given with a mesh, a start or coarsest"):
        bk.run(SHORTER, file=tmp_path / "a.h5", start=bk.run(SHORTER))
