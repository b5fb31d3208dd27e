"""The engine of all studies: order, records that are kept, files that are complete after every record, and progress."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest

from bemkit.hdf5 import FileFormat, ResultFileError
from bemkit.results.outputs import Outputs, TextFile
from bemkit.results.record_file import RecordFile
from bemkit.studies.engine import Task, compute, compute_with_progress


@dataclass(frozen=True)
class Square:
    """The square of a number."""

    number: int
    value: float
    remark: str = ""

    @property
    def key(self) -> int:
        """The number."""
        return self.number


FORMAT = FileFormat("bemkit-squares", 1, "bemkit squares file", "bemkit squares -o")
FILE = RecordFile(FORMAT, Square, ("title",))
LABELS = {"title": "squares"}


def square(number: int) -> Square:
    if number < 0:
        raise ValueError("no such number")
    return Square(number, float(number**2))


def tasks(*numbers: int) -> list[Task[Square]]:
    return [Task(number, f"square of {number}", partial(square, number)) for number in numbers]


def as_text(records: Sequence[Square]) -> str:
    return "".join(f"{record.value}\n" for record in records)


def test_records_come_in_order_and_finished_ones_are_handed_on() -> None:
    kept = Square(2, -1.0, "kept")
    begun: list[str] = []
    finished = {2: kept}
    records = list(compute(tasks(1, 2, 3), finished=finished, begins=lambda task: begun.append(task.label)))
    assert records == [Square(1, 1.0), kept, Square(3, 9.0)]
    assert begun == ["square of 1", "square of 3"]
    with ThreadPoolExecutor(2) as executor:
        first, *others = compute(tasks(1, 2, 3), executor, finished=finished)
    assert first is kept
    assert {record.key for record in others} == {1, 3}


def test_every_record_is_in_the_file_before_the_next_is_computed(tmp_path: Path) -> None:
    path = tmp_path / "squares.h5"
    assert FILE.check(str(path)) == [path]
    with pytest.raises(ValueError, match="no such number"):
        list(FILE.keep(path, compute(tasks(1, 2, -1, 3)), FILE.finished(path, LABELS), LABELS))
    finished = FILE.finished(path, LABELS)
    assert list(finished.values()) == [Square(1, 1.0), Square(2, 4.0)]
    content = path.read_bytes()
    assert list(FILE.keep(path, compute(tasks(2), finished=finished), finished, LABELS)) == [Square(2, 4.0)]
    assert path.read_bytes() == content  # nothing new, nothing written
    list(FILE.keep(path, compute(tasks(3), finished=finished), finished, LABELS))
    assert [record.key for record in FILE.read(path)[1]] == [1, 2, 3]
    with pytest.raises(ResultFileError, match="holds the sweep with title squares, not cubes: choose another name"):
        FILE.finished(path, {"title": "cubes"})


def test_texts_are_written_only_where_they_are_wanted(tmp_path: Path) -> None:
    wanted, other = TextFile(str(tmp_path / "a.txt"), "text", "1", as_text), TextFile(None, "text", "1", as_text)
    outputs = Outputs((wanted, other))
    assert outputs.check() == [tmp_path / "a.txt"]
    outputs.write([square(1), square(2)])
    assert (tmp_path / "a.txt").read_text() == "1.0\n4.0\n"


def test_the_bar_is_on_standard_error_and_only_where_it_is_live(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # as if standard error were a terminal
    assert list(compute_with_progress(tasks(1, 2), "squares", is_live=True)) == [square(1), square(2)]
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "square of 2" in shown.err
    list(compute_with_progress(tasks(1), "squares", is_live=False))
    assert capsys.readouterr() == ("", "")
