"""Warnings: found, shown in yellow, and kept in JSON and result files."""

from __future__ import annotations

import dataclasses
import io
import json
from pathlib import Path

import h5py
import pytest
from rich.console import Console

from bemkit.hdf5 import Reader
from bemkit.io import read_result, write_result
from bemkit.plan import make_plan, this_machine
from bemkit.report import print_plan, print_summary
from bemkit.runner import run
from bemkit.scenefile import load_scene, with_overrides
from bemkit.solution import Solution
from bemkit.tables import to_json

WORDS = ("The first doubt: do this.", "The second, with \N{GREEK SMALL LETTER NU} = 0.5.")


@pytest.fixture(scope="module")
def solution() -> Solution:
    found = run(with_overrides(load_scene("paper-1"), elements=40, discretisation="linear"))
    plan = dataclasses.replace(found.plan, warnings=WORDS[:1])
    return dataclasses.replace(found, plan=plan, warnings=WORDS)


def test_a_file_keeps_warnings(tmp_path: Path, solution: Solution) -> None:
    write_result(tmp_path / "r.h5", solution)
    again = read_result(tmp_path / "r.h5")
    assert (again.warnings, again.plan.warnings) == (WORDS, WORDS[:1])


def test_a_file_written_before_there_were_warnings_can_be_read(tmp_path: Path, solution: Solution) -> None:
    write_result(tmp_path / "r.h5", solution)
    with h5py.File(tmp_path / "r.h5", "r+") as file:
        del file["warnings"], file["plan/warnings"]
        file.attrs["sha256"] = Reader("old", 10**9, file).checksum()
    again = read_result(tmp_path / "r.h5")
    assert (again.warnings, again.plan.warnings) == ((), ())


def test_json_lists_warnings(solution: Solution) -> None:
    summary = json.loads(to_json(solution))
    assert summary["warnings"] == list(WORDS)
    assert summary["plan"]["warnings"] == list(WORDS[:1])


def test_the_summary_shows_warnings_in_yellow(solution: Solution) -> None:
    stream = io.StringIO()
    print_summary(solution, Console(file=stream, force_terminal=True, color_system="standard", width=200))
    lines = stream.getvalue().splitlines()
    # 33 is yellow in ISO 6429
    assert [line for line in lines if "warning" in line] == [f"\x1b[33mwarning: {words}\x1b[0m" for words in WORDS]


def test_the_plan_shows_warnings(capsys: pytest.CaptureFixture[str], solution: Solution) -> None:
    print_plan("title", solution.plan, this_machine())
    assert f"warning: {WORDS[0]}" in capsys.readouterr().out


def test_a_plan_without_doubts_has_no_warnings() -> None:
    scene = load_scene("paper-1")
    assert make_plan(scene, scene.build_mesh()).warnings == ()
