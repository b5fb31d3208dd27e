"""``bemkit stability``: tables, files, resume, exit codes."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from bemkit.cli.main import commands
from bemkit.studies.stability.axes import find_axes
from bemkit.studies.stability.figures import draw_axis
from bemkit.studies.stability.records import FILE, StabilityRecord, cells, table_of, to_markdown

FAST = ("stability", "paper-1", "--elements", "32", "--axis", "sliding")


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(commands, [str(argument) for argument in arguments], standalone_mode=False)


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A file with all rows of the sweep."""
    path = tmp_path_factory.mktemp("swept") / "rows.jsonl"
    assert call(*FAST, "-q", "-o", path).return_value == 0
    return path.read_bytes()


def test_everything_is_written_and_the_tables_are_printed(swept: bytes, tmp_path: Path) -> None:
    files = {name: tmp_path / f"rows.{name}" for name in ("jsonl", "csv", "md")}
    files["jsonl"].write_bytes(swept)
    result = call(
        *FAST, "-o", files["jsonl"], "--csv", files["csv"], "--markdown", files["md"], "--plot", tmp_path / "plots"
    )
    assert result.exception is None
    assert result.return_value == 0
    assert "11 rows: 6 right, 5 named" in result.output
    assert "promise: solved below 1, refused above" in result.output
    labels, rows = FILE.read(files["jsonl"])
    assert "title" in labels["scene"]
    assert len(rows) == 11
    assert [row["verdict"] for row in csv.DictReader(files["csv"].read_text().splitlines())] == [
        row.verdict for row in rows
    ]
    assert files["csv"].read_text() == table_of(rows).to_csv()
    assert files["md"].read_text().count("| right |") == 6
    assert (tmp_path / "plots" / "stability-sliding.png").read_bytes().startswith(b"\x89PNG")


def test_rows_in_the_file_are_not_computed_again(swept: bytes, tmp_path: Path) -> None:
    (tmp_path / "rows.jsonl").write_bytes(swept)
    assert call(*FAST, "-q", "-o", tmp_path / "rows.jsonl").return_value == 0
    assert (tmp_path / "rows.jsonl").read_bytes() == swept  # with the times of the first solves


def test_a_wrong_row_shows_in_the_exit_code(swept: bytes, tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    path.write_bytes(swept)
    labels, (first, *others) = FILE.read(path)
    path.unlink()
    FILE.completed(
        path, labels, lambda finished: [replace(first, verdict="wrong", message="the check finds 1.0"), *others]
    )
    result = call(*FAST, "-o", path)
    assert result.return_value == 1
    assert "the check finds 1.0" in result.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("stability", "paper-3"), "no such file or shipped scene"),
        (("stability", "paper-1", "--axis", "rho"), "the axes are youngs-modulus"),
        (("stability", "paper-1", "--csv", "-", "--markdown", "-"), "two outputs go to the same file"),
        (("stability", "paper-1", "-o", "/nowhere/rows.jsonl"), "create it first"),
    ],
)
def test_bad_input_is_one_line(arguments: tuple[str, ...], message: str) -> None:
    assert message in str(call(*arguments).exception)


def test_files_of_others_and_of_other_scenes_stay(swept: bytes, tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    path.write_text("my thesis")
    assert "is not a complete file of the format" in str(call(*FAST, "-o", path).exception)
    assert path.read_text() == "my thesis"
    path.write_bytes(swept)
    other = call("stability", "paper-2", "--elements", "32", "--axis", "sliding", "-q", "-o", path)
    assert "holds a study of another scene: choose another name or delete it first" in str(other.exception)


def test_tables_leave_out_what_does_not_exist() -> None:
    nan = float("nan")
    row = StabilityRecord("sliding", 2.0, "named", "refused", 0, nan, nan, nan, nan, nan, nan, 0.1, "it slides")
    assert cells(row) == ["2", "named", "refused", "", "", "", "", "", "", ""]
    axes = find_axes(["sliding"])
    assert "| 2 | named | refused |" in to_markdown(axes, [row])
    assert draw_axis(axes[0], [row]).axes[0].get_title(loc="left") == "sliding"
