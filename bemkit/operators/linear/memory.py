"""The memory of this computer."""

from __future__ import annotations

import os


def physical_memory() -> float:
    """Return the memory of this computer [bytes], infinite on systems that do not tell."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return float("inf")
