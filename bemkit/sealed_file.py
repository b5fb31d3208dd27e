"""HDF5 files with a checksum before their content, which can be read while they grow, even after a crash.

A file begins with a user block, which HDF5 programs pass over: a mark, the SHA-256 of the HDF5 content in hexadecimal
digits, and its length in bytes. While a file grows, changes follow the content, each with its own checksum.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import closing, contextmanager
from io import BytesIO, FileIO
from pathlib import Path
from struct import Struct
from typing import TYPE_CHECKING, Any

from bemkit.atomic_files import named_failures, replacing

if TYPE_CHECKING:
    import h5py

USER_BLOCK = 512
"""Bytes before the HDF5 content."""
MARK = b"bemkit result or rows\n"
"""First line of the user block."""
_DIGEST, _LENGTH = 32, Struct("<Q")
_HEADER = _DIGEST + _LENGTH.size
"""Before changes: their SHA-256, and their length in bytes."""
_CHANGE = Struct("<QQ")
"""Before each of them: where its bytes belong, and how many they are."""


class _LoggedBytes(BytesIO):
    """A file in memory that remembers what was written where."""

    def __init__(self) -> None:
        super().__init__()
        self.changes: list[tuple[int, bytes]] = []

    def write(self, data: Any) -> int:
        self.changes.append((self.tell(), bytes(data)))
        return super().write(data)


class GrowingFile:
    """An HDF5 file that grows in memory, and on the disk change by change, so that it can be read after a crash.

    The first `commit` replaces the target by a sealed file. Each later one appends the bytes that have changed since,
    with their checksum. `opened` applies them in their order, and ignores one that was cut off. `finish` replaces the
    target by the whole, without changes after it.

    Parameters
    ----------
    target : Path
    """

    def __init__(self, target: Path) -> None:
        import h5py

        self._target, self._image = target, _LoggedBytes()
        self._stream: FileIO | None = None
        self.file = h5py.File(self._image, "w", userblock_size=USER_BLOCK)

    def commit(self) -> None:
        """Bring the file on the disk up to date.

        Raises
        ------
        OutputFileError
            If the system refuses.
        """
        self.file.flush()
        if self._stream is None:
            self._write_whole()
            self._stream = FileIO(self._target, "ab")
        else:
            payload = b"".join(_CHANGE.pack(start, len(data)) + data for start, data in self._image.changes)
            with named_failures(self._target):
                self._stream.write(hashlib.sha256(payload).digest() + _LENGTH.pack(len(payload)) + payload)
        self._image.changes.clear()

    def finish(self) -> None:
        """Replace the target by the whole file.

        Raises
        ------
        OutputFileError
            If the system refuses.
        """
        self.file.flush()
        self._write_whole()

    def close(self) -> None:
        """Let go of the file."""
        self.file.close()
        if self._stream is not None:
            self._stream.close()

    def _write_whole(self) -> None:
        content = self._image.getvalue()[USER_BLOCK:].ljust(self.file.id.get_filesize() - USER_BLOCK, b"\0")
        with replacing(self._target) as temporary:
            temporary.write_bytes(user_block(content) + content)


@contextmanager
def created(target: Path) -> Iterator[h5py.File]:
    """Give an empty HDF5 file that replaces the target, with a checksum of its content, if all goes well.

    It is built in memory and written at the end: the HDF5 library itself does not survive a disk that runs full.

    Raises
    ------
    OutputFileError
        If the system refuses.
    """
    with closing(GrowingFile(target)) as growing:
        yield growing.file
        growing.finish()


def user_block(content: bytes) -> bytes:
    """Return the block before HDF5 content."""
    digest = hashlib.sha256(content).hexdigest()
    return (MARK + f"{digest}\n{len(content)}".encode()).ljust(USER_BLOCK, b"\0")


def sealed_content(stored: bytes) -> bytes | None:
    """Return the content of a file with all changes that follow it; None if it does not match its checksum."""
    digest, _, length = stored[len(MARK) : USER_BLOCK].rstrip(b"\0").partition(b"\n")
    end = USER_BLOCK + int(length) if length.isdigit() else len(stored)  # older layouts do not state the length
    if hashlib.sha256(stored[USER_BLOCK:end]).hexdigest().encode() != digest:
        return None
    content = bytearray(stored[:end])
    while payload := _next_changes(stored, end):
        start = 0
        while start < len(payload):
            offset, size = _CHANGE.unpack_from(payload, start)
            start += _CHANGE.size + size
            if offset > 2 * len(stored):  # between changes lie at most a few bytes that nobody wrote
                return None
            content.extend(bytes(max(offset - len(content), 0)))
            content[offset : offset + size] = payload[start - size : start]
        end += _HEADER + len(payload)
    return bytes(content)


def _next_changes(stored: bytes, start: int) -> bytes:
    """Return the changes that begin at an offset, nothing if they were cut off."""
    digest, payload_start = stored[start : start + _DIGEST], start + _HEADER
    if len(stored) < payload_start:
        return b""
    (size,) = _LENGTH.unpack_from(stored, start + _DIGEST)
    payload = stored[payload_start : payload_start + size]
    return payload if hashlib.sha256(payload).digest() == digest else b""
