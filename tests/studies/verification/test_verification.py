"""The verification: rows that are met, rows that are wrong, what is kept, selected, printed and written."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from rich.console import Console

import bemkit as bk
from bemkit.cli.main import main
from bemkit.cli.printed_verification import print_verification
from bemkit.studies.engine import Task, compute
from bemkit.studies.row_file import RowFileError
from bemkit.studies.verification import verification as module
from bemkit.studies.verification.case import Case, Quantity
from bemkit.studies.verification.cases import CASES
from bemkit.studies.verification.records import FILE
from bemkit.studies.verification.verification import Comparison, verify
from tests.slow import slow_except, slow_only

FAST = ("rotating-disc", "uniform-slip", "gravity-column", "pair-patch", "gravity-columns", "kirsch-hole")


def test_fast_cases_are_met() -> None:
    found = verify(FAST, quick=True)
    assert found.is_met
    assert {row.name for row in found.rows} == set(FAST)
    kirsch = next(row for row in found.rows if row.name == "kirsch-hole")
    assert kirsch.order == pytest.approx(3.0, abs=0.2)  # quadratic elements
    assert len(kirsch.errors) == 2


@pytest.mark.parametrize("name", slow_only(["receding-pair", "cattaneo-mindlin"], "receding-pair", "cattaneo-mindlin"))
def test_meshes_of_several_bodies_follow_the_solution(name: str) -> None:
    assert not verify([name], quick=True).missed


@pytest.mark.parametrize(
    "name",
    slow_except(["westergaard", "disc-between-plates", "paper-1", "paper-2", "complete-contact-90"], "paper-1"),
)
def test_rising_degrees_reach_the_accuracies_asked_for(name: str) -> None:
    assert not verify([name], quick=True).missed


@pytest.mark.slow
def test_all_cases_are_met() -> None:
    found = verify()
    assert [f"{row.name}: {row.quantity.name}" for row in found.missed] == []


def kirsch(**changes: object) -> Case:
    """The case with its one quantity changed."""
    case = CASES["kirsch-hole"]()
    return replace(case, quantities=tuple(replace(each, **changes) for each in case.quantities))  # type: ignore[arg-type]


def wrong_value() -> Case:
    """The columns with a settlement that is one part in a million too large."""
    case = CASES["gravity-columns"]()
    first, *others = case.quantities
    return replace(case, quantities=(replace(first, expected=first.expected * (1.0 + 1e-6)), *others))


def fails() -> Case:
    """A case whose scene is refused."""
    return replace(CASES["kirsch-hole"](), solve=lambda scene, n: bk.run(bk.load_scene("no-such-scene")))


WRONG = {
    "value": wrong_value,
    "bound": lambda: kirsch(bounds=(1e-3, 1e-7, 1e-7)),
    "order": lambda: kirsch(order=3.5),
    "scene": fails,
    "zone": lambda: kirsch(measure=lambda solution: solution.transitions[0].s),
}


@pytest.mark.parametrize("name", slow_only(WRONG, "bound"))
def test_a_row_made_wrong_is_missed(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(module, "verify", partial(verify, cases=WRONG))
    with pytest.raises(SystemExit) as caught:
        main(["verify", name, "--quick"])
    assert caught.value.code == 1
    out = " ".join(capsys.readouterr().out.split())  # lines may be folded
    assert f"missed: {name}, " in out
    if name == "scene":
        assert "no-such-scene" in out
    if name == "zone":
        assert "the solution lacks what is compared (IndexError: " in out
    if name == "value":  # the other rows of the case are right
        assert "2 of 3 rows met" in out


def test_nothing_measured_is_nothing_met() -> None:
    def nothing(tasks: Sequence[Task[Comparison]]) -> tuple[Comparison, ...]:
        return ()

    found = verify(["kirsch-hole"], run=nothing)
    assert not found.is_met
    assert found.rows[0].errors == ()


def test_what_is_in_the_file_is_not_computed_again(tmp_path: Path) -> None:
    file, computed = tmp_path / "verification.jsonl", []

    def counting(tasks: Sequence[Task[Comparison]]) -> list[Comparison]:
        computed.append([task.key for task in tasks])
        return list(compute(tasks))

    first = verify(["kirsch-hole"], quick=True, run=counting, file=file)
    second = verify(["kirsch-hole", "rotating-disc"], quick=True, run=counting, file=file)
    assert computed == [
        [("kirsch-hole", 24), ("kirsch-hole", 48)],
        [("rotating-disc", 16), ("rotating-disc", 32)],
    ]
    assert second.rows[0].errors == first.rows[0].errors
    old = tmp_path / "old.jsonl"
    FILE.completed(old, {"version": "0.0"}, lambda finished: (record for row in first.rows for record in row.records))
    with pytest.raises(RowFileError, match="holds a study with version"):
        verify(["kirsch-hole"], file=old)


def test_names_choose_cases() -> None:
    with pytest.raises(bk.InputError, match="'hertz' is not a case: the cases are lame-ring, kirsch-hole"):
        verify(["hertz"])
    assert module.selected(["pin*", "paper-1"], tuple(CASES)) == ("paper-1", "pin-in-hole", "pin-in-stiffer-hole")
    assert module.selected([], ("a", "b")) == ("a", "b")


def test_bounds_that_do_not_fit_are_refused() -> None:
    with pytest.raises(bk.InputError, match="'x' has 1 bounds for 2 resolutions: give one for each"):
        Case(bk.load_scene("paper-1"), "s", "v", (1.0, 2.0), (Quantity("x", lambda solution: 0.0, (1.0,)),))


def test_the_command_writes_json_and_markdown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "table.md"
    with pytest.raises(SystemExit) as caught:
        main(["verify", "kirsch-hole", "--quick", "--json", "-", "--markdown", str(page)])
    assert caught.value.code == 0
    content = json.loads(capsys.readouterr().out)
    (row,) = content["rows"]
    assert content["met"] is True
    assert row["met"] is True
    assert (row["case"], row["source"], row["n_elements"]) == ("kirsch-hole", "Kirsch1898", [24, 48])
    assert row["errors"] == [pytest.approx(value) for value in row["values"]]
    assert all(error <= bound for error, bound in zip(row["errors"], row["bounds"], strict=True))
    assert page.read_text().startswith("| case | quantity | source | expected | errors | order | bound | met |")
    assert "| kirsch-hole | hole in an infinite sheet" in page.read_text()


def test_the_table_fits_a_terminal() -> None:
    found = verify(["kirsch-hole", "uniform-slip"], quick=True)
    console = Console(width=80, file=io.StringIO(), record=True)
    print_verification(found, console)
    lines = console.export_text().splitlines()
    assert len(lines) == 1 + 2 + 4 + 1
    assert lines[-1].strip() == "4 of 4 rows met"
    assert "**no**" not in found.to_markdown()
