"""Checks that implementations, ours and yours, keep the promises of bemkit's protocols."""

from bemkit.testing.laws import check_law

__all__ = ["check_law"]
