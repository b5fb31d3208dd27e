"""Plain texts, numbers and tables in HDF5 files, and a reader that trusts nothing."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from io import BufferedRandom, BufferedReader
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from bemkit.arrays import FloatArray, IntArray
from bemkit.atomic_files import OutputFileError, check_target, replacing
from bemkit.errors import InputError, printable, shown_path
from bemkit.version import __version__

if TYPE_CHECKING:
    import h5py

_MAX_TEXT = 10_000
_MAX_ENTRIES_PER_GROUP = 1000
_HDF5 = b"\x89HDF"
USER_BLOCK = 512
"""Bytes before the HDF5 content, which HDF5 programs pass over."""
MARK = b"bemkit result or rows\n"
"""First line of the user block; the second is the SHA-256 of the HDF5 content in hexadecimal digits."""


class ResultFileError(InputError):
    """A result file that cannot be read; one line with its name and the remedy."""


def write_text(group: h5py.Group, name: str, text: str) -> None:
    """Write a text of any length as a scalar dataset of fixed size."""
    group.create_dataset(name, data=np.array(text.encode("utf-8"), dtype=_text_type([text])))


def write_table(group: h5py.Group, columns: Mapping[str, Any]) -> None:
    """Write columns of numbers (arrays) and texts (lists of str), one dataset each."""
    for name, column in columns.items():
        if isinstance(column, list):
            data = np.array([text.encode("utf-8") for text in column], dtype=_text_type(column))
        else:
            data = column.astype(np.int64) if column.dtype.kind == "i" else column
        group.create_dataset(name, data=data)


def rows_of(columns: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of a table that a `Reader` has read, as plain texts and numbers."""
    plain = [column if isinstance(column, list) else column.tolist() for column in columns.values()]
    return [dict(zip(columns, values, strict=True)) for values in zip(*plain, strict=True)]


@contextmanager
def created(target: Path, mark: bytes = MARK) -> Iterator[h5py.File]:
    """Give an empty HDF5 file that replaces the target, with a checksum of its content, if all goes well.

    It is built in memory and written at the end: the HDF5 library itself does not survive a disk that runs full.

    Raises
    ------
    OutputFileError
        If the system refuses.
    """
    import h5py

    with replacing(target) as temporary:
        with h5py.File(
            str(temporary), "w", userblock_size=USER_BLOCK, locking=False, driver="core", backing_store=False
        ) as file:
            yield file
            file.flush()
            image = file.id.get_file_image()
        temporary.write_bytes(bytes(USER_BLOCK) + image)  # the image begins after the user block
        seal(temporary, mark)


def seal(path: Path, mark: bytes) -> None:
    """Write the mark and the checksum of the HDF5 content of a file into the user block before it."""
    with path.open("r+b") as stream:
        stream.write(_user_block(stream, mark))


def checksum_in(path: Path) -> str:
    """Return the checksum of a sealed file, empty if there is no such file; see `opened` for its proof."""
    try:
        with path.open("rb") as stream:
            block = stream.read(USER_BLOCK)
    except OSError:
        return ""
    return block[len(MARK) :].rstrip(b"\0").decode("ascii", "replace") if block.startswith(MARK) else ""


def _user_block(stream: BufferedReader | BufferedRandom, mark: bytes) -> bytes:
    """Return what the block before the HDF5 content must be, and go back to the beginning of the file."""
    stream.seek(USER_BLOCK)
    digest = hashlib.file_digest(stream, "sha256").hexdigest()
    stream.seek(0)
    return (mark + digest.encode()).ljust(USER_BLOCK, b"\0")


