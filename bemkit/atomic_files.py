"""Writing files so that a reader never meets half of one, and locks, which the system drops when their holder ends."""

from __future__ import annotations

import contextlib
import glob
import os
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from bemkit.errors import BemkitError, shown_path

try:
    import fcntl
except ImportError:  # not a system of the Unix family
    fcntl = None  # type: ignore[assignment]


FILE_ENDINGS = frozenset(
    f".{ending}"
    for ending in "csv json md jsonl h5 hdf5 npz vtu toml html txt png svg pdf jpg jpeg eps ps tif tiff gif mp4".split()
)
"""Endings of files that bemkit reads or writes, and of pictures."""


class OutputFileError(BemkitError, OSError):
    """A file that cannot be written; one line with its name and the remedy."""


def check_target(path: Path) -> Path:
    """Find out, before any work is done, whether a file can be written.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Path
        The path with symbolic links resolved.

    Raises
    ------
    OutputFileError
        If the folder does not exist or cannot be written to, or the path names something that is not a file.
    """
    try:
        target = path.resolve()
        folder = target.parent
        exists, is_file = target.exists(), target.is_file()
    except (OSError, ValueError) as error:
        raise OutputFileError(f"{shown_path(path)}: not a usable file name ({error}): choose another") from error
    if not folder.is_dir():
        raise OutputFileError(f"{shown_path(path)}: the folder {shown_path(folder)} does not exist: create it first")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputFileError(
            f"{shown_path(path)}: no permission to write in {shown_path(folder)}: choose another folder"
        )
    if exists and not is_file:
        raise OutputFileError(f"{shown_path(path)}: exists and is not a file: choose another name")
    return target


@contextmanager
def replacing(target: Path) -> Iterator[Path]:
    """Give the name of a temporary file in the same folder, which replaces the target if all goes well.

    Yields
    ------
    Path
        An empty file. It is removed again if the body of the ``with`` statement raises anything, an interrupt
        included; the target is then untouched. What a process that was killed in here left behind is removed by the
        next one: the system has dropped its lock on the temporary file.

    Raises
    ------
    OutputFileError
        If the system refuses, for example because the disk is full.
    """
    _remove_leftovers(target)
    temporary = hidden_beside(target, f"{uuid.uuid4().hex}.tmp")
    try:
        with named_failures(target), contextlib.closing(FileLock(temporary, waits=True)):
            yield temporary
            with temporary.open("r+b") as stream:
                os.fsync(stream.fileno())  # the content is on the disk before the name points to it
            os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def named_failures(target: Path) -> Iterator[None]:
    """Turn errors of the system into one line with the name of the file and the remedy.

    Raises
    ------
    OutputFileError
        If the system refuses.
    """
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputFileError(f"{shown_path(target)}: cannot be written ({reason}): choose another place") from error


def write_text(path: Path, text: str) -> None:
    """Write a text to a file, all or nothing."""
    with replacing(path.resolve()) as temporary:
        temporary.write_text(text, encoding="utf-8")


@contextmanager
def reserved(targets: Iterable[Path]) -> Iterator[None]:
    """Keep files, from `check_target`, for this process while it computes what it will write to them.

    Raises
    ------
    OutputFileError
        If another process has reserved one of them, or the system refuses.
    """
    with contextlib.ExitStack() as stack:
        for target in targets:
            stack.enter_context(_reserved(target))
        yield


@contextmanager
def _reserved(target: Path) -> Iterator[None]:
    path = hidden_beside(target, "lock")
    try:
        lock = FileLock(path)
    except HeldElsewhereError as error:
        raise OutputFileError(
            f"{shown_path(target)}: another process will write this file: wait for it to end, or choose another name"
        ) from error
    except OSError as error:
        raise OutputFileError(f"{shown_path(target)}: cannot be written ({error.strerror}): choose another") from error
    with contextlib.closing(lock):
        _remove_leftovers(target)
        try:
            yield
        finally:
            if path.stat().st_size == 0:  # otherwise it is not a lock of ours
                path.unlink()


def hidden_beside(target: Path, ending: str) -> Path:
    """Return the name of a hidden file that goes with another one."""
    return target.with_name(f".{target.name[:100]}.{ending}")


def _remove_leftovers(target: Path) -> None:
    """Remove temporary files of the target that no living process holds."""
    name = glob.escape(hidden_beside(target, "").name)
    for path in target.parent.glob(f"{name}{'[0-9a-f]' * 32}.tmp"):
        with contextlib.suppress(OSError), contextlib.closing(FileLock(path, may_create=False)) as lock:
            if lock.is_sure:
                path.unlink()


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
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(self._descriptor), path.stat()):
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
