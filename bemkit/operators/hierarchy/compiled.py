"""The closed forms of `element_fields` compiled by numba, if the extra ``fast`` is installed and works.

The modules beside this one that import numba are imported only where `functions` says that it works. Compiling takes
some seconds, once for an installation: numba keeps the result on disk.
"""

from __future__ import annotations

import importlib.util
import os
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np

from bemkit.errors import printable
from bemkit.operators.stopwatch import announce

_MISSING = "not installed: the kernels run in numpy; pip install 'bemkit[fast]' compiles them"


def is_installed() -> bool:
    """Whether numba is installed; that it works shows when `functions` loads it."""
    return importlib.util.find_spec("numba") is not None


def why() -> str:
    """Say in one line whether the compiled kernels are used, and if not, why."""
    return _loaded()[1]


def expected() -> tuple[bool, str]:
    """Say, without loading numba or compiling anything, whether a run will use the compiled kernels, and why."""
    return (True, "numba is installed") if is_installed() else (False, _MISSING)


def functions() -> ModuleType | None:
    """Return the module `compiled_fields`, None if numpy has to do."""
    return _loaded()[0]


@cache
def _loaded() -> tuple[ModuleType | None, str]:
    if not is_installed():
        return None, _MISSING
    try:
        from bemkit.operators.hierarchy import compiled_fields

        if not is_cached(compiled_fields.__name__):
            announce("compile kernels, once for this installation")
        point, start, one = np.array([0.5 + 1.0j]), np.array([0.0j]), np.ones(1, complex)
        values = compiled_fields.applied(
            np.array([1.0, 1.0, 0.3, 1.0]), point, np.array([-1]), start, start + 1.0, one, one, one
        )
        if not np.isfinite(values).all():
            return None, "numba computes wrong numbers here: the kernels run in numpy"
    except Exception as error:  # whatever a broken installation raises
        return None, f"numba does not work here ({_short(error)}): the kernels run in numpy"
    return compiled_fields, "numba is installed"


def is_cached(module: str) -> bool:
    """Whether numba has kept what it compiled of a module, beside it or where its settings say."""
    spec = importlib.util.find_spec(module)
    source = Path(str(spec and spec.origin))
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or source.parent / "__pycache__")
    return any(folder.rglob(f"{source.stem}.*.nbi"))


def _short(error: Exception) -> str:
    return printable(f"{type(error).__name__}: {error}")[:120]
