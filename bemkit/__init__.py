"""Frictional contact of elastic bodies by boundary elements.

>>> import bemkit
>>> bemkit.run(bemkit.load_scene("paper-1")).status.name
'CONVERGED'

The names in ``__init__.pyi`` are imported when they are first used, so that importing bemkit costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import Any

from bemkit.version import __version__ as __version__

_LINES = __spec__.loader.get_data(f"{__path__[0]}/__init__.pyi").decode("utf-8").splitlines()
_WORDS = [line.split() for line in _LINES if line.startswith("from bemkit.")]  # from MODULE import NAME as NAME
_MODULE_OF = {name: module for _, module, _, name, *_ in _WORDS if name != "__version__"}

__all__ = sorted(_MODULE_OF)


def __getattr__(name: str) -> Any:
    """Import a public name on first use."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'bemkit' has no attribute {name!r}")
    value = getattr(importlib.import_module(_MODULE_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
