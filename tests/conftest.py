"""Settings shared by all tests."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable, Generator, Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# quick runs repeat the same few examples everywhere, runs of slow tests too repeat more;
# BEMKIT_HYPOTHESIS=thorough searches ten times as many new ones
COMMON = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("quick", COMMON, derandomize=True, max_examples=12)
settings.register_profile("full", COMMON, derandomize=True, max_examples=100)
settings.register_profile("thorough", COMMON, max_examples=1000)


def pytest_configure(config: pytest.Config) -> None:
    """Choose how many random examples there are before tests are read."""
    is_quick = config.option.markexpr == "not slow"
    settings.load_profile(os.environ.get("BEMKIT_HYPOTHESIS", "quick" if is_quick else "full"))


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect no garbage while tests are read, and less often than by default while they run."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.set_threshold(10_000, 20, 20)
        gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """Spread a run of all tests over the processors, file by file, so that a file's fixtures are made once.

    Some tests or `pytest -n 0` run in one process.
    """
    is_everything = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    is_worker = "PYTEST_XDIST_WORKER" in os.environ
    if not is_everything or is_worker or not config.pluginmanager.hasplugin("xdist"):
        return
    if config.option.numprocesses is None:
        config.option.numprocesses, config.option.dist = "auto", "loadfile"
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
            os.environ.setdefault(name, "1")  # one process for each processor, not two


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def undrawn() -> Iterator[None]:
    """Write blank pictures."""
    from tests.blank_pictures import blank_pictures

    with blank_pictures():
        yield


@pytest.fixture
def without(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Return a function that makes packages, by their names, look as if they were not installed."""

    def hide(*packages: str) -> None:
        for package in packages:
            monkeypatch.setitem(sys.modules, package, None)

    return hide


@pytest.fixture
def memory(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Return a function that gives the computer another amount of memory [bytes]."""
    of_system = os.sysconf

    def change(amount: float) -> None:
        page = of_system("SC_PAGE_SIZE")
        values = {"SC_PHYS_PAGES": amount / page}
        monkeypatch.setattr(os, "sysconf", lambda name: values.get(name) or of_system(name))

    return change


@pytest.fixture
def compiled_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compile the layer of collocation for bodies of any size, if numba is installed."""
    pytest.importorskip("numba")
    monkeypatch.setattr("bemkit.operators.collocation.compiled.MANY_ELEMENTS", 0)
