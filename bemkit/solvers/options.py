"""Range checks of the options that drivers share."""

import math

from bemkit.errors import InputError


def check_rho(name: str, rho: float | None) -> None:
    """Raise ValueError unless `rho` is None (automatic) or a positive finite number."""
    if rho is not None and not (math.isfinite(rho) and rho > 0.0):
        raise InputError(f"{name} = {rho}; give a positive number, or leave it out for the automatic choice")


def check_max_steps(max_steps: int) -> None:
    """Raise ValueError unless `max_steps` is positive."""
    if max_steps < 1:
        raise InputError(f"max_steps = {max_steps}; allow at least one step")


def check_count(name: str, count: int) -> None:
    """Raise ValueError if `count` is negative."""
    if count < 0:
        raise InputError(f"{name} = {count}; give zero or a positive number")
