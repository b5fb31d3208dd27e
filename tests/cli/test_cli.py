"""The command line: exit codes, one-line errors, no broken files, nothing imported without need."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
import types
import weakref
from pathlib import Path
from typing import Any

import click
import pytest

import bemkit.__main__
import bemkit.operators.hierarchy.skeletons
import bemkit.results.result_file
import bemkit.runs.run
from bemkit.cli.console import ConvergenceTable, format_size
from bemkit.cli.main import commands, main
from bemkit.cli.process import BAD_INPUT, INACCURATE, NOT_CONVERGED, most_serious
from bemkit.operators.linear_solvers import Hierarchical
from bemkit.results.result_file import read_result
from bemkit.scene.discretisation import Galerkin, MeshOptions
from bemkit.scene.steps import Step
from bemkit.scene.toml import load_scene, scene_from_toml, scene_to_toml, shipped_files
from bemkit.solvers.base import Status
from bemkit.solvers.ssn import SemismoothNewton
from tests.slow import slow_except, slow_only

pytestmark = pytest.mark.usefixtures("here")
SMALL = ["--elements", "40"]


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as caught:
        main(list(arguments))
    assert isinstance(caught.value.code, int)
    return caught.value.code


def test_run_prints_a_summary(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("run", "paper-1", *SMALL) == 0
    output = capsys.readouterr()
    for word in ("converged", "contact nodes", "normal force", "friction force", "separated to slip", "certificate"):
        assert word in output.out
    assert output.err == ""  # no convergence table unless a person is watching


def test_several_scenes_are_solved_and_a_bad_one_loses_none(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.toml").write_text(scene_to_toml(dataclasses.replace(load_scene("bending"), title="First")), "utf-8")
    Path("bad.toml").write_text("title = 3", "utf-8")
    few = ["--elements", "24"]
    assert call("run", "a.toml", "bad.toml", "bending", *few, "-o", "r.h5", "--json", "n.json") == 2
    printed = capsys.readouterr()
    assert printed.out.index("First") < printed.out.index(load_scene("bending").title)
    assert printed.err.startswith("bemkit: error: bad.toml: ")
    assert sorted(path.name for path in Path().glob("[rn]-*")) == [
        *("n-a.json", "n-bending.json", "r-a.h5", "r-bending.h5")
    ]
    assert json.loads(Path("n-a.json").read_text())["title"] == "First"
    assert read_result("r-bending.h5").n_elements == 24


def test_outputs_of_several_scenes_do_not_meet(capsys: pytest.CaptureFixture[str]) -> None:
    Path("b").mkdir()
    for path in ("a.toml", "b/a.toml"):
        Path(path).write_text(scene_to_toml(load_scene("bending")), "utf-8")
    assert call("run", "a.toml", "b/a.toml", "-o", "r.h5") == 2
    assert "two scenes are called 'a', and so would be their outputs: rename one" in capsys.readouterr().err
    assert call("run", "a.toml", "bending", "--csv", "-") == 2
    assert "- is standard output, which takes one scene: give a file" in capsys.readouterr().err
    assert not list(Path().glob("r*"))


def test_the_exit_code_of_several_scenes_is_the_most_serious() -> None:
    assert most_serious([0, INACCURATE, 0]) == INACCURATE
    assert most_serious([NOT_CONVERGED, INACCURATE]) == NOT_CONVERGED
    assert most_serious([0, BAD_INPUT, NOT_CONVERGED]) == BAD_INPUT
    assert most_serious([0, 0]) == 0


def test_shells_complete_commands_and_options() -> None:
    def completed(words: str, number: int) -> list[str]:
        variables = {"COMP_WORDS": words, "COMP_CWORD": str(number), "_BEMKIT_COMPLETE": "bash_complete"}
        variables["PYTHONPATH"] = str(Path(bemkit.__file__).parents[1])  # this package, from any folder
        command = [sys.executable, "-m", "bemkit"]
        done = subprocess.run(command, env=os.environ | variables, capture_output=True, text=True, check=True)
        return done.stdout.split()

    assert completed("bemkit ru", 1) == ["plain,run"]
    assert completed("bemkit run paper-1 --elem", 3) == ["plain,--elements"]


def test_the_summary_of_a_history_says_what_coarse_increments_leave(capsys: pytest.CaptureFixture[str]) -> None:
    one_step = dataclasses.replace(
        load_scene("cylinder-on-half-plane"), mesh=MeshOptions(elements=60), steps=(Step(1.0),)
    )
    Path("coarse.toml").write_text(scene_to_toml(one_step), "utf-8")
    assert call("run", "coarse.toml") == 0
    assert "decreases with smaller increments" in " ".join(capsys.readouterr().out.split())


def test_json_on_standard_output_is_one_object(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("run", "paper-2", *SMALL, "--json", "-") == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["status"], result["converged"], result["n_elements"]) == ("converged", True, 40)
    assert result["force_normal"] == pytest.approx(1.0 / 60.0, rel=1e-9)  # equilibrium
    assert result["force_tangential"] < 0.0
    assert {"x", "y", "s", "from", "to"} <= set(result["transitions"][0])


def test_a_scene_is_changed_by_its_keys(capsys: pytest.CaptureFixture[str]) -> None:
    changes = ["--set", "law.friction_coefficient=0", "--set", "title=Smooth ground", "--set", "mesh.elements = 44"]
    assert call("run", "paper-1", *changes, "--json", "-") == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["title"], result["n_elements"]) == ("Smooth ground", 44)
    assert result["force_tangential"] == 0.0
    assert call("plan", "paper-1", "--set", "mesh.elements=44", "--json", "-") == 0
    assert json.loads(capsys.readouterr().out)["work"]["element_pairs"] == 44**2
    vary = ["--vary", "law.friction_coefficient=0.2,0.5"]
    assert call("sweep", "paper-1", *changes, *vary, "--json", "-") == 0
    rows = json.loads(capsys.readouterr().out)
    assert len(rows["rows"] if isinstance(rows, dict) else rows) == 2


def test_an_accuracy_instead_of_elements(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("run", "paper-2", "--discretisation", "quadratic", "--accuracy", "1e-2", "--json", "-") == 0
    result = json.loads(capsys.readouterr().out)
    assert result["estimated_error"] <= 1e-2
    assert "2 meshes" in result["message"]
    assert any(item["name"] == "further meshes" and item["needed"] for item in result["plan"]["items"])


def test_outputs_go_to_files_and_can_be_shown_again(capsys: pytest.CaptureFixture[str]) -> None:
    for _ in range(2):  # the second time replaces the first
        assert call("run", "paper-1", *SMALL, "-q", "-o", "r.h5", "--json", "r.json", "--csv", "r.csv") == 0
    assert capsys.readouterr() == ("", "")
    assert sorted(os.listdir()) == ["r.csv", "r.h5", "r.json"]
    stored = json.loads(Path("r.json").read_text("utf-8"))

    assert call("show", "r.h5") == 0
    assert "converged" in capsys.readouterr().out
    assert call("show", "r.h5", "--json", "-") == 0
    assert json.loads(capsys.readouterr().out) == stored
    assert call("show", "r.h5", "--csv", "-", "--table", "contact") == 0
    text = capsys.readouterr().out
    assert text == Path("r.csv").read_text("utf-8")
    rows = list(csv.DictReader(io.StringIO(text)))
    assert list(rows[0])[:10] == "x y s u_n u_t sigma_n sigma_t gap clearance status".split()
    assert len(rows) == stored["n_contact"]
    assert {row["status"] for row in rows} == {"separated", "slip", "stick"}
    solution = read_result("r.h5")
    assert [float(row["sigma_n"]) for row in rows] == solution.contact.sigma_n.tolist()
    assert call("show", "r.h5", "--csv", "-", "--table", "boundary") == 0
    assert len(capsys.readouterr().out.splitlines()) == 41
    assert call("show", "r.h5", "--csv", "-", "--table", "history") == 0
    assert len(capsys.readouterr().out.splitlines()) == 1 + len(solution.history)
    assert call("show", "r.h5", "--scene") == 0
    assert scene_to_toml(scene_from_toml(capsys.readouterr().out)) == scene_to_toml(solution.scene)


def test_overrides_reach_the_solver(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--discretisation", "linear", "--solver", "augmented-lagrangian", "--rho", "1e4"]
    assert call("run", "paper-1", *SMALL, *arguments, "-o", "r.h5", "--json", "-") == 0
    result = json.loads(capsys.readouterr().out)
    assert result["outer_steps"] > 1
    scene = read_result("r.h5").scene
    assert 'discretisation = "linear"' in scene_to_toml(scene)
    assert "rho_n = 10000.0" in scene_to_toml(scene)


def test_a_run_that_does_not_converge_says_so_and_exits_with_1(capsys: pytest.CaptureFixture[str]) -> None:
    text = shipped_files()["paper-1"].read_text("utf-8")
    Path("hard.toml").write_text(f'solver = {{ kind = "fixed-point", max_steps = 1 }}\n{text}', "utf-8")
    assert call("run", "hard.toml", *SMALL) == 1
    assert "max steps" in capsys.readouterr().out


def test_an_accuracy_out_of_reach_exits_with_3_and_keeps_what_was_reached(capsys: pytest.CaptureFixture[str]) -> None:
    options = MeshOptions(accuracy=1e-9, most_elements=60)
    Path("far.toml").write_text(
        scene_to_toml(dataclasses.replace(load_scene("paper-1"), mesh=options, discretisation=Galerkin(2)))
    )
    assert call("run", "far.toml", "-o", "far.h5", "--json", "far.json") == 3
    shown = " ".join(capsys.readouterr().out.split())  # lines are folded
    assert "accuracy not reached: The accuracy 1e-09 was not reached: more than 60 elements would" in shown
    summary = json.loads(Path("far.json").read_text())
    assert (summary["status"], summary["converged"], summary["certified"]) == ("accuracy_not_reached", False, True)
    again = read_result("far.h5")
    assert again.status is Status.ACCURACY_NOT_REACHED
    assert again.linear_solves == summary["linear_solves"] == again.history[-1].linear_solves


def test_scenes_and_plan(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("scenes") == 0
    assert re.search(r"^paper-1 +Square on a rigid foundation", capsys.readouterr().out, re.MULTILINE)
    assert call("plan", "paper-1") == 0
    output = capsys.readouterr().out
    assert "skipped" in output
    assert "hypersingular" in output
    assert call("plan", "paper-1", "--json", "-", "--elements", "64", "--discretisation", "linear") == 0
    names = {item["name"]: item["needed"] for item in json.loads(capsys.readouterr().out)["items"]}
    assert names["hypersingular operator W"]


def test_explain_prints_what_was_planned_and_what_it_took(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("run", "paper-1", "--elements", "40", "--explain") == 0
    output = capsys.readouterr().out
    rows = {line.split("  ")[0]: line.split() for line in output.splitlines() if line.strip()}
    for stage in ("mesh", "assemble", "condense", "solve", "recover"):
        assert len(rows[stage]) == 5  # a time and a size, each with its unit
    assert len(rows["planned"]) == len(rows["all"]) == 5
    assert rows["element pairs integrated"][-2:] == ["1,600", "1,600"]
    assert rows["factorisations and their orders"][-4:] == ["LU", "84", "LU", "84"]
    assert "columns of V on the free surface" in rows
    assert call("run", "paper-1", "--elements", "40", "--explain", "--json", "-", "-o", "r.h5") == 0
    shown = capsys.readouterr()
    summary = json.loads(shown.out)
    assert set(summary["memory"]) == {"mesh", "assemble", "condense", "solve", "recover"}
    assert call("plan", "paper-1", "--elements", "40", "--json", "-") == 0
    assert summary["plan"] == json.loads(capsys.readouterr().out)  # which nothing changes afterwards
    assert "what was computed" in shown.err


def test_the_memory_that_is_explained_is_that_of_the_run_alone() -> None:
    arguments = ["run", "paper-1", "--elements", "40", "--explain", "--json", "-"]
    code = "from bemkit.cli.main import main; main()"
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True)
    # a fresh process: the code of scipy takes 11 MB, the matrices of 40 elements 0.5 MB
    assert max(json.loads(done.stdout)["memory"].values()) < 3e6


def test_a_symmetry_is_proposed(capsys: pytest.CaptureFixture[str]) -> None:
    Path("block.toml").write_text(
        """
