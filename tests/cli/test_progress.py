"""What a person sees while a command computes, and that nobody else sees it."""

from __future__ import annotations

import io
import logging
import os
import re
import subprocess
import sys
from collections.abc import Iterator

import pytest
from rich.console import Console
from rich.progress import Progress

import bemkit as bk
from bemkit.cli.options import shown_progress
from bemkit.cli.progress import _Display, _PlannedBar, _TimeLeft, live_progress
from bemkit.scene.toml import with_overrides
from bemkit.stopwatch import PROGRESS, announce

pty = pytest.importorskip("pty")


def on_a_terminal(*arguments: str) -> str:
    """What a command shows on a terminal, without the codes that move the cursor."""
    own, other = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "100"}
    command = [sys.executable, "-m", "bemkit", *arguments]
    process = subprocess.Popen(command, stderr=other, stdout=subprocess.DEVNULL, stdin=other, env=environment)
    os.close(other)
    shown = b""
    while True:
        try:
            piece = os.read(own, 65536)
        except OSError:  # the other end is closed
            break
        if not piece:
            break
        shown += piece
    os.close(own)
    assert process.wait(timeout=60) == 0
    return re.sub(rb"\x1b\[[0-9;?]*[A-Za-z]", b"", shown).decode("utf-8", "replace")


@pytest.fixture
def heard() -> Iterator[list[str]]:
    """What a run announces."""
    messages: list[str] = []

    class Listener(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            messages.append(record.getMessage())

    listener = Listener()
    PROGRESS.addHandler(listener)
    PROGRESS.setLevel(logging.DEBUG)
    yield messages
    PROGRESS.removeHandler(listener)
    PROGRESS.setLevel(logging.NOTSET)


def test_a_run_announces_its_stages_in_their_order(heard: list[str]) -> None:
    bk.run(with_overrides(bk.load_scene("paper-1"), elements=24))
    stages = [message for number, message in enumerate(heard) if message not in heard[:number]]
    assert stages == ["mesh", "24 elements", "assemble", "condense", "solve", "recover"]


def test_each_mesh_is_announced_with_its_size(heard: list[str]) -> None:
    solution = bk.run(with_overrides(bk.load_scene("paper-1"), accuracy=0.01, discretisation="linear"))
    sizes = [message for message in heard if message.endswith(" elements")]
    assert len(sizes) > 1
    assert sizes[-1] == f"{solution.n_elements} elements"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run", "paper-1", "--elements", "24"), ("begin", "24 elements: solve, step 1", "step  solves")),
        pytest.param(
            ("plot", "paper-1", "--what", "traction"), ("begin", "320 elements: draw traction"), marks=pytest.mark.slow
        ),
    ],
)
@pytest.mark.usefixtures("here")
def test_a_terminal_shows_stage_and_step(arguments: tuple[str, ...], words: tuple[str, ...]) -> None:
    shown = on_a_terminal(*arguments)
    assert all(word in shown for word in words)


@pytest.mark.slow
def test_a_terminal_shows_nothing_if_asked_for_quiet() -> None:
    assert on_a_terminal("run", "paper-1", "--elements", "24", "-q") == ""


def test_the_bar_appears_before_anything_is_loaded() -> None:
    code = """
import sys
from bemkit.cli.options import shown_progress
sys.stderr.isatty = lambda: True
with shown_progress(False) as callback:
    print(callback is None, [name for name in ("scipy", "h5py", "matplotlib") if name in sys.modules])
with shown_progress(True) as callback:
    print(callback is None)
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.split() == ["False", "[]", "True"]


def test_no_command_loads_its_work_before_it_shows_that_it_begins() -> None:
    code = """
import sys
from importlib import import_module
from bemkit.cli.main import _COMMANDS
for module, _ in _COMMANDS.values():
    import_module(f"bemkit.cli.{module}")
print([name for name in ("numpy", "scipy", "h5py", "matplotlib", "rich.progress") if name in sys.modules])
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


@pytest.mark.parametrize(
    "arguments",
    [
        ("sweep", "paper-1", "--vary", "law.friction_coefficient=0.3,0.4", "--elements", "24", "--jobs", "1"),
        pytest.param(("verify", "--quick", "cattaneo-mindlin"), marks=pytest.mark.slow),
        pytest.param(("stability", "--axis", "load", "--elements", "24"), marks=pytest.mark.slow),
        pytest.param(
            ("study", "paper-1", "--sizes", "40", "--meshes", "uniform", "--discretisations", "constant"),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_study_shows_that_it_begins_and_then_its_tasks(arguments: tuple[str, ...]) -> None:
    shown = on_a_terminal(*arguments)
    assert shown.lstrip().startswith("begin")
    assert re.search(r"\d+/\d+", shown)


def test_nothing_is_shown_where_nobody_looks(capsys: pytest.CaptureFixture[str]) -> None:
    level = PROGRESS.level
    with shown_progress(quiet=False) as callback:
        assert callback is None
        announce("solve")
    with live_progress():
        assert PROGRESS.handlers
        print("data")
    assert (PROGRESS.handlers, PROGRESS.level) == ([], level)
    shown = capsys.readouterr()
    assert "solve" not in shown.err
    assert shown.out == "data\n"


def test_the_bar_follows_the_plan() -> None:
    """A planned run of 100 s after 25 s, and one that takes longer than planned."""
    console = Console(file=io.StringIO(), width=100)
    clock = [0.0]
    bar = Progress(_PlannedBar(), _TimeLeft(), console=console, get_time=lambda: clock[0])
    display = _Display(bar, console)
    (task,) = bar.tasks
    assert _TimeLeft().render(task).plain == ""  # no plan yet

    def planned(words: str, seconds: float) -> None:
        record = logging.LogRecord("bemkit.progress", logging.DEBUG, "", 0, words, (), None)
        record.seconds = seconds
        display.emit(record)

    planned("40 elements", 100.0)
    assert task.description == "40 elements: assemble"
    clock[0] += 25.0
    assert _TimeLeft().render(task).plain == "about 75 s left"
    assert _PlannedBar().render(task).completed == pytest.approx(25.0)
    clock[0] += 200.0
    assert _TimeLeft().render(task).plain == ""
    assert _PlannedBar().render(task).completed == pytest.approx(98.0)
    planned("80 elements", 10.0)
    assert task.description == "mesh 2, 80 elements: assemble"
