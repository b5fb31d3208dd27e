"""The table of a sweep: its columns and formats."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.formulas import closest
from bemkit.scene.scene import Scene
from bemkit.scene.toml import scene_from_toml
from bemkit.studies.sweep.records import COLUMNS, FILE, NUMBERS, SweepRow, unit_of_column
from bemkit.table import Column, Table, json_text


@dataclass(frozen=True)
class Sweep:
    """Result of `bemkit.sweep` and of ``bemkit sweep -o``.

    Parameters
    ----------
    scene : Scene
        The scene that all rows share.
    keys : tuple of str
        Keys of the varied numbers.
    rows : tuple of SweepRow
        All combinations of values, that of the first key changing last.
    """

    scene: Scene = field(repr=False)
    keys: tuple[str, ...]
    rows: tuple[SweepRow, ...]

    def __repr__(self) -> str:
        """Return one line."""
        failed = f", {len(self.failed)} of them failed" if self.failed else ""
        return f"Sweep({self.scene.title!r} over {', '.join(self.keys)}: {len(self.rows)} rows{failed})"

    @classmethod
    def read(cls, path: str | Path) -> Sweep:
        """Read a file of ``bemkit sweep -o``, written by any sweeps of the scene over these keys.

        Raises
        ------
        RowFileError
            If the file is not a complete file of this kind and version.
        """
        labels, rows = FILE.read(path)
        ordered = sorted(rows, key=lambda row: row.values)
        return cls(scene_from_toml(labels["scene"], name=str(path)), tuple(json.loads(labels["keys"])), tuple(ordered))

    @property
    def solved(self) -> tuple[SweepRow, ...]:
        """The rows whose results are certified."""
        return tuple(row for row in self.rows if row.is_certified)

    @property
    def failed(self) -> tuple[SweepRow, ...]:
        """The rows without a certified result; their status and message say why."""
        return tuple(row for row in self.rows if not row.is_certified)

    def column(self, name: str) -> FloatArray:
        """Return the numbers (n_solved,) of a key or a result, in the order of `solved`.

        Raises
        ------
        InputError
            If there is no such column of numbers.
        """
        names = [*self.keys, *NUMBERS]
        if name not in names:
            raise InputError(f"column {name!r}: the columns of numbers are {', '.join(names)}{closest(name, names)}")
        return np.array([self.entry(row, name) for row in self.solved], dtype=float)

    def entry(self, row: SweepRow, name: str) -> Any:
        """Return the entry of a row under a key or the name of a result."""
        return row.values[self.keys.index(name)] if name in self.keys else getattr(row, name)

    def as_table(self) -> Table:
        """Return all rows with the keys in front; numbers of failed rows are nan."""
        units = self.scene.result_units
        results = [replace(head, unit=unit_of_column(head.name, units)) for head in COLUMNS.values()]
        keys = [Column(key, "", "varied", "g") for key in self.keys]
        rows = ((*row.values, *(getattr(row, name) for name in COLUMNS)) for row in self.rows)
        return Table((*keys, *results), tuple(rows))

    def columns(self) -> dict[str, Any]:
        """Return the keys and all results of the solved rows: arrays of numbers, lists of texts."""
        numbers = {name: self.column(name) for name in (*self.keys, *NUMBERS)}
        return numbers | {name: [getattr(row, name) for row in self.solved] for name in COLUMNS if name not in NUMBERS}

    def to_csv(self) -> str:
        """Return all rows as comma-separated values; numbers of failed rows are nan."""
        return self.as_table().to_csv()

    def to_json(self) -> str:
        """Return one JSON object: title, keys, solved rows and, apart from them, failed ones."""
        solved = [self._as_dict(row, COLUMNS) for row in self.solved]
        failed = [self._as_dict(row, ("status", "message", "seconds")) for row in self.failed]
        content = {"title": self.scene.title, "keys": self.keys, "rows": solved, "failed": failed}
        return json_text(content)

    def as_pandas(self) -> Any:
        """Return the solved rows as a pandas DataFrame.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        return replace(self, rows=self.solved).as_table().to_pandas()

    def as_xarray(self) -> Any:
        """Return the numbers as an xarray Dataset with a dimension for each key; nan where a row failed or is missing.

        Raises
        ------
        InputError
            If xarray is not installed.
        """
        try:
            import xarray as xr
        except ImportError:
            raise InputError('data sets need xarray: pip install "bemkit[pandas]"') from None
        axes = [np.unique([self.entry(row, key) for row in self.rows]) for key in self.keys]
        places = tuple(np.searchsorted(axis, self.column(key)) for axis, key in zip(axes, self.keys, strict=True))
        data = {}
        for name in NUMBERS:
            values = np.full([axis.size for axis in axes], np.nan)
            values[places] = self.column(name)
            data[name] = (self.keys, values, {"units": unit_of_column(name, self.scene.result_units)})
        return xr.Dataset(data, coords=dict(zip(self.keys, axes, strict=True)), attrs={"title": self.scene.title})

    def _as_dict(self, row: SweepRow, names: Iterable[str]) -> dict[str, Any]:
        return dict(zip(self.keys, row.values, strict=True)) | {name: getattr(row, name) for name in names}
