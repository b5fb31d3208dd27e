"""Settings shared by all tests."""

from __future__ import annotations

import os

from hypothesis import HealthCheck, settings

# quick runs repeat the same examples everywhere; BEMKIT_HYPOTHESIS=thorough searches ten times as many new ones
settings.register_profile("quick", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("thorough", deadline=None, max_examples=1000, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile(os.environ.get("BEMKIT_HYPOTHESIS", "quick"))
