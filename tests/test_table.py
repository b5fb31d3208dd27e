"""Tables: every form has the same columns and rows."""

from __future__ import annotations

import json
from dataclasses import dataclass

import pytest

from bemkit.errors import InputError
from bemkit.table import Table, column


@dataclass(frozen=True)
class Row:
    name: str = column("a | name")
    force: float = column("its force", "N/m", ".2g")
    solves: int = column("number of solves")


TABLE = Table.from_records(Row, [Row("a|b", 1.25, 3), Row("c", float("nan"), 4)])


def test_csv_and_json_hold_all_digits() -> None:
    assert TABLE.to_csv() == "name,force,solves\na|b,1.25,3\nc,nan,4\n"
    rows = json.loads(TABLE.to_json())
    assert rows == [{"name": "a|b", "force": 1.25, "solves": 3}, {"name": "c", "force": None, "solves": 4}]


def test_markdown_has_units_short_numbers_and_escaped_bars() -> None:
    lines = TABLE.to_markdown().splitlines()
    assert lines[0] == "| name | force [N/m] | solves |"
    assert lines[1] == "| --- | ---: | --- |"
    assert lines[2:] == ["| a\\|b | 1.2 | 3 |", "| c |  | 4 |"]


def test_values_of_a_column() -> None:
    assert TABLE.values("solves") == (3, 4)
    assert [head.unit for head in TABLE.columns] == ["", "N/m", ""]


def test_a_data_frame_without_pandas_names_the_extra(without) -> None:
    without("pandas")
    with pytest.raises(InputError, match=r'data frames need pandas: pip install "bemkit\[pandas\]"'):
        TABLE.to_pandas()