@dataclass(frozen=True)
class FileFormat:
    """A kind of HDF5 files, which say what they are, which layout they have, and what they were made with.

    Parameters
    ----------
    name : str
        Mark by which such files are recognised.
    version : int
        Of the layout.
    kind, command : str
        For messages: "bemkit result", and what writes such files.
    """

    name: str
    version: int
    kind: str
    command: str

    def check_target(self, path: str | Path) -> Path:
        """Find out, before any work is done, whether a file can be written, in place of one of its kind or of none."""
        target = check_target(Path(path))
        if target.exists() and not self._is_own(target):
            raise OutputFileError(
                f"{shown_path(Path(path))}: exists and is not a {self.kind}: choose another name or delete it first"
            )
        return target

    @contextmanager
    def created(self, path: str | Path) -> Iterator[h5py.File]:
        """Give a marked file that replaces one of its kind at once or not at all.

        Raises
        ------
        OutputFileError
            If the file cannot be written, or a file of another kind has its name.
        """
        with created(self.check_target(path)) as file:
            file.attrs.update({"format": self.name, "schema_version": self.version})
            file.create_group("provenance").attrs.update(provenance())
            yield file

    @contextmanager
    def opened(self, path: str | Path) -> Iterator[Reader]:
        """Open a file of this kind for careful reading; see `opened`.

        Raises
        ------
        ResultFileError
            If the file is not a complete file of this kind and version.
        """
        with opened(Path(path), made_by=self.command) as reader:
            marks = reader.attributes("/")
            if marks.get("format") != self.name:
                remedy = f"give a file written by '{self.command}', or choose another name"
                raise reader.error(f"an HDF5 file, but not a {self.kind}: {remedy}")
            if marks.get("schema_version") != self.version:
                raise reader.error(
                    f"has layout version {marks.get('schema_version')}, this bemkit {__version__} reads version "
                    f"{self.version}: use the bemkit that wrote it, or write it anew"
                )
            yield reader

    def _is_own(self, path: Path) -> bool:
        try:
            with self.opened(path):
                return True
        except ResultFileError:
            return False


def provenance() -> dict[str, str]:
    """Return the versions and the platform that a result depends on, and the time; no names of people or folders."""
    return {
        "bemkit": __version__,
        "python": platform.python_version(),
        **_versions(),
        "platform": f"{platform.system()} {platform.machine()}",
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }


@cache
def _versions() -> dict[str, str]:
    """Return the versions of libraries, whose metadata take milliseconds to read."""
    return {name: version(name) for name in ("numpy", "scipy", "h5py")}


def _text_type(texts: Sequence[str]) -> np.dtype[Any]:
    # fixed length: texts of variable length let a small hostile file expand without limit
    import h5py

    length = max([1, *(len(text.encode("utf-8")) for text in texts)])
    dtype: np.dtype[Any] = h5py.string_dtype("utf-8", length)
    return dtype


@contextmanager
def opened(path: Path, made_by: str = "bemkit run -o", mark: bytes = MARK) -> Iterator[Reader]:
    """Open an HDF5 file, written by a command under a mark, for careful reading.

    Raises
    ------
    ResultFileError
        If the file is missing, unreadable, not one of bemkit, or not as it was written.

    Notes
    -----
    The HDF5 library may crash or never come back on a damaged file, or be busy for long with a huge one. It is handed
    nothing but content that matches its checksum.
    """
    import h5py

    name, remedy = shown_path(path), f"give a file written by '{made_by}'"
    broken = "not an HDF5 file, or a broken one"
    try:
        if not path.is_file():
            raise ResultFileError(f"{name}: {'not a file' if path.exists() else 'no such file'}: {remedy}")
        size = path.stat().st_size
        with path.open("rb") as stream:
            block = stream.read(USER_BLOCK)
            if not block.startswith(mark):
                kind = "an HDF5 file, but not of bemkit" if block.startswith(_HDF5) else broken
                raise ResultFileError(f"{name}: {kind}: {remedy}")
            if block != _user_block(stream, mark):
                damage = "its content does not match its checksum: the file is damaged, run its scene again"
                raise ResultFileError(f"{name}: {damage}")
        file = h5py.File(str(path), "r", locking=False)  # files are replaced as a whole, never changed
    except ResultFileError:
        raise
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, PermissionError) else broken
        raise ResultFileError(f"{name}: cannot be read ({reason}): {remedy}") from error
    with file:
        yield Reader(name, size, file)


