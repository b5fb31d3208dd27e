"""Tables of named columns with units, and the forms they are written in."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from bemkit.errors import InputError

if TYPE_CHECKING:
    from bemkit.hdf5 import FileFormat


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Parameters
    ----------
    name : str
    unit : str
        SI unit; empty for texts, counts and ratios.
    meaning : str
    format : str
        Of numbers where people read them; files hold all digits. Empty for texts and counts.
    """

    name: str
    unit: str = ""
    meaning: str = ""
    format: str = ""

    def cell(self, value: Any) -> str:
        """Return a value as people read it, a number that is not finite as an empty text."""
        if isinstance(value, float):
            return format(value, self.format) if math.isfinite(value) else ""
        return str(value)


def column(meaning: str, unit: str = "", format: str = "") -> Any:
    """Return a field of a dataclass whose instances are rows of a table; see `Column`."""
    return field(metadata={"meaning": meaning, "unit": unit, "format": format})


def columns_of(record: type) -> tuple[Column, ...]:
    """Return the columns that the fields of a dataclass describe by `column`."""
    return tuple(Column(entry.name, **entry.metadata) for entry in fields(record) if "meaning" in entry.metadata)


@dataclass(frozen=True)
class Table:
    """Columns and rows of values.

    Parameters
    ----------
    columns : tuple of Column
    rows : tuple of tuples
        Numbers and texts, one for each column.
    """

    columns: tuple[Column, ...]
    rows: tuple[tuple[Any, ...], ...]

    def __repr__(self) -> str:
        """Return one line; the rows may be thousands."""
        return f"Table({len(self.rows)} rows: {', '.join(self.names)})"

    def __str__(self) -> str:
        """Return the table as Markdown."""
        return self.to_markdown()

    @classmethod
    def from_records(cls, record: type, records: Iterable[Any]) -> Self:
        """Return the table of instances of a dataclass; see `column`."""
        columns = columns_of(record)
        return cls(columns, tuple(tuple(getattr(each, head.name) for head in columns) for each in records))

    @classmethod
    def from_arrays(cls, columns: Sequence[Column], arrays: Mapping[str, Any]) -> Self:
        """Return the table of columns of equal lengths, by name."""
        import numpy as np

        values = (np.asarray(arrays[head.name]).tolist() for head in columns)
        return cls(tuple(columns), tuple(zip(*values, strict=True)))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(head.name for head in self.columns)

    def values(self, name: str) -> tuple[Any, ...]:
        """Return the values of a column."""
        index = self.names.index(name)
        return tuple(row[index] for row in self.rows)

    def as_dicts(self) -> list[dict[str, Any]]:
        """Return each row by the names of the columns."""
        return [dict(zip(self.names, row, strict=True)) for row in self.rows]

    def cells(self) -> list[list[str]]:
        """Return the rows as people read them."""
        return [[head.cell(value) for head, value in zip(self.columns, row, strict=True)] for row in self.rows]

    def to_csv(self) -> str:
        """Return comma-separated values with a line of names, all digits of numbers."""
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(self.names)
        writer.writerows(self.rows)
        return stream.getvalue()

    def to_json(self) -> str:
        """Return a list of JSON objects, null for numbers that are not finite."""
        return json_text(self.as_dicts())

    def to_markdown(self) -> str:
        """Return a Markdown table, numbers to the right."""
        heads = [f"{head.name} [{head.unit}]" if head.unit else head.name for head in self.columns]
        return markdown_table(heads, self.cells(), [bool(head.format) for head in self.columns])

    def to_hdf5(self, path: str | Path) -> None:
        """Write a dataset for each column, with its unit and meaning as attributes."""
        from bemkit.hdf5 import write_array

        with table_format().created(path) as file:
            for head in self.columns:
                write_array(file, head.name, _array(self.values(head.name)))
                file[head.name].attrs.update({"unit": head.unit, "meaning": head.meaning})

    def to_pandas(self) -> Any:
        """Return a pandas DataFrame.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError:
            raise InputError('data frames need pandas: pip install "bemkit[pandas]"') from None
        return pd.DataFrame(self.as_dicts(), columns=list(self.names))


def table_format() -> FileFormat:
    """Return the format of tables in HDF5 files."""
    from bemkit.hdf5 import FileFormat  # h5py only where it is needed

    return FileFormat("bemkit-table", 1, "bemkit table", "-o FILE.h5")


def markdown_table(heads: Sequence[str], rows: Iterable[Sequence[str]], is_number: Sequence[bool]) -> str:
    """Return a Markdown table; vertical bars in cells are escaped."""
    lines = [heads, ["---:" if right else "---" for right in is_number], *rows]
    escaped = ([cell.replace("|", "\\|") for cell in line] for line in lines)
    return "".join(f"| {' | '.join(line)} |\n" for line in escaped)


def json_text(content: Any) -> str:
    """Return a content as JSON, null for numbers that are not finite."""
    return json.dumps(finite_only(content), indent=2, allow_nan=False) + "\n"


def finite_only(value: Any) -> Any:
    """Return tables, lists and numbers as JSON can hold them: numbers that are not finite become None."""
    if isinstance(value, Mapping):
        return {key: finite_only(item) for key, item in value.items()}
    if isinstance(value, str):
        return value
    if isinstance(value, Iterable):
        return [finite_only(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _array(values: Sequence[Any]) -> Any:
    """Return numbers as an array, texts as a list."""
    if any(isinstance(value, str) for value in values):
        return list(map(str, values))
    import numpy as np

    return np.array(values)
