"""Processes beside each other: two that write one file, and workers whose parent is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from itertools import product
from pathlib import Path

import pytest

from bemkit.cli.main import main
from tests.slow import slow_except

pytestmark = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="looks for processes in /proc")
ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}


def start(folder: Path, *arguments: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-m", "bemkit", *arguments], cwd=folder, env=ENVIRONMENT)


def wait_until(is_so: Callable[[], bool], seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def children_of(process: int) -> set[int]:
    listed = [
        int(child) for path in Path(f"/proc/{process}/task").glob("*/children") for child in path.read_text().split()
    ]
    return set(listed).union(*map(children_of, listed))


def is_alive(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.mark.usefixtures("here")
def test_the_second_of_two_runs_into_one_file_is_refused_before_it_computes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = start(tmp_path, "run", "paper-1", "--elements", "3000", "-q", "-o", "r.h5")
    try:
        wait_until(Path(".r.h5.lock").exists)
        with pytest.raises(SystemExit, match="2"):
            main(["run", "paper-1", "--elements", "40", "-o", "r.h5"])
        assert "r.h5: another process will write this file" in capsys.readouterr().err
        assert first.poll() is None  # it had work to do all the while
    finally:
        first.kill()
        first.wait()
    Path(f".r.h5.{'0' * 32}.tmp").write_text("half")
    with pytest.raises(SystemExit, match="0"):
        main(["run", "paper-1", "--elements", "40", "-q", "-o", "r.h5"])
    assert os.listdir() == ["r.h5"]


@pytest.mark.parametrize(
    ("end", "is_at_work"),
    slow_except(product((signal.SIGKILL, signal.SIGTERM), (False, True)), (signal.SIGKILL, True)),
)
def test_workers_end_with_a_study_that_is_killed(tmp_path: Path, end: signal.Signals, is_at_work: bool) -> None:
    """Workers look for work in a queue of which they hold both ends: they would wait for more for ever."""
    large = "1600,1800"  # nobody waits for them
    sizes = ("--sizes", f"40,60,{large}" if is_at_work else large, "--meshes", "uniform")
    choice = ("--solvers", "semismooth-newton", "--discretisations", "linear", "--jobs", "2")
    study = start(tmp_path, "study", "paper-1", *sizes, *choice, "-q", "-o", "rows.jsonl")
    try:
        wait_until(lambda: len(children_of(study.pid)) >= 3)  # two workers and the tracker of their resources
        wait_until(lambda: not is_at_work or (tmp_path / "rows.jsonl").exists())
        workers = children_of(study.pid)
    finally:
        study.send_signal(end)
        study.wait()
    assert len(workers) >= 3
    try:
        wait_until(lambda: not any(map(is_alive, workers)), 30.0)
    finally:
        for worker in filter(is_alive, workers):
            os.kill(worker, signal.SIGKILL)
