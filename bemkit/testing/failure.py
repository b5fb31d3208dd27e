"""How a conformance check fails: with an exception of its own, so that `python -O` disables nothing."""

from __future__ import annotations

from bemkit.errors import BemkitError


class CheckFailed(BemkitError, AssertionError):  # noqa: N818 - it reads as what happened, and pytest shows it as a failed test
    """An implementation breaks a promise of its protocol; the message names the promise and by how much."""


def demand(is_kept: bool, message: str) -> None:
    """Raise `CheckFailed` with the message unless a promise is kept."""
    if not is_kept:
        raise CheckFailed(message)
