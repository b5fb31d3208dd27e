"""The process as its caller sees it: exit codes, and standard streams that may be closed or full, or lack letters."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, BinaryIO, TextIO

from bemkit.errors import BemkitError, NoResultError, printable

if TYPE_CHECKING:
    from bemkit.results.solution import Solution

NOT_CONVERGED = 1
"""Solved, but not converged; or a method that ends without a result."""
BAD_INPUT = 2
"""One line on standard error says what is wrong."""
INACCURATE = 3
"""Certified, but less accurate than asked for."""
INTERRUPTED, PIPE_CLOSED, TERMINATED = 130, 141, 143
"""Those of shells, 128 and the number of the signal."""

_CLOSED = io.TextIOWrapper(io.BytesIO())
_CLOSED.close()
_LINES = str.maketrans("─━╸╺│┃╷╵", "----||||")
"""ASCII replacements of the lines of tables and bars."""


def exit_code_of(solution: Solution) -> int:
    """Return the exit code of a command that solves, draws or reports one solution."""
    if solution.is_converged:
        return 0
    return INACCURATE if solution.is_certified else NOT_CONVERGED


def exit_code_of_error(error: BemkitError) -> int:
    """Return the exit code of a command that an error ends."""
    return NOT_CONVERGED if isinstance(error, NoResultError) else BAD_INPUT


def most_serious(codes: Iterable[int]) -> int:
    """Return the exit code of a command that did several things: bad input is more serious than no convergence."""
    return max(codes, key=(0, INACCURATE, NOT_CONVERGED, BAD_INPUT).index)


class StreamError(BemkitError):
    """Standard output that takes no text."""


class PipeClosedError(StreamError):
    """The reader of standard output, such as ``head``, has closed it."""


@contextmanager
def guarded_streams() -> Iterator[None]:
    """Replace the standard streams of the process by ones that fail with a name; see `GuardedStream`.

    Descriptors that the shell has closed are opened on nothing, or the next file to be opened would take their place.
    """
    _open_closed_descriptors()
    streams = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = GuardedStream(streams[0]), GuardedStream(streams[1], is_essential=False)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = streams


def print_data(text: str) -> None:
    """Write data to standard output, in UTF-8 for any encoding of the terminal."""
    stream = sys.stdout
    if isinstance(stream, GuardedStream):
        stream.write_data(text)
    else:
        stream.write(text)


def complain(message: str) -> None:
    """Write an error to standard error, its first line after the name of the program."""
    lines = [printable(line) for line in message.splitlines() if line.strip()]
    print("\n".join([f"bemkit: error: {lines[0] if lines else ''}", *lines[1:]]), file=sys.stderr)


class GuardedStream(io.TextIOBase):
    r"""A stream that shows letters which its encoding lacks as ``\xe9``, and whose failures have names.

    Parameters
    ----------
    stream : TextIO or None
        None if it was closed before the program began.
    is_essential : bool
        If not, unwritable text is dropped; the exit code still reports the failure.
    """

    def __init__(self, stream: TextIO | None, *, is_essential: bool = True) -> None:
        self._stream = stream
        self._is_essential = is_essential

    @property
    def encoding(self) -> str:  # type: ignore[override]  # the base class has an attribute that is never set
        """Encoding of the stream."""
        return getattr(self._stream, "encoding", None) or "utf-8"

    @property
    def buffer(self) -> BinaryIO | None:
        """The stream of bytes below, if there is one, to which click writes what shells complete commands with."""
        return getattr(self._stream, "buffer", None)

    def isatty(self) -> bool:
        """Whether a person looks at it."""
        return self._stream is not None and self._stream.isatty()

    def fileno(self) -> int:
        """Return the descriptor; OSError if there is none."""
        return super().fileno() if self._stream is None else self._stream.fileno()

    def writable(self) -> bool:
        """Return True."""
        return True

    def write(self, text: str) -> int:
        """Write a text.

        Raises
        ------
        StreamError
            If that fails on a stream that is essential.
        """
        with self._named_failures() as stream:
            try:
                stream.write(text)
            except UnicodeEncodeError:
                stream.write(text.translate(_LINES).encode(self.encoding, "backslashreplace").decode(self.encoding))
        return len(text)

    def write_data(self, text: str) -> None:
        """Write a text in UTF-8."""
        with self._named_failures() as stream:
            binary = getattr(stream, "buffer", None)
            if binary is None:
                stream.write(text)
            else:
                stream.flush()
                binary.write(text.encode("utf-8"))

    def flush(self) -> None:
        """Hand everything on to the system."""
        if self._stream is not None:
            with self._named_failures() as stream:
                stream.flush()

    def close(self) -> None:
        """Leave the stream open: it is not this object's own."""

    @contextmanager
    def _named_failures(self) -> Iterator[TextIO]:
        try:
            yield _CLOSED if self._stream is None else self._stream
        except (OSError, ValueError) as error:
            self._drop_rest()
            if not self._is_essential:
                return
            if isinstance(error, BrokenPipeError):
                raise PipeClosedError("standard output: the reader has closed the pipe") from None
            reason = getattr(error, "strerror", None) or error
            raise StreamError(f"standard output: cannot be written ({reason}): redirect it") from error

    def _drop_rest(self) -> None:
        """Discard the rest of the buffer, which the interpreter would fail to write at its end."""
        try:
            descriptor = self.fileno()
        except (OSError, ValueError):  # no file of the system
            return
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, descriptor)
        os.close(nowhere)


def _open_closed_descriptors() -> None:
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number, which is this one