title = "block"
law = "frictionless"
shape = { kind = "rectangle", width = 2.0, height = 1.0 }
material = { youngs_modulus = 1.0, poisson_ratio = 0.3 }
mesh = { elements = 24 }
parts.floor = { sides = ["bottom"], condition = { kind = "contact", obstacle = "half-plane" } }
parts.load = { sides = ["top"], condition = { kind = "pressure", pressure = 1.0 } }
""",
        "utf-8",
    )
    assert call("plan", "block.toml", "--json", "-") == 0
    reasons = {item["name"]: item["reason"] for item in json.loads(capsys.readouterr().out)["items"]}
    assert reasons["symmetry"] == "proposed: the scene is symmetric about x = 1, and half of its unknowns would do"
    text = Path("block.toml").read_text("utf-8")
    Path("block.toml").write_text(text.replace("law =", "symmetry = { x = 1.0 }\nlaw ="))
    assert call("plan", "block.toml", "--json", "-") == 0
    items = {item["name"]: item for item in json.loads(capsys.readouterr().out)["items"]}
    assert items["symmetry"]["needed"]
    assert items["symmetry"]["reason"] == "about x = 1: 12 of 24 elements carry unknowns"


def one_line_error(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    before = sorted(os.listdir())
    assert call(*arguments) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.startswith("bemkit: error: ")
    assert output.err.count("\n") == 1
    assert sorted(os.listdir()) == before
    return output.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "papr-1"], "did you mean 'paper-1'"),
        (["run", "paper-1", "--elements", "2"], "elements is 2"),
        (["run", "paper-1", "--accuracy", "2", "--discretisation", "linear"], "accuracy is 2.0: give a relative error"),
        (["run", "paper-1", "--accuracy", "1e-3"], "collocation has no error estimate"),
        (["run", "paper-1", "--accuracy", "1e-3", "--elements", "40"], "give one of them"),
        (["run", "paper-1", "--elements", "many"], "'many' is not a valid integer.*bemkit run --help"),
        (["run", "paper-1", "--elements", "100000", "--degree", "3"], "use at most"),
        (["run", "paper-1", "--solver", "newtn"], "unknown solver 'newtn'"),
        (["run", "paper-1", "--discretisation", "cubic"], "unknown discretisation 'cubic'"),
        (["run", "paper-1", "--rho", "-1"], "rho"),
        (["run", "paper-1", "--bogus"], "--bogus"),
        (["run", "paper-1", "--set", "law.friction"], "set is 'law.friction': give KEY=VALUE"),
        (["run", "paper-1", "--set", "law.friction=1"], "law.friction: unknown key.*did you mean"),
        (["run", "paper-1", "--set", "thickness=1", "--set", "thickness=2"], "thickness is set twice: give it one"),
        (["run", "paper-1", "--set", "mesh.elements=[1"], r"mesh.elements: '\[1' is not a value of a scene file"),
        (["run", "paper-1", "--set", "mesh.elements=many"], "mesh.elements: .*many"),
        (["run"], "Missing argument"),
        (["rn"], "no command 'rn'; did you mean 'run'?"),
        (["run", "paper-1", "-o", "no/r.h5"], "the folder .* does not exist"),
        (["run", "paper-1", "-o", "folder.h5"], "exists and is not a file"),
        (["run", "paper-1", "-o", "thesis.h5"], "exists and is not a bemkit result"),
        (["run", "paper-1", "--plot", "thesis.txt"], "exists and is not a folder"),
        (["run", "paper-1", "--json", "-", "--csv", "-"], "two outputs go to the same file"),
        (["run", "paper-1", "-o", "r.json", "--json", "r.json"], "two outputs go to the same file"),
        (["run", "paper-1", "-o", "r.json", "--json", "./r.json"], "two outputs go to the same file"),
        (["run", "paper-1", "-o", "-"], "- is standard output.*give a file name"),
        (["run", ""], "'': cannot be read .*give the path of a TOML file"),
        (["show", "."], "not a file: give a file"),
        (["show", "none.h5"], "no such file"),
        (["show", "thesis.txt"], "not an HDF5 file"),
        (["show", "thesis.txt", "--json", "-", "--scene"], "--scene prints to standard output"),
        (["show", "thesis.txt", "--table", "steps"], "--table names the table of --csv"),
        (["plan", "none"], "no such file or shipped scene"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("thesis.txt", "thesis.h5"):
        Path(name).write_text("my thesis", "utf-8")
    Path("folder.h5").mkdir()
    assert re.search(message, one_line_error(capsys, *arguments))
    assert Path("thesis.txt").read_text("utf-8") == "my thesis"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("poisson_ratio = 0.2", "poisson_ratio = 0.9", "poisson_ratio is 0.9"),
        ("friction_coefficient", "friction_coeficient", "did you mean 'friction_coefficient'"),
        ('sides = ["right"]', 'sides = ["bottom"]', "foundation"),
        ("y = -1.0", 'y = "log(x - 2)"', "is nan at"),
        ("x > 0.5", "x > 5", "top-load"),
        ("[shape]", "[shape", "not valid TOML"),
    ],
)
def test_a_bad_scene_is_one_line_that_names_the_file(
    old: str, new: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = shipped_files()["paper-1"].read_text("utf-8")
    assert old in text
    Path("my.toml").write_text(text.replace(old, new), "utf-8")
    error = one_line_error(capsys, "run", "my.toml", "-o", "r.h5", *SMALL)
    assert error.startswith("bemkit: error: my.toml: ")
    assert message in error


@pytest.mark.parametrize(
    ("old", "new", "arguments", "message"),
    [
        ("friction_coefficient = 0.5", 'friction_coefficient = "x - 0.5"', [], "must be zero or positive"),
        ("friction_coefficient = 0.5", 'friction_coefficient = "log(x - 0.5)"', [], "is nan at"),
        ('"coulomb"', '"cohesive-coulomb"\ncap = 0.1', ["--solver", "lemke"], "use SemismoothNewton"),
        ("title =", "load_factors = [0.5, 1.0]\ntitle =", ["--cascade"], "run it on one mesh"),
    ],
)
def test_what_shows_only_while_solving_is_one_line_too(
    old: str, new: str, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = shipped_files()["paper-1"].read_text("utf-8")
    assert old in text
    Path("my.toml").write_text(text.replace(old, new), "utf-8")
    error = one_line_error(capsys, "run", "my.toml", "-o", "r.h5", *SMALL, *arguments)
    assert error.startswith("bemkit: error: my.toml: ")
    assert message in error


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError])
def test_an_interrupt_leaves_no_file(
    error: type[BaseException], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*arguments: object, **options: object) -> None:
        raise error

    monkeypatch.setattr(bemkit.results.result_file, "_write_mesh", interrupted)
    assert call("run", "paper-1", *SMALL, "-o", "r.h5") == (130 if error is KeyboardInterrupt else 2)
    assert os.listdir() == []
    assert capsys.readouterr().err.strip().count("\n") == 0


def test_a_real_ctrl_c_ends_with_130() -> None:
    heeds = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"  # a background job does not
    code = f"{heeds}; import sys; from bemkit.cli.main import main; print('ready', flush=True); main(sys.argv[1:])"
    process = subprocess.Popen(
        [sys.executable, "-c", code, "run", "paper-1", "--elements", "3000", "-o", "r.h5"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    process.stdout.readline()
    time.sleep(1.0)  # into the assembly of 3000 elements, which takes longer than that
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors.strip() == "bemkit: error: interrupted"
    assert os.listdir() == []


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_ctrl_c_that_python_drops_while_a_command_loads_ends_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    load = commands.get_command

    def swallowing(*arguments: Any) -> Any:
        body = threading.Event()
        reference = weakref.ref(body, lambda _: signal.raise_signal(signal.SIGINT))
        del body
        assert reference() is None
        return load(*arguments)

    monkeypatch.setattr(commands, "get_command", swallowing)
    try:
        assert call("cite", "paper-1") == 130
    finally:
        signal.signal(signal.SIGINT, before)
    assert "bemkit: error: interrupted" in capsys.readouterr().err


ENDINGS = (signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")
STAGES = {
    "compression": (bemkit.operators.hierarchy.skeletons.LevelView, "skeleton"),
    "contact step": (SemismoothNewton, "step"),
    "writing": (bemkit.results.result_file, "_write_mesh"),
}


@pytest.mark.parametrize(
    ("stage", "sent", "code", "word"),
    slow_only(
        [(stage, *ending) for stage in STAGES for ending in ENDINGS],
        *((stage, *ENDINGS[1]) for stage in ("contact step", "writing")),
    ),
)
def test_a_compressed_run_that_is_ended_says_so_and_leaves_no_file(
    stage: str,
    sent: signal.Signals,
    code: int,
    word: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    owner, name = STAGES[stage]
    work = getattr(owner, name)

    def ended(*arguments: object, **options: object) -> object:
        os.kill(os.getpid(), sent)
        return work(*arguments, **options)

    Path("large.toml").write_text(
        scene_to_toml(dataclasses.replace(load_scene("paper-1"), linear_solver=Hierarchical()))
    )
    monkeypatch.setattr(owner, name, ended)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job does not heed it
    try:
        assert call("run", "large.toml", "--discretisation", "constant", "--elements", "300", "-o", "r.h5") == code
    finally:
        signal.signal(signal.SIGINT, before)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    assert os.listdir() == ["large.toml"]
    assert capsys.readouterr().err.strip() == f"bemkit: error: {word}"


def test_an_interrupt_while_the_command_line_loads_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Loading(types.ModuleType):
        def __getattr__(self, name: str) -> object:
            raise KeyboardInterrupt

    monkeypatch.setitem(sys.modules, "bemkit.cli.main", Loading("bemkit.cli.main"))
    with pytest.raises(SystemExit, match="130"):
        bemkit.__main__.main()
    assert capsys.readouterr().err == "bemkit: error: interrupted\n"


@pytest.mark.slow
def test_a_closed_pipe_is_no_error() -> None:
    command = f"{sys.executable} -c 'from bemkit.cli.main import main; main()' run paper-1 --csv - | head -n 1"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, check=False)
    assert done.stdout.startswith("x,y,s")
    assert done.stderr == ""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no device that is always full")
@pytest.mark.parametrize(
    "arguments", slow_except(["run paper-1 --elements 40 --json -", "run paper-1 --elements 40", "scenes"], "scenes")
)
def test_a_full_disk_behind_standard_output_is_one_line(arguments: str) -> None:
    code = "from bemkit.cli.main import main; main()"
    with open("/dev/full", "w", encoding="utf-8") as full:
        command = [sys.executable, "-c", code, *arguments.split()]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("bemkit: error: standard output: cannot be written (")
    assert done.stderr.count("\n") == 1


def test_the_list_of_commands_loads_none_of_them() -> None:
    code = """
import sys
from bemkit.cli.main import main
try:
    main(["--help"])
except SystemExit as end:
    assert end.code == 0
print(sorted({"numpy", "bemkit.cli.run"} & set(sys.modules)), file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"
    for command in commands.list_commands(click.Context(commands)):
        assert re.search(rf"^  {command} +[A-Z]", done.stdout, re.MULTILINE)
        assert commands.get_command(click.Context(commands), command) is not None


def test_the_convergence_table_has_a_line_per_step() -> None:
    from rich.console import Console

    from bemkit.scene.toml import load_scene, with_overrides

    console = Console(file=io.StringIO(), width=100)
    solution = bemkit.runs.run.run(
        with_overrides(load_scene("paper-1"), elements=40), callback=ConvergenceTable(console)
    )
    lines = console.file.getvalue().splitlines()  # type: ignore[attr-defined]
    assert lines[0].split()[:3] == ["step", "solves", "separated"]
    assert len(lines) == 1 + len(solution.history)


def test_sizes_are_readable() -> None:
    assert [format_size(n) for n in (0, 999, 3_280_000, 5 * 10**13)] == ["0 B", "999 B", "3.28 MB", "50 TB"]
