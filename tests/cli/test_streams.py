"""Standard streams that are closed, full or of a poor encoding end no command with a traceback."""

from __future__ import annotations

import contextlib
import io
import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import bemkit as bk
from bemkit.cli.process import GuardedStream, PipeClosedError, StreamError, guarded_streams, print_data
from bemkit.errors import printable
from tests.slow import slow_except

PROGRAM = [sys.executable, "-m", "bemkit"]
TITLE = "Würfel auf Ebene → 接触"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    text = (
        f'title = "{TITLE}"\nshape = {{ kind = "rectangle", width = 1.0, height = 1.0 }}\n'
        "material = { youngs_modulus = 1.0, poisson_ratio = 0.3 }\nmesh = { elements = 12 }\n"
        '[parts.floor]\nsides = ["bottom"]\ncondition = "clamped"\n'
        '[parts.load]\nsides = ["top"]\ncondition = { kind = "traction", y = -1.0 }\n'
    )
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())  # with a byte order mark
    return path


class Terminal(io.TextIOWrapper):
    """A stream that keeps its bytes, and may refuse some."""

    def __init__(self, encoding: str, error: OSError | None = None) -> None:
        super().__init__(io.BytesIO(), encoding=encoding, write_through=True)
        self.error = error

    def write(self, text: str) -> int:
        if self.error is not None:
            raise self.error
        return super().write(text)

    @property
    def shown(self) -> bytes:
        return self.buffer.getvalue()  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("encoding", "expected"),
    [("ascii", b"W\\xfcrfel \\u2192 -|"), ("cp1252", b"W\xfcrfel \\u2192 -|"), ("utf-8", "Würfel → ─│".encode())],
)
def test_letters_that_the_encoding_lacks_are_shown_as_codes(encoding: str, expected: bytes) -> None:
    terminal = Terminal(encoding)
    print("Würfel → ─│", end="", file=GuardedStream(terminal))
    assert terminal.shown == expected


def test_data_are_utf_8_in_any_encoding() -> None:
    terminal = Terminal("ascii")
    with contextlib.redirect_stdout(terminal):
        with guarded_streams():
            print_data("x = 'ü'")
        assert terminal.shown == "x = 'ü'".encode()
        assert sys.stdout is terminal


@pytest.mark.parametrize(
    ("stream", "kind", "message"),
    [
        (None, StreamError, r"standard output: cannot be written \(.*closed.*\): redirect it"),
        (Terminal("utf-8", OSError(28, "No space left")), StreamError, r"cannot be written \(No space left\)"),
        (Terminal("utf-8", BrokenPipeError()), PipeClosedError, "the reader has closed the pipe"),
    ],
)
def test_failures_have_names(stream: Terminal | None, kind: type[StreamError], message: str) -> None:
    with pytest.raises(kind, match=message):
        GuardedStream(stream).write("x")
    assert GuardedStream(stream, is_essential=False).write("x") == 1  # dropped


def test_printable() -> None:
    assert printable("a\nb\x1b[31m\u202eü") == "a b?[31m?ü"


@pytest.mark.slow
def test_a_scene_with_any_title_runs_in_a_poor_encoding(scene: Path) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    ran = subprocess.run([*PROGRAM, "run", scene, "-o", scene.parent / "r.h5"], capture_output=True, env=environment)
    assert (ran.returncode, ran.stderr) == (0, b"")
    assert b"\\u63a5\\u89e6" in ran.stdout
    for option, read in (("--json", json.loads), ("--scene", tomllib.loads)):
        place = ["-"] if option == "--json" else []
        shown = subprocess.run(
            [*PROGRAM, "show", scene.parent / "r.h5", option, *place], capture_output=True, env=environment
        )
        assert read(shown.stdout.decode("utf-8"))["title"] == TITLE


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = command.replace("bemkit", f"{sys.executable} -m bemkit", 1)
    return subprocess.run(["bash", "-c", command], capture_output=True, text=True, cwd=folder, env=environment)


def test_closed_streams_are_named_or_do_without(scene: Path) -> None:
    closed = shell("bemkit run scene.toml >&-", scene.parent)
    assert closed.returncode == 2
    assert closed.stderr.startswith("bemkit: error: standard output: cannot be written (")
    assert closed.stderr.count("\n") == 1
    quiet = shell("bemkit run scene.toml -q -o r.h5 >&- 2>&- <&-", scene.parent)
    assert (quiet.returncode, quiet.stdout, quiet.stderr) == (0, "", "")
    assert shell("bemkit run none.toml 2>&-", scene.parent).returncode == 2
    assert bk.read_result(scene.parent / "r.h5").is_converged  # nothing was printed into the file


@pytest.mark.parametrize(
    "command", slow_except(["scenes", "run scene.toml", "run scene.toml --json -", "--help"], "scenes", "--help")
)
def test_a_closed_pipe_ends_with_141(command: str, scene: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    arguments = [*PROGRAM, *command.split()]
    ran = subprocess.run(arguments, stdout=writing, stderr=subprocess.PIPE, cwd=scene.parent, env=environment)
    os.close(writing)
    assert (ran.returncode, ran.stderr) == (141, b"")
