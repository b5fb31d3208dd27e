"""The engine of all studies: order, records that are kept, files that are complete after every record, and progress."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest

from bemkit.atomic_files import OutputFileError
from bemkit.hdf5 import FileFormat, ResultFileError
from bemkit.results.outputs import Outputs, TextFile
from bemkit.results.record_file import RecordFile, RowJournal
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


def test_the_file_is_written_twice_however_many_records_there_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, written, sizes = tmp_path / "squares.h5", [], []
    write = RecordFile.write
    monkeypatch.setattr(RecordFile, "write", lambda *args: (written.append(len(args[3])), write(*args)))
    for record in FILE.keep(path, compute(tasks(*range(50))), {}, LABELS):
        assert FILE.read(path)[1][-1] == record
        sizes.append(path.stat().st_size)
    assert written == [1, 50]
    assert len(set(sizes)) == 1  # what was there stays as it was
    assert [each.name for each in tmp_path.iterdir()] == ["squares.h5"]


def test_the_journal_of_a_killed_study_goes_into_the_file_without_its_last_half_line(tmp_path: Path) -> None:
    path, killed = tmp_path / "squares.h5", tmp_path / "killed.h5"
    records = FILE.keep(path, compute(tasks(1, 2, 3, 4)), {}, LABELS)
    for _ in range(4):
        next(records)
    killed.write_bytes(path.read_bytes())
    journal = tmp_path / ".killed.h5.rows"
    journal.write_bytes((tmp_path / ".squares.h5.rows").read_bytes()[:-3])
    records.close()
    finished = FILE.finished(killed, LABELS)
    assert list(finished) == [1, 2, 3]
    assert list(FILE.keep(killed, compute(tasks(1, 2), finished=finished), finished, LABELS))
    assert not journal.exists()
    assert [record.key for record in FILE.read(killed)[1]] == [1, 2, 3]


def test_a_journal_of_another_file_is_passed_over(tmp_path: Path) -> None:
    path, other = tmp_path / "squares.h5", tmp_path / "other.h5"
    for name in (path, other):
        FILE.write(name, LABELS, [square(len(name.name))])
    journal = RowJournal(other)
    journal.begin()
    journal.add([5, 25.0, ""])
    (tmp_path / ".squares.h5.rows").write_bytes((tmp_path / ".other.h5.rows").read_bytes())
    assert [record.key for record in FILE.read(path)[1]] == [10]
    assert [record.key for record in FILE.read(other)[1]] == [8, 5]
    journal.add([6, 36.0])
    with pytest.raises(ResultFileError, match=r"other\.h5: a row in \.other\.h5\.rows is damaged: delete that file"):
        FILE.read(other)
    (tmp_path / ".other.h5.rows").unlink()
    (tmp_path / ".other.h5.rows").mkdir()
    with pytest.raises(OutputFileError, match=r"other\.h5: cannot be written \(Is a directory\): choose another place"):
        journal.add([6, 36.0, ""])


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
