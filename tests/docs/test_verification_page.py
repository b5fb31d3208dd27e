"""docs/verification.md and its tables list every row that ``bemkit verify`` has, and all of them were met."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping

import pytest

from bemkit.studies.verification.case import Case
from bemkit.studies.verification.cases import CASES
from tests.docs.pages import DOCS, Row, read, section, table


def rows_of(name: str) -> list[Row]:
    """Return the rows of a table beside the page, without its head."""
    with (DOCS / "tables" / name).open(newline="") as stream:
        return list(csv.reader(stream))[1:]


ROWS, VALIDITIES = rows_of("verification.csv"), rows_of("verification-cases.csv")


@pytest.fixture(scope="module")
def cases() -> Mapping[str, Case]:
    return {name: make() for name, make in CASES.items()}


@pytest.mark.slow
def test_all_rows_are_listed_with_their_sources(cases: Mapping[str, Case]) -> None:
    listed = [(row[0], row[1], row[2]) for row in ROWS]
    rows = [(name, quantity.name, case.source) for name, case in cases.items() for quantity in case.quantities]
    assert listed == rows


@pytest.mark.slow
def test_all_rows_were_met_within_the_bounds_of_today(cases: Mapping[str, Case]) -> None:
    bounds = {(name, each.name): each.bounds for name, case in cases.items() for each in case.quantities}
    for name, quantity, _, _, errors, _, bound, met in ROWS:
        assert met == "yes"
        assert all(float(e) <= b for e, b in zip(errors.split(), bounds[name, quantity], strict=True))
        assert float(bound) == bounds[name, quantity][-1]


@pytest.mark.slow
def test_what_each_case_holds_for_is_said(cases: Mapping[str, Case]) -> None:
    said = VALIDITIES
    assert [row[0] for row in said] == list(CASES)
    assert [row[2] for row in said] == [case.validity for case in cases.values()]


def test_the_summary_names_every_case_once() -> None:
    results = section(read("verification.md"), "Results")
    assert sorted(re.findall(r"`([^`]+)`", " ".join(row[1] for row in table(results)))) == sorted(CASES)
    assert f"All {len(ROWS)} rows of {len(CASES)} cases" in results


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CASES))
def test_every_case_says_where_its_answer_comes_from(name: str, cases: Mapping[str, Case]) -> None:
    case = cases[name]
    assert f"`[{case.source}]`" in read("references.md")
    assert 2 <= len(case.resolutions) <= 3
    assert 1 <= case.n_quick <= 2
    assert case.validity
    coarse_to_fine = sorted(case.resolutions, reverse=case.resolutions[0] < 1.0)
    assert list(case.resolutions) == coarse_to_fine
