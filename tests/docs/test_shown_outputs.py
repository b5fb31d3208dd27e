"""What the pages show as output is what their commands and code print."""

from __future__ import annotations

import re
import runpy
import shlex
from itertools import pairwise
from typing import Any

import pytest

from bemkit.cli.main import main
from tests.docs.pages import DOCS, OUTPUTS_SHOWN, blocks, read
from tests.slow import slow_only


def run_command(line: str) -> None:
    program, *arguments = shlex.split(line)
    if program == "python":
        runpy.run_path(str(DOCS.parent / arguments[0]), run_name="__main__")
        return
    assert program == "bemkit"
    with pytest.raises(SystemExit):
        main(arguments)


def matches(shown: str, printed: str) -> bool:
    """Compare line by line; a line ``...`` stands for any lines, ``...`` within a line for any rest of it."""
    pattern = ""
    for line in shown.strip().splitlines():
        inner = ".*".join(re.escape(" ".join(piece.split())) for piece in line.split("..."))
        pattern += r"(.*\n)*" if line.strip() == "..." else f" ?{inner.replace('.*', ' ?.*')} ?\n"
    squeezed = "".join(" ".join(line.split()) + "\n" for line in printed.strip().splitlines())
    return re.fullmatch(pattern, squeezed) is not None


def test_the_comparison_can_fail() -> None:
    assert matches("a  1\n...\nb ... c\n", "a 1\nx\ny\nb 2  c\n")
    assert matches("a\n...\n", "a\n")
    assert not matches("a 1\n...\nb\n", "a 2\nb\n")
    assert not matches("a\nb\n", "a\nx\nb\n")


# what these run has quick tests of its own
SLOW = [
    (page, OUTPUTS_SHOWN[page])
    for page in (
        "paper-tables.md",
        "tutorials/first-steps.md",
        "tutorials/several-bodies.md",
        "command-line.md",
        "verification.md",
    )
]


@pytest.mark.parametrize(("page", "fewest"), slow_only(OUTPUTS_SHOWN.items(), *SLOW))
@pytest.mark.usefixtures("here")
def test_shown_output(
    page: str, fewest: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Run the blocks in order; ``...`` stands for what depends on the machine."""
    monkeypatch.setenv("COLUMNS", "120")
    names: dict[str, Any] = {"__name__": "page"}
    n_checked = 0
    for (language, content), (next_language, shown) in pairwise([*blocks(read(page)), ("", "")]):
        if language == "python":
            exec(compile(content, page, "exec"), names)
        elif language == "sh":
            for line in content.splitlines():
                run_command(line)
        output = capsys.readouterr()
        if language in ("python", "sh") and next_language == "text":
            printed = output.out + output.err
            assert matches(shown, printed), printed
            n_checked += 1
    assert n_checked >= fewest
