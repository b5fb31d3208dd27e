"""Settings shared by all tests."""

from __future__ import annotations

import os

import pytest
from hypothesis import HealthCheck, settings

# quick runs repeat the same examples everywhere; BEMKIT_HYPOTHESIS=thorough searches ten times as many new ones
settings.register_profile("quick", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("thorough", deadline=None, max_examples=1000, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile(os.environ.get("BEMKIT_HYPOTHESIS", "quick"))


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """Spread a run of all tests over the processors, file by file, so that a file's fixtures are made once."""
    is_worker = "PYTEST_XDIST_WORKER" in os.environ
    is_everything = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    if config.pluginmanager.hasplugin("xdist") and is_everything and not is_worker:
        if config.option.numprocesses is None:
            config.option.numprocesses, config.option.dist = "auto", "loadfile"
