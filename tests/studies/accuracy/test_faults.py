"""A study that is killed keeps its rows and goes on where it stopped."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from bemkit.cli.main import commands
from bemkit.studies.accuracy.records import FILE
from bemkit.studies.row_file import RowFileError
from tests.studies.accuracy.records import row

ARGUMENTS = ("study", "paper-1", "--sizes", "12,16,20", "--meshes", "uniform", "--discretisations", "linear")
STUDY = f"""
import sys
from bemkit.cli.main import main
main([*{ARGUMENTS}, "--repeat", "1", "-q", "-o", sys.argv[1]])
"""


@pytest.mark.slow
def test_a_killed_study_keeps_its_rows_and_goes_on_where_it_stopped(tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    process = subprocess.Popen([sys.executable, "-c", STUDY, str(path)])
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline and process.poll() is None:
        with contextlib.suppress(RowFileError):
            if FILE.read(path)[1]:
                break
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    finished = FILE.read(path)[1]
    assert 0 < len(finished) < 6
    again = CliRunner().invoke(commands, [*ARGUMENTS, "--repeat", "1", "-q", "-o", str(path)], standalone_mode=False)
    assert again.return_value == 0
    after = FILE.read(path)[1]
    assert len(after) == 6
    # equal to the run times: finished rows are taken over, not computed again
    assert repr(after[: len(finished)]) == repr(finished)


@pytest.mark.parametrize("cut", [1, 40, 400])
def test_a_last_line_that_was_cut_off_is_computed_again(tmp_path: Path, cut: int) -> None:
    path, labels = tmp_path / "rows.jsonl", dict.fromkeys(FILE.labels, "x")
    rows = [row(size=float(n)) for n in range(4)]
    FILE.completed(path, labels, lambda finished: rows)
    path.write_bytes(path.read_bytes()[:-cut])
    assert [record.size for record in FILE.finished(path, labels).values()] == [0.0, 1.0, 2.0]
    FILE.completed(path, labels, lambda finished: [each for each in rows if each.key not in finished])
    assert [record.size for record in FILE.read(path)[1]] == [0.0, 1.0, 2.0, 3.0]


def test_a_damaged_line_and_a_foreign_file_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    FILE.completed(path, dict.fromkeys(FILE.labels, "x"), lambda finished: [row(), row(size=80.0)])
    content = path.read_text()
    for damaged in ("my thesis\n", content.replace('"meshes"', '"mashes"'), content.replace("{", "[", 2), ""):
        path.write_text(damaged)
        with pytest.raises(RowFileError, match=r"rows\.jsonl: is not a complete file of the format 'bemkit-study 3'"):
            FILE.read(path)
    path.write_text(content.replace("bemkit-study 3", "bemkit-study 2"))
    with pytest.raises(RowFileError, match="has the format 'bemkit-study 2', not 'bemkit-study 3': delete it first"):
        FILE.read(path)
