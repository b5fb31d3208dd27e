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
from bemkit.hdf5 import ResultFileError
from bemkit.studies.accuracy.records import FILE
from tests.studies.accuracy.records import row

ARGUMENTS = ("study", "paper-1", "--elements", "12,16,20", "--meshes", "uniform", "--discretisation", "linear")
STUDY = f"""
import sys
from bemkit.cli.main import main
main([*{ARGUMENTS}, "--repeat", "1", "-q", "-o", sys.argv[1]])
"""
WRITES_FOREVER = """
import sys
from bemkit.studies.accuracy.records import FILE
labels, rows = FILE.read(sys.argv[1])
print("ready", flush=True)
while True:
    FILE.write(sys.argv[1], labels, rows)
"""


@pytest.mark.slow
def test_a_killed_study_keeps_its_rows_and_goes_on_where_it_stopped(tmp_path: Path) -> None:
    path = tmp_path / "rows.h5"
    process = subprocess.Popen([sys.executable, "-c", STUDY, str(path)])
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline and process.poll() is None:
        with contextlib.suppress(ResultFileError):
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


@pytest.mark.slow
def test_a_process_killed_in_the_middle_of_a_write_leaves_a_whole_file(tmp_path: Path) -> None:
    path = tmp_path / "rows.h5"
    rows = tuple(row(size=float(n)) for n in range(200))
    FILE.write(path, dict.fromkeys(FILE.labels, "x"), rows)
    for delay in (0.0, 0.01):
        process = subprocess.Popen([sys.executable, "-c", WRITES_FOREVER, str(path)], stdout=subprocess.PIPE)
        assert process.stdout is not None
        assert process.stdout.readline() == b"ready\n"
        time.sleep(delay)
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        assert FILE.read(path)[1] == rows


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_truncated_rows_are_refused(tmp_path: Path, share: float) -> None:
    path = tmp_path / "rows.h5"
    FILE.write(path, dict.fromkeys(FILE.labels, "x"), [row()])
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(ResultFileError, match=r"rows\.h5: .*: "):
        FILE.read(path)
