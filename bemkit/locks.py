"""Locks on files, which the system drops when their holder ends, however it ends."""

from __future__ import annotations

import os
from pathlib import Path

from bemkit.errors import BemkitError

try:
    import fcntl
except ImportError:  # not a system of the Unix family
    fcntl = None  # type: ignore[assignment]


class HeldElsewhereError(BemkitError, OSError):
    """Another process holds the lock."""


class FileLock:
    """A file, made if need be, that no other process locks until it is closed or this process ends.

    Where the system or its network drive knows no locks, every process gets its lock, and `is_sure` is false.

    Parameters
    ----------
    path : Path
    may_create : bool
    waits : bool
        Wait until a holder closes it, instead of raising.

    Raises
    ------
    HeldElsewhereError
        If another process, or another lock of this one, holds it.
    OSError
        If the file cannot be opened or made.
    """

    def __init__(self, path: Path, *, may_create: bool = True, waits: bool = False) -> None:
        while True:
            self._descriptor = os.open(path, os.O_RDWR | (os.O_CREAT if may_create else 0), 0o666)
            try:
                self.is_sure = _lock(self._descriptor, waits)
            except OSError:
                self.close()
                raise
            if _is_same(self._descriptor, path):
                return
            self.close()  # its holder removed the file between the two calls

    def close(self) -> None:
        """Let others have the lock."""
        os.close(self._descriptor)


def _lock(descriptor: int, waits: bool) -> bool:
    if fcntl is None:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
    except BlockingIOError as error:
        raise HeldElsewhereError("another process holds the lock: wait for it to end") from error
    except OSError:  # the file system knows no locks
        return False
    return True


def _is_same(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False
