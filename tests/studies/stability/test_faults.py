"""Faults of the machine: killed processes, full disks, damaged files. What was finished stays readable."""

from __future__ import annotations

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import pytest

import bemkit as bk
from bemkit.hdf5 import ResultFileError
from bemkit.results.result_file import read_result, write_result
from bemkit.studies.row_file import RowFileError
from bemkit.studies.stability.records import FILE, StabilityRecord
from tests.scenes import small_paper_scene
from tests.slow import slow_except

LABELS = {"scene": "title = 'x'\n"}
ROW = StabilityRecord("friction", 0.1, "right", "converged", 4, 1e-16, 1e-16, 1e-3, 1e2, 0.0, 1e-12, 0.1, "")

WRITES_FOREVER = """
import sys
from bemkit.results.result_file import read_result, write_result
solution = read_result(sys.argv[1])
print("ready", flush=True)
while True:
    write_result(sys.argv[1], solution)
"""

SWEEPS = """
import sys
from bemkit.cli.main import main
axes = [word for axis in sys.argv[2:] for word in ("--axis", axis)]
main(["stability", "paper-1", "--elements", "16", *axes, "-q", "-o", sys.argv[1]])
"""


@pytest.fixture(scope="module")
def solution() -> bk.Solution:
    return bk.run(small_paper_scene(1, 32))


@pytest.fixture
def result(tmp_path: Path, solution: bk.Solution) -> Path:
    path = tmp_path / "result.h5"
    write_result(path, solution)
    return path


def kill_while_writing(path: Path, delays: list[float]) -> None:
    """Kill a process that writes a result over and over, each time after another delay, and read what is left."""
    expected = read_result(path).energy
    for delay in delays:
        process = subprocess.Popen([sys.executable, "-c", WRITES_FOREVER, str(path)], stdout=subprocess.PIPE)
        assert process.stdout is not None
        assert process.stdout.readline() == b"ready\n"
        time.sleep(delay)
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        assert read_result(path).energy == expected


def test_a_process_killed_while_writing_leaves_a_whole_result(result: Path) -> None:
    kill_while_writing(result, [random.Random(k).uniform(0.0, 0.1) for k in range(1)])


@pytest.mark.slow
def test_a_hundred_kills_leave_a_whole_result(result: Path) -> None:
    kill_while_writing(result, [random.Random(k).uniform(0.0, 0.2) for k in range(100)])


def test_rests_of_a_killed_process_do_not_hinder_the_next(result: Path, solution: bk.Solution) -> None:
    (result.parent / ".result.h5.0123.tmp").write_bytes(b"half a file")
    write_result(result, solution)
    assert read_result(result).is_converged


FILLS_THE_DISK = """
import resource, signal, sys
from pathlib import Path
from bemkit.atomic_files import OutputFileError
from bemkit.results.result_file import read_result, write_result
solution = read_result(sys.argv[1])
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
try:
    write_result(sys.argv[1], solution)
except OutputFileError as error:
    print(error)
"""


@pytest.mark.parametrize("n_bytes", slow_except([0, 512, 4096, 20_000], 4096))
def test_a_full_disk_leaves_the_old_result_and_one_clear_line(result: Path, n_bytes: int) -> None:
    # in a process of its own: the HDF5 library may not recover inside the one that saw the failure
    assert result.stat().st_size > 20_000
    program = [sys.executable, "-c", FILLS_THE_DISK, str(result), str(n_bytes)]
    done = subprocess.run(program, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "result.h5: cannot be written" in done.stdout
    assert "choose another place" in done.stdout
    assert len(done.stdout.splitlines()) == 1
    assert read_result(result).is_converged
    assert os.listdir(result.parent) == ["result.h5"]


def test_any_flipped_bit_is_noticed(result: Path) -> None:
    expected = read_result(result).contact.sigma_n
    content = result.read_bytes()
    chooser = random.Random(7)
    complaints: list[str] = []
    for _ in range(60):
        damaged = bytearray(content)
        damaged[chooser.randrange(len(content))] ^= 1 << chooser.randrange(8)
        result.write_bytes(damaged)
        try:
            found = read_result(result).contact.sigma_n
        except ResultFileError as error:
            complaints.append(str(error))
        else:  # unused bytes between the objects of the file
            assert (found == expected).all()
    assert len(complaints) >= 10
    assert all(": " in line and "\n" not in line for line in complaints)


def test_a_changed_number_is_noticed(result: Path) -> None:
    with h5py.File(result, "r+") as file:
        table = file["last/contact"][()]
        table["sigma_n"][3] *= 1.0 + 1e-15
        file["last/contact"][...] = table
    with pytest.raises(
        ResultFileError, match="does not match its checksum: the file is damaged, delete it and run its scene again"
    ):
        read_result(result)


def sweep_process(path: Path, axes: tuple[str, ...]) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", SWEEPS, str(path), *axes])


@pytest.mark.parametrize(
    ("axes", "n_kills", "n_rows"),
    [
        pytest.param(("sliding",), 1, 11, marks=pytest.mark.slow),
        pytest.param(("friction", "sliding"), 2, 24, marks=pytest.mark.slow),
    ],
)
def test_a_killed_sweep_keeps_its_rows_and_goes_on_where_it_stopped(
    tmp_path: Path, axes: tuple[str, ...], n_kills: int, n_rows: int
) -> None:
    path = tmp_path / "rows.jsonl"
    n_before = 0
    for _ in range(n_kills):
        process = sweep_process(path, axes)
        deadline = time.monotonic() + 30.0
        while time.monotonic() < deadline and process.poll() is None:
            with contextlib.suppress(RowFileError):
                if len(FILE.read(path)[1]) > n_before:
                    break
            time.sleep(0.05)
        process.send_signal(signal.SIGKILL)
        process.wait()
        rows = FILE.read(path)[1]
        assert len(rows) > n_before
        n_before = len(rows)
    finished = FILE.read(path)[1]
    assert sweep_process(path, axes).wait() == 0
    after = FILE.read(path)[1]
    assert len(after) == n_rows
    # equal to the run times: finished rows are taken over, not computed again
    assert after[: len(finished)] == finished or any("nan" in repr(row) for row in finished)


@pytest.mark.slow
def test_a_load_history_that_is_killed_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    runs = [
        sys.executable,
        "-c",
        "from bemkit.cli.main import main; main()",
        "run",
        "friction-loop",
        "--elements",
        "40",
    ]
    whole, killed = tmp_path / "whole.h5", tmp_path / "killed.h5"
    subprocess.run([*runs, "-q", "-o", str(whole)], check=True)
    process = subprocess.Popen([*runs, "-q", "-o", str(killed)])
    while process.poll() is None and not killed.exists():
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    part = read_result(killed)
    assert part.status is bk.Status.UNFINISHED
    assert part.loading is not None
    assert 0 < len(part.loading.steps) < part.loading.n_steps
    subprocess.run([*runs, "-q", "-o", str(killed)], check=True)
    with h5py.File(whole) as one, h5py.File(killed) as other:
        names: list[str] = []
        one.visit(names.append)
        arrays = [name for name in names if isinstance(one[name], h5py.Dataset)]
        assert len(arrays) > 60
        for name in arrays:
            if name.endswith("outcome"):
                entries, others = (json.loads(file[name][()]) | {"timings": None} for file in (one, other))
                assert entries == others, name
            else:
                assert one[name][()].tobytes() == other[name][()].tobytes(), name
