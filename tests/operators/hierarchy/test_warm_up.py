"""Compiling all kernels at once."""

from __future__ import annotations

import logging

import pytest
from click.testing import CliRunner

from bemkit.cli.main import commands
from bemkit.errors import InputError
from bemkit.operators.hierarchy import compiled
from bemkit.operators.hierarchy.warm_up import warm_up


def test_all_kernels_are_compiled_and_kept() -> None:
    pytest.importorskip("numba")
    assert [ready.what for ready in warm_up()] == ["straight elements", "curved elements", "Galerkin's method"]
    assert all(ready.was_kept for ready in warm_up())
    result = CliRunner().invoke(commands, ["warm-up"])
    assert result.exit_code == 0
    assert "kernels for straight elements: kept from before" in result.output


def test_what_cannot_be_compiled_is_an_error_that_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(compiled, "is_installed", lambda: False)
        patch.setattr(compiled, "why", lambda: compiled._MISSING)
        with pytest.raises(InputError, match=r"nothing to compile: numba is not installed.*bemkit\[fast\]"):
            list(warm_up())
    pytest.importorskip("numba")
    monkeypatch.setattr(compiled, "functions", lambda: None)
    monkeypatch.setattr(compiled, "why", lambda: "numba does not work here (no LLVM): the kernels run in numpy")
    with pytest.raises(InputError, match="nothing to compile: numba does not work here"):
        list(warm_up())


@pytest.mark.parametrize("was_kept", [True, False])
def test_the_first_use_in_a_fresh_installation_says_that_it_compiles(
    was_kept: bool, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    pytest.importorskip("numba")
    monkeypatch.setattr(compiled, "is_cached", lambda module: was_kept)
    compiled._loaded.cache_clear()
    with caplog.at_level(logging.DEBUG, "bemkit.progress"):
        assert compiled.functions() is not None
    said = [record.getMessage() for record in caplog.records]
    assert ("compile kernels, once for this installation" in said) is not was_kept
