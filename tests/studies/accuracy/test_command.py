"""``bemkit study``: tables, files, figures, resume, exit codes, and one line for every wrong input."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Callable
from pathlib import Path

import matplotlib.image
import pytest
from click.testing import CliRunner, Result
from rich.console import Console

import bemkit as bk
from bemkit.cli.main import commands
from bemkit.cli.printed_errors import WIDE, print_study
from bemkit.cli.progress import compute_with_progress
from bemkit.errors import BemkitError, one_line
from bemkit.reference import MEASURES, find_reference
from bemkit.studies.accuracy.figures import draw_errors
from bemkit.studies.accuracy.records import FILE, table_of
from bemkit.studies.accuracy.runs import all_runs, error_tasks, uniform
from bemkit.studies.row_file import RowFileError
from tests.studies.accuracy.records import row

FEW = ("--sizes", "12,24", "--discretisations", "linear", "--solvers", "semismooth-newton", "--repeat", "1")
FAST = ("study", "paper-1", *FEW, "--meshes", "uniform")


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(commands, [str(argument) for argument in arguments], standalone_mode=False)


def test_everything_is_written_and_the_tables_are_printed(tmp_path: Path) -> None:
    files = {name: tmp_path / f"rows.{name}" for name in ("jsonl", "csv")}
    arguments = ("study", "paper-1", *FEW, "--meshes", "uniform,adaptive", "--accuracies", "1e-1")
    result = call(*arguments, "-o", files["jsonl"], "--csv", files["csv"], "--plot", tmp_path / "plots")
    assert result.exception is None
    assert result.return_value == 0
    for words in (
        "reference: over-resolved: ",
        "its own errors, at most: energy 4e-14",
        "linear elements, Galerkin, uniform meshes, semismooth-newton",
        "linear elements, Galerkin, adaptive meshes",
        "observed rates in the number n of unknowns",
        "* no other run of this study is both faster and more accurate",
    ):
        assert words in result.output
    labels, rows = FILE.read(files["jsonl"])
    assert "title" in labels["scene"]
    assert [(row.meshes, row.size) for row in rows] == [("uniform", 12.0), ("uniform", 24.0), ("adaptive", 0.1)]
    assert files["csv"].read_text() == table_of(rows).to_csv()
    picture = matplotlib.image.imread(tmp_path / "plots" / "error-against-run-time.png")
    assert min(picture.shape[:2]) > 700
    assert picture[..., :3].std() > 0.05  # not blank


@pytest.mark.slow
def test_the_word_errors_may_be_left_out_and_the_other_commands_stay() -> None:
    short, long = call(*FAST, "--csv", "-"), call("study", "errors", *FAST[1:], "--csv", "-")
    names = [[line["energy"] for line in csv.DictReader(result.output.splitlines())] for result in (short, long)]
    assert names[0] == names[1]
    assert len(names[0]) == 2
    assert "SCENE" in call("study", "--help").output
    assert call("study", "solutions", "paper-1", "--elements", "20", "--starts", "1").return_value == 0


@pytest.mark.slow
def test_rows_in_the_file_are_not_computed_again_and_others_are_added(
    tmp_path: Path,
) -> None:
    path = tmp_path / "rows.jsonl"
    assert call(*FAST, "-q", "-o", path).return_value == 0
    before = FILE.read(path)[1]
    more = call("study", "paper-1", *FEW, "--meshes", "graded", "-q", "-o", path)
    assert more.return_value == 0
    assert FILE.read(path)[1][:2] == before
    assert len(FILE.read(path)[1]) == 4
    text = path.read_bytes()
    assert call(*FAST, "-q", "-o", path).return_value == 0
    assert path.read_bytes() == text  # with the times of the first solves


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--repeat", "2"), "holds a study with repetitions 1, not 2: choose another name or delete it first"),
        (("--exponent", "2"), "holds a study with grading exponent 3, not exponent 2"),
        (("--most-elements", "90"), "holds a study with budget 500 elements, not 90 elements"),
        (("--over-resolve", "90"), "holds a study with reference known, not over-resolved by 90 elements"),
    ],
)
def test_changed_settings_and_other_scenes_are_not_mixed(
    tmp_path: Path, arguments: tuple[str, ...], message: str
) -> None:
    path = tmp_path / "rows.jsonl"
    labels = {"scene": bk.scene_to_toml(bk.load_scene("paper-1")), "reference": "known", "grading": "exponent 3"}
    FILE.completed(path, labels | {"budget": "500 elements", "repetitions": "1"}, lambda finished: [row()])
    content = path.read_bytes()
    assert message in str(call(*FAST, "-o", path, *arguments).exception)
    other = call("study", "paper-2", *FAST[2:], "-o", path)
    assert "holds a study of another scene: choose another name" in str(other.exception)
    assert path.read_bytes() == content


def test_files_of_others_stay(tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    path.write_text("my thesis")
    assert "is not a complete file of the format" in str(call(*FAST, "-o", path).exception)
    assert path.read_text() == "my thesis"


def test_a_scene_without_a_reference_says_what_a_fine_solution_costs() -> None:
    result = call("study", "receding-layer", *FEW)
    assert isinstance(result.exception, BemkitError)
    message = one_line(result.exception)
    assert "receding-layer: no closed form or reference solution belongs to this scene" in message
    assert "add --over-resolve 600 to measure against a fine solution (600 elements, about " in message
    assert " GB)" in message


@pytest.mark.slow
def test_an_over_resolved_solution_is_the_reference_if_asked_for() -> None:
    result = call("study", "receding-layer", *FEW, "--meshes", "uniform", "--over-resolve", "120")
    assert result.return_value == 0
    assert "reference: over-resolved:" in result.output
    assert "its own errors, at most: energy" in result.output


@pytest.mark.slow
def test_processes_find_errors_and_say_that_times_are_missing(tmp_path: Path) -> None:
    arguments = [*FAST[:-4], "--meshes", "uniform", "--jobs", "2"]
    result = call(*arguments, "--plot", tmp_path)
    assert result.return_value == 0
    assert "run times and memory were not measured: the runs were spread over processes" in result.output
    assert (tmp_path / "error-against-run-time.png").exists()
    assert "remove --repeat" in str(call(*FAST, "--jobs", "2").exception)


def test_a_run_that_fails_shows_in_the_table_and_the_exit_code(tmp_path: Path) -> None:
    scene = dataclasses.replace(bk.load_scene("paper-1"), solver=bk.SemismoothNewton(max_steps=1))
    path = tmp_path / "scene.toml"
    path.write_text(bk.scene_to_toml(scene))
    # the scene's own driver keeps its options, and its problem the reference
    result = call("study", path, *FEW, "--meshes", "uniform")
    assert result.return_value == 1
    assert "24: max steps: " in result.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("study", "paper-3"), "no such file or shipped scene"),
        (("study", "bending"), "no part of the scene is in contact"),
        (("study", "paper-1", "--sizes", "0"), "elements is 0: give a number from 3"),
        (("study", "paper-1", "--sizes", ","), "sizes is ',': give at least one"),
        (("study", "paper-1", "--sizes", "40,many"), "sizes is '40,many': give numbers with commas"),
        (("study", "paper-1", "--sizes", "40,40"), "of size 40 is given twice"),
        (("study", "paper-1", "--accuracies", "2"), "accuracy is 2.0: give a relative error between 0 and 1"),
        (("study", "paper-1", "--discretisations", "cubic"), "cubic"),
        (("study", "paper-1", "--solvers", "newton"), "unknown solver 'newton'"),
        (("study", "paper-1", "--meshes", "grade"), "meshes: unknown 'grade': the known ones are uniform, graded"),
        (("study", "paper-1", "--errors", "sigma"), "errors: unknown 'sigma': the known ones are energy, sigma_n"),
        (("study", "paper-1", "--exponent", "0.5"), "exponent is 0.5: give a finite number of at least 1"),
        (("study", "paper-1", "--meshes", "adaptive", "--discretisations", "constant"), "no run is possible"),
        (("study", "paper-1", "-o", "/nowhere/rows.jsonl"), "create it first"),
        (("study", "paper-1", "--most-elements", "3"), "most_elements is 3"),
    ],
)
def test_bad_input_is_one_line(arguments: tuple[str, ...], message: str) -> None:
    error = call(*arguments).exception
    assert isinstance(error, BemkitError)
    assert message in str(error)
    assert len(str(error).splitlines()) == 1


def test_without_matplotlib_there_is_no_figure(without: Callable[..., None], tmp_path: Path) -> None:
    without("matplotlib")
    assert 'figures need matplotlib: pip install "bemkit[plot]"' in str(call(*FAST, "--plot", tmp_path).exception)


def test_a_label_that_is_missing_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    labels, rows = dict.fromkeys(FILE.labels, "x"), (row(), row(size=80.0, message="a \u00fc"))
    FILE.completed(path, labels, lambda finished: rows)
    assert repr(FILE.read(path)) == repr((labels, rows))
    path.write_text(path.read_text().replace('"grading": "x", ', ""))
    with pytest.raises(
        RowFileError, match="is not a complete file of the format 'bemkit-study 3': choose another name"
    ):
        FILE.read(path)


def test_narrow_terminals_show_less_and_nothing_is_cut(capsys: pytest.CaptureFixture[str]) -> None:
    rows = [row(), row(size=80.0, elements=80, energy=1e-4, seconds=0.4, transitions=float("inf"))]
    rows.append(row(meshes="adaptive", size=1e-4, elements=500))
    for width in (80, WIDE + 20):
        print_study(rows, ("energy", "sigma_n", "displacement", "transitions"), Console(width=width))
        shown = capsys.readouterr().out
        assert ("assem." in shown) == (width > WIDE)
        assert "\u2026" not in shown
        assert "1.0e-4  3.3*" in shown
        assert "absent" in shown


@pytest.mark.slow
def test_progress_goes_to_standard_error(capsys: pytest.CaptureFixture[str]) -> None:
    terminal = Console(stderr=True, force_terminal=True)
    runs = all_runs(bk.load_scene("paper-1"), [bk.Galerkin(1)], [uniform((20,))], [bk.SemismoothNewton()])
    found = find_reference(bk.load_scene("paper-1"))
    assert found is not None
    tasks = error_tasks(runs, found, 1)
    (computed,) = compute_with_progress(tasks, "error study", is_live=True, console=terminal)
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "linear, uniform 20, semismooth-newton" in shown.err
    assert computed.key == tasks[0].key
    list(compute_with_progress([], "error study", is_live=False))
    assert capsys.readouterr() == ("", "")


def test_figures_name_every_series_and_show_the_front() -> None:
    rows = [
        row(),
        row(size=80.0, elements=80, energy=1e-4, seconds=0.4),
        row(discretisation="constant", map="collocation", energy=1e-2, seconds=0.2, solver="augmented-lagrangian"),
    ]
    figure = draw_errors(rows, ("energy", "sigma_n", "transitions"), title="a scene")
    panels = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title(loc="left") for axes in panels] == [
        f"relative error: {MEASURES[name]}" for name in ("energy", "sigma_n", "transitions")
    ]
    legend = {text.get_text() for text in figure.legends[0].get_texts()}
    assert legend == {
        *("linear elements (Galerkin)", "constant elements (collocation)", "uniform meshes"),
        *("semismooth-newton", "augmented-lagrangian", "no run is faster and more accurate"),
    }
    front, first, *_ = panels[0].lines
    assert front.get_ydata().tolist() == [1e-3, 1e-4]
    assert first.get_xdata().tolist() == [0.1, 0.4]
    assert [text.get_text() for text in panels[0].texts] == ["3.3"]
    untimed = [dataclasses.replace(each, seconds=float("nan")) for each in rows]
    assert draw_errors(untimed, ("energy",)).axes[0].get_xlabel() == "number of unknowns"
    missed = draw_errors([dataclasses.replace(each, transitions=float("inf")) for each in rows], ("transitions",))
    missed.savefig(io.BytesIO())
    assert [text.get_text() for text in missed.axes[0].texts] == ["no finite error"]
