"""Orders and Pareto fronts of rows."""

from __future__ import annotations

import csv
import dataclasses
import io
import math

import numpy as np
import pytest

from bemkit.studies.accuracy.records import (
    ErrorRecord,
    by_series,
    fitted_order,
    fitted_rate,
    orders,
    pareto_front,
    table_of,
)
from tests.studies.accuracy.records import row


def halving(order: float, *, meshes: str = "uniform") -> list[ErrorRecord]:
    sizes = (10, 20, 40, 80)
    return [row(meshes=meshes, size=float(n), elements=n, seconds=1e-4 * n**2, energy=3.0 * n**-order) for n in sizes]


def test_orders_between_meshes_and_over_the_last_ones() -> None:
    rows = halving(2.5)
    assert math.isnan(orders(rows, "energy")[0])
    np.testing.assert_allclose(orders(rows, "energy")[1:], 2.5)
    assert fitted_order(rows, "energy") == pytest.approx(2.5)
    bent = [dataclasses.replace(rows[0], energy=1e9), *rows[1:]]
    assert fitted_order(bent, "energy") == pytest.approx(2.5)  # the last three


def test_orders_that_cannot_be_told_are_nan() -> None:
    rows = halving(2.0)
    for wrong in (float("nan"), float("inf"), 0.0):
        rows[2] = dataclasses.replace(rows[2], energy=wrong)
        assert [math.isnan(value) for value in orders(rows, "energy")] == [True, False, True, True]
        assert math.isnan(fitted_order(rows, "energy"))
    same = [row(elements=10, energy=1.0), row(elements=10, energy=0.5)]  # two aims, one mesh
    assert math.isnan(fitted_order(same, "energy"))
    assert math.isnan(fitted_order(same[:1], "energy"))


def test_exponential_rates_are_told_from_orders() -> None:
    sizes = (40, 90, 160, 250)
    falling = [
        row(discretisation="hp", size=float(n), elements=n, unknowns=n, energy=float(np.exp(-0.8 * np.sqrt(n))))
        for n in sizes
    ]
    rate = fitted_rate(falling, "energy")
    assert rate.is_exponential
    assert rate.value == pytest.approx(0.8)
    assert str(rate) == "exp(-0.8√n)"
    # three meshes do not tell the two apart, nor does an order look exponential, nor can a fixed degree be
    fixed = [dataclasses.replace(record, discretisation="linear") for record in falling]
    assert not fitted_rate(fixed, "energy").is_exponential
    assert not fitted_rate(falling[1:], "energy").is_exponential
    assert str(fitted_rate(halving(2.5), "energy")) == "2.5"
    assert str(fitted_rate(falling[:1], "energy")) == "-"


def test_series_are_rows_that_differ_in_size() -> None:
    rows = [*halving(1.0), *halving(2.0, meshes="graded")]
    assert [len(series) for series in by_series(rows)] == [4, 4]


def test_the_front_is_what_nothing_beats() -> None:
    cheap, slow, exact, untimed, equal = (
        row(size=1.0, seconds=1.0, energy=1e-2),
        row(size=2.0, seconds=2.0, energy=2e-2),
        row(size=3.0, seconds=3.0, energy=1e-3),
        row(size=4.0, seconds=float("nan"), energy=1e-9),
        row(size=5.0, seconds=4.0, energy=1e-3 * (1.0 - 1e-9)),  # better by round-off alone
    )
    assert pareto_front([equal, exact, slow, untimed, cheap], "energy") == [cheap, exact]
    assert pareto_front([untimed], "energy") == []


def test_csv_holds_orders_and_marks() -> None:
    rows = [*halving(3.0), dataclasses.replace(halving(2.0, meshes="graded")[3], seconds=9.0)]
    text = table_of(rows).to_csv()
    assert text.startswith("discretisation,map,meshes,solver,size,")
    read = list(csv.DictReader(io.StringIO(text)))
    assert read[0]["order_energy"] == "nan"
    assert float(read[3]["order_energy"]) == pytest.approx(3.0)
    assert read[4]["order_energy"] == "nan"  # of another series
    assert [line["pareto_energy"] for line in read] == ["1", "1", "1", "1", "0"]
    assert [line["map"] for line in read] == ["Galerkin"] * 5
