"""Plain texts, numbers and tables in HDF5 files, and a reader that trusts nothing."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from bemkit.arrays import FloatArray, IntArray
from bemkit.atomic_files import OutputFileError, check_target
from bemkit.errors import InputError, printable, shown_path
from bemkit.sealed_file import MARK, USER_BLOCK, created, sealed_content
from bemkit.version import __version__

if TYPE_CHECKING:
    import h5py

_MAX_TEXT = 10_000
_MAX_JSON = 10_000_000
_MAX_ENTRIES_PER_GROUP = 1000
_HDF5 = b"\x89HDF"


class ResultFileError(InputError):
    """A result file that cannot be read; one line with its name and the remedy."""


def write_array(group: h5py.Group, name: str, data: npt.NDArray[Any] | str | list[str]) -> None:
    """Write an array, a text or a list of texts as a dataset, in a third of the time that h5py takes."""
    from h5py import h5d, h5s

    if isinstance(data, str | list):
        data = _texts(data)
    space = h5s.create_simple(data.shape) if data.ndim else h5s.create(h5s.SCALAR)
    stored = _hdf5_type(data.dtype)
    h5d.create(group.id, name.encode(), stored, space).write(h5s.ALL, h5s.ALL, np.asarray(data, order="C"), stored)


def write_table(group: h5py.Group, name: str, columns: Mapping[str, Any]) -> None:
    """Write columns of numbers (arrays) and texts (lists of str) of one length as one dataset of rows."""
    arrays = {key: _texts(column) if isinstance(column, list) else column for key, column in columns.items()}
    kinds = [(key, np.int64 if column.dtype.kind == "i" else column.dtype) for key, column in arrays.items()]
    rows = np.empty(len(next(iter(arrays.values()))), dtype=kinds)
    for key, column in arrays.items():
        rows[key] = column
    write_array(group, name, rows)


def rows_of(columns: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of a table that a `Reader` has read, as plain texts and numbers."""
    plain = [column if isinstance(column, list) else column.tolist() for column in columns.values()]
    return [dict(zip(columns, values, strict=True)) for values in zip(*plain, strict=True)]


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
            self.mark(file)
            yield file

    def mark(self, file: h5py.File) -> None:
        """Write into a new file what it is, and what it was made with."""
        file.attrs.update({"format": self.name, "schema_version": self.version})
        file.create_group("provenance").attrs.update(provenance())

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
                    f"{self.version}: use the bemkit that wrote it, or solve the scene again"
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


def _texts(texts: str | list[str]) -> npt.NDArray[Any]:
    """Return texts as an array of bytes, or one text as an array without axes."""
    # fixed length: texts of variable length let a small hostile file expand without limit
    import h5py

    encoded = texts.encode("utf-8") if isinstance(texts, str) else [text.encode("utf-8") for text in texts]
    length = len(encoded) if isinstance(encoded, bytes) else max(map(len, encoded), default=0)
    return np.array(encoded, dtype=h5py.string_dtype("utf-8", max(length, 1)))


@cache
def _hdf5_type(dtype: np.dtype[Any]) -> Any:
    """Return the HDF5 type of an array, which takes longer to make than a small array to write."""
    from h5py import h5t

    return h5t.py_create(dtype, logical=1)


