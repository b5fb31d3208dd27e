"""What the pages show as output is what their commands and code print."""

from __future__ import annotations

import shlex
from doctest import ELLIPSIS, NORMALIZE_WHITESPACE, OutputChecker
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from bemkit.cli import main
from tests.docs.pages import blocks, read


def run_command(line: str) -> None:
    program, *arguments = shlex.split(line)
    assert program == "bemkit"
    with pytest.raises(SystemExit):
        main(arguments)


@pytest.mark.parametrize("page", ["tutorials/first-steps.md", "command-line.md"])
def test_shown_output(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Run the blocks in order; ``...`` stands for what depends on the machine."""
    monkeypatch.chdir(tmp_path)
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
            assert OutputChecker().check_output(shown, printed, ELLIPSIS | NORMALIZE_WHITESPACE), printed
            n_checked += 1
    assert n_checked >= 4
