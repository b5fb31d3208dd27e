"""The engine of all studies: order, records that are kept, files that are complete after every record, and progress."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from threading import Event

import h5py
import pytest
from rich.console import Console

from bemkit.atomic_files import OutputFileError
from bemkit.cli.options import study_output
from bemkit.cli.outputs import Outputs, TextFile
from bemkit.cli.progress import compute_with_progress
from bemkit.studies import engine
from bemkit.studies.engine import Task, compute
from bemkit.studies.row_file import RowFile, RowFileError
from bemkit.table import Table, column


@dataclass(frozen=True)
class Square:
    """The square of a number."""

    number: int = column("a number")
    value: float = column("its square", "m2", ".3g")
    remark: str = field(default="", metadata={"meaning": "a | bar", "unit": "", "format": ""})

    @property
    def key(self) -> int:
        """The number."""
        return self.number


FILE = RowFile("bemkit-squares 1", Square, ("title",))
LABELS = {"title": "squares"}


def square(number: int) -> Square:
    if number < 0:
        raise ValueError("no such number")
    return Square(number, float(number**2))


def tasks(*numbers: int) -> list[Task[Square]]:
    return [Task(number, f"square of {number}", partial(square, number)) for number in numbers]


def missing(*numbers: int) -> Callable[[Mapping[Hashable, Square]], Iterator[Square]]:
    """Return what computes those of the numbers that are not finished."""
    return lambda finished: compute([task for task in tasks(*numbers) if task.key not in finished])


def as_text(records: Sequence[Square]) -> str:
    return "".join(f"{record.value}\n" for record in records)


def test_records_come_in_order() -> None:
    begun: list[str] = []
    records = list(compute(tasks(1, 3), begins=lambda task: begun.append(task.label)))
    assert records == [Square(1, 1.0), Square(3, 9.0)]
    assert begun == ["square of 1", "square of 3"]
    with ThreadPoolExecutor(2) as executor:
        assert {record.key for record in compute(tasks(1, 3), executor)} == {1, 3}


def test_without_a_file_all_records_are_computed() -> None:
    assert FILE.completed(None, LABELS, missing(1, 2)) == {1: Square(1, 1.0), 2: Square(2, 4.0)}


def test_every_record_is_in_the_file_before_the_next_is_computed(tmp_path: Path) -> None:
    path = tmp_path / "squares.jsonl"
    assert FILE.check(str(path)) == [path]
    with pytest.raises(ValueError, match="no such number"):
        FILE.completed(path, LABELS, missing(1, 2, -1, 3))
    finished = FILE.finished(path, LABELS)
    assert list(finished.values()) == [Square(1, 1.0), Square(2, 4.0)]
    content = path.read_bytes()
    assert FILE.completed(path, LABELS, missing(2)) == finished
    assert path.read_bytes() == content  # nothing new, nothing written
    assert FILE.completed(path, LABELS, missing(3)) == finished | {3: Square(3, 9.0)}
    assert [record.key for record in FILE.read(path)[1]] == [1, 2, 3]
    with pytest.raises(RowFileError, match="holds a study with title squares, not cubes: choose another name"):
        FILE.finished(path, {"title": "cubes"})


def test_a_row_is_appended_and_what_was_there_stays(tmp_path: Path) -> None:
    path = tmp_path / "squares.jsonl"

    def seen(finished: Mapping[Hashable, Square]) -> Iterator[Square]:
        content = ""
        for record in missing(*range(50))(finished):
            yield record
            assert FILE.read(path)[1][-1] == record
            assert path.read_text().startswith(content)
            content = path.read_text()

    assert len(FILE.completed(path, LABELS, seen)) == 50
    assert [each.name for each in tmp_path.iterdir()] == ["squares.jsonl"]


def test_a_killed_study_resumes_after_its_last_whole_line(tmp_path: Path) -> None:
    path = tmp_path / "squares.jsonl"
    FILE.completed(path, LABELS, missing(1, 2, 3, 4))
    path.write_bytes(path.read_bytes()[:-3])
    assert list(FILE.finished(path, LABELS)) == [1, 2, 3]
    FILE.completed(path, LABELS, missing(3, 4, 5))
    assert [record.key for record in FILE.read(path)[1]] == [1, 2, 3, 4, 5]


def test_rows_are_kept_in_files_that_say_so(tmp_path: Path) -> None:
    with pytest.raises(OutputFileError, match=r"squares\.h5: rows are kept as JSON Lines: give a name that ends in"):
        FILE.check(tmp_path / "squares.h5")
    with pytest.raises(OutputFileError, match=r"squares\.jsonl: cannot be written \(No such file or directory\)"):
        FILE.completed(tmp_path / "missing" / "squares.jsonl", LABELS, missing(1))


def as_table(records: Sequence[Square]) -> Table:
    return Table.from_records(Square, records)


@pytest.mark.parametrize(
    ("ending", "begin"), [(".csv", "number,value,"), (".json", "[\n"), (".md", "| number |"), (".h5", "")]
)
def test_a_table_obeys_the_ending_of_its_file(tmp_path: Path, ending: str, begin: str) -> None:
    path = tmp_path / f"squares{ending}"
    rows, table = study_output(str(path), as_table)
    assert rows is None
    outputs = Outputs((table,))
    assert outputs.check() == [path]
    outputs.write([square(1), square(2)])
    if ending == ".h5":
        with h5py.File(path) as file:
            assert file["value"][()].tolist() == [1.0, 4.0]
            assert dict(file["value"].attrs) == {"unit": "m2", "meaning": "its square"}
    else:
        assert path.read_text().startswith(begin)


def test_a_long_bundle_hands_back_what_is_finished(monkeypatch: pytest.MonkeyPatch) -> None:
    """A study that is killed loses only what its processes have not handed back."""
    monkeypatch.setattr(engine, "PATIENCE_SECONDS", 0.0)
    has_arrived = Event()

    def slow(number: int) -> Square:
        time.sleep(0.2 * number)  # longer than four times the first one
        return Square(number, 0.0)

    def last() -> Square:
        return Square(2, float(has_arrived.wait(10.0)))

    computations = (partial(slow, 0), partial(slow, 1), last)
    shared = [Task(number, "", each, group="one body") for number, each in enumerate(computations)]
    records = []
    with ThreadPoolExecutor(1) as executor:
        for record in compute(shared, executor):
            records.append(record)
            has_arrived.set()
    assert records == [Square(0, 0.0), Square(1, 0.0), Square(2, 1.0)]


def test_an_ending_that_no_table_has_is_refused(tmp_path: Path) -> None:
    message = (
        r"rows\.xyz: the ending '\.xyz' names no format of tables: give one of \.csv, \.json, \.md, \.h5, or \.jsonl"
    )
    with pytest.raises(OutputFileError, match=message):
        Outputs((study_output(str(tmp_path / "rows.xyz"), as_table)[1],)).check()
    assert study_output("rows.jsonl", as_table)[0] == "rows.jsonl"
    assert FILE.check(study_output("ROWS.JSONL", as_table)[0]) == [Path("ROWS.JSONL").resolve()]


def test_texts_are_written_only_where_they_are_wanted(tmp_path: Path) -> None:
    outputs = Outputs((TextFile(str(tmp_path / "a.txt"), as_text), TextFile(None, as_text)))
    assert outputs.check() == [tmp_path / "a.txt"]
    outputs.write([square(1), square(2)])
    assert (tmp_path / "a.txt").read_text() == "1.0\n4.0\n"


def test_the_bar_is_on_standard_error_and_only_where_it_is_live(capsys: pytest.CaptureFixture[str]) -> None:
    terminal = Console(stderr=True, force_terminal=True)
    assert list(compute_with_progress(tasks(1, 2), "squares", is_live=True, console=terminal)) == [square(1), square(2)]
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "square of 2" in shown.err
    list(compute_with_progress(tasks(1), "squares", is_live=False))
    assert capsys.readouterr() == ("", "")