class Reader:
    """Reads what a bemkit result may contain, and nothing else.

    Accepted are hard links to plain datasets stored in this very file, never larger than the file itself: no links
    to other files, no compression, no texts of variable length outside single attributes.

    Parameters
    ----------
    name : str
        Of the file, for messages.
    size : int [bytes]
        Of the file.
    file : h5py.File
    """

    def __init__(self, name: str, size: int, file: h5py.File) -> None:
        self._name = name
        self._size = size
        self._file: Any = file

    def error(self, problem: str) -> ResultFileError:
        """Return an error that names the file."""
        remedy = "" if ":" in problem else ": the file is damaged, run its scene again"
        return ResultFileError(f"{self._name}: {problem}{remedy}".replace("\n", " "))

    def attributes(self, group: str) -> dict[str, Any]:
        """Return the texts and numbers attached to a group."""
        import h5py

        found = self._follow(group)
        if not isinstance(found, h5py.Group):
            raise self.error(f"{group} is not a group")
        with self._named_failures(f"attributes of {group}"):
            if len(found.attrs) > _MAX_ENTRIES_PER_GROUP:
                raise self.error(f"too many attributes in {group}")
            for name in found.attrs:
                stored = found.attrs.get_id(name)
                is_text = h5py.check_string_dtype(stored.dtype) is not None
                if stored.shape != () or not (is_text or stored.dtype.kind in "if"):
                    raise self.error(f"attribute {name!r} of {group} is not a single text or number")
            return {name: _plain(value) for name, value in found.attrs.items()}

    def has(self, path: str) -> bool:
        """Whether there is something at a path."""
        with self._named_failures(path):
            return path in self._file

    def floats(self, path: str) -> FloatArray:
        """Return an array of floats."""
        return np.asarray(self._array(path, "f"), dtype=np.float64)

    def integers(self, path: str) -> IntArray:
        """Return an array of integers."""
        return np.asarray(self._array(path, "i"), dtype=np.intp)

    def text(self, path: str, max_length: int = _MAX_TEXT) -> str:
        """Return a single text."""
        stored = self._array(path, "S")
        if stored.shape != () or stored.dtype.itemsize > max_length:
            raise self.error(f"{path} is not a text of at most {max_length} bytes")
        return self._decoded(path, stored.item())

    def texts(self, path: str) -> tuple[str, ...]:
        """Return a list of texts; none if there is no such list."""
        if not self.has(path):
            return ()
        return tuple(self._decoded(path, item) for item in self._array(path, "S").ravel().tolist())

    def table(
        self, group: str, *, texts: Sequence[str] = (), floats: Sequence[str] = (), integers: Sequence[str] = ()
    ) -> dict[str, Any]:
        """Return the named columns of a table, all of one length."""
        columns: dict[str, Any] = {}
        for name in texts:
            stored = self._array(f"{group}/{name}", "S")
            columns[name] = [printable(self._decoded(f"{group}/{name}", item)) for item in stored.ravel().tolist()]
        columns |= {name: self.floats(f"{group}/{name}") for name in floats}
        columns |= {name: self.integers(f"{group}/{name}") for name in integers}
        if len({len(column) for column in columns.values()}) > 1:
            raise self.error(f"the columns of {group} differ in length")
        return columns

    def _decoded(self, path: str, stored: bytes) -> str:
        try:
            return stored.decode("utf-8")
        except UnicodeDecodeError as error:
            raise self.error(f"{path} is not UTF-8 text") from error

    def _array(self, path: str, kind: str) -> npt.NDArray[Any]:
        """Return an array of numbers of 8 bytes, of the kind "f" or "i", or of texts, of the kind "S"."""
        import h5py

        found = self._follow(path)
        with self._named_failures(path):
            is_dataset = isinstance(found, h5py.Dataset)
            if not is_dataset or found.shape is None:
                raise self.error(f"{path} is not an array")
            # compressed, virtual or never written data take less room in the file than in memory
            if found.external is not None or found.nbytes > min(self._size, found.id.get_storage_size()):
                raise self.error(f"{path} is not stored plainly in the file")
            if found.dtype.kind != kind or (kind != "S" and found.dtype.itemsize != 8) or found.ndim > 2:
                raise self.error(f"{path} holds {found.ndim}-dimensional {found.dtype}, not what belongs there")
            return np.asarray(found[()])

    def _follow(self, path: str) -> Any:
        """Return the object at a path, through hard links only."""
        import h5py

        found: Any = self._file
        with self._named_failures(path):
            for name in filter(None, path.split("/")):
                is_group = isinstance(found, h5py.Group)
                if not is_group or type(found.get(name, getlink=True)).__name__ != "HardLink":
                    raise self.error(f"{path} is missing")
                found = found[name]
        return found

    @contextmanager
    def _named_failures(self, what: str) -> Iterator[None]:
        try:
            yield
        except (OSError, RuntimeError, KeyError, TypeError, MemoryError, UnicodeDecodeError) as error:
            raise self.error(f"{what} cannot be read") from error


def _plain(value: Any) -> Any:
    """Return an attribute as a printable text or a number of Python."""
    if isinstance(value, str):
        return printable(value[:_MAX_TEXT])
    return value.item() if hasattr(value, "item") else value