@contextmanager
def opened(path: Path, made_by: str = "bemkit run -o") -> Iterator[Reader]:
    """Open an HDF5 file, written by a command, for careful reading.

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
        with path.open("rb") as stream:
            block = stream.read(USER_BLOCK)
            if not block.startswith(MARK):
                kind = "an HDF5 file, but not of bemkit" if block.startswith(_HDF5) else broken
                raise ResultFileError(f"{name}: {kind}: {remedy}")
            content = sealed_content(block + stream.read())
        if content is None:
            damage = "its content does not match its checksum: the file is damaged, delete it and run its scene again"
            raise ResultFileError(f"{name}: {damage}")
        file = h5py.File(BytesIO(content), "r")
    except ResultFileError:
        raise
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, PermissionError) else broken
        raise ResultFileError(f"{name}: cannot be read ({reason}): {remedy}") from error
    with file:
        yield Reader(name, len(content), file)


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
        remedy = "" if ":" in problem else ": the file is damaged, delete it and run its scene again"
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

    def rows(self, path: str, n_rows: int) -> FloatArray:
        """Return an (n_rows, 2) array of floats."""
        array = self.floats(path)
        if array.shape != (n_rows, 2):
            raise self.error(f"{path} has the shape {array.shape}, not {(n_rows, 2)}")
        return array

    def integers(self, path: str) -> IntArray:
        """Return an array of integers."""
        return np.asarray(self._array(path, "i"), dtype=np.intp)

    def text(self, path: str, max_length: int = _MAX_TEXT) -> str:
        """Return a single text."""
        stored = self._array(path, "S")
        if stored.shape != () or stored.dtype.itemsize > max_length:
            raise self.error(f"{path} is not a text of at most {max_length} bytes")
        return self._decoded(path, stored.item())

    def names(self, group: str) -> tuple[str, ...]:
        """Return the names of what a group holds, sorted."""
        with self._named_failures(group):
            return tuple(sorted(self._follow(group)))

    def json(self, path: str, max_length: int = _MAX_JSON) -> Any:
        """Return what a text in JSON says, all texts in it printable.

        Raises
        ------
        ValueError
            If it is not JSON.
        """
        return _printable(json.loads(self.text(path, max_length)))

    def table(
        self, path: str, *, texts: Sequence[str] = (), floats: Sequence[str] = (), integers: Sequence[str] = ()
    ) -> dict[str, Any]:
        """Return the named columns of a table."""
        rows = self._array(path, "V")
        names = rows.dtype.names or ()
        for kind, wanted in (("S", texts), ("f", floats), ("i", integers)):
            for name in wanted:
                if name not in names:
                    raise self.error(f"column {name} of {path} is missing")
                if rows.ndim != 1 or rows.dtype[name].kind != kind:
                    raise self.error(f"column {name} of {path} holds {rows.dtype[name]}, not what belongs there")
        columns: dict[str, Any] = {
            name: [printable(self._decoded(f"{path}/{name}", item)) for item in rows[name].tolist()] for name in texts
        }
        columns |= {name: np.array(rows[name], dtype=np.float64) for name in floats}
        return columns | {name: np.array(rows[name], dtype=np.intp) for name in integers}

    def _decoded(self, path: str, stored: bytes) -> str:
        try:
            return stored.decode("utf-8")
        except UnicodeDecodeError as error:
            raise self.error(f"{path} is not UTF-8 text") from error

    def _array(self, path: str, kind: str) -> npt.NDArray[Any]:
        """Return an array of numbers of 8 bytes, of the kind "f" or "i", of texts, "S", or of rows of them, "V"."""
        import h5py

        found = self._follow(path)
        with self._named_failures(path):
            is_dataset = isinstance(found, h5py.Dataset)
            if not is_dataset or found.shape is None:
                raise self.error(f"{path} is not an array")
            # compressed, virtual or never written data take less room in the file than in memory
            if found.external is not None or found.nbytes > min(self._size, found.id.get_storage_size()):
                raise self.error(f"{path} is not stored plainly in the file")
            entries = [found.dtype[name] for name in found.dtype.names] if found.dtype.names else [found.dtype]
            is_plain = all(each.kind == "S" or (each.kind in "fi" and each.itemsize == 8) for each in entries)
            if found.dtype.kind != kind or not is_plain or found.ndim > 2:
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


def _printable(value: Any) -> Any:
    """Return what JSON can say with all its texts printable."""
    match value:
        case str():
            return printable(value)
        case list():
            return [_printable(each) for each in value]
        case dict():
            return {printable(name): _printable(each) for name, each in value.items()}
        case _:
            return value
