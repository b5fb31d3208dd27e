"""The references of the paper's examples, made by bemkit, against finite elements that share nothing with it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import bemkit as bk
from bemkit.reference import Reference, find_reference
from tests.scenes import reference_data, reference_table


def stored(example: int) -> Reference:
    reference = find_reference(bk.load_scene(f"paper-{example}"))
    assert reference is not None
    return reference


@pytest.mark.parametrize("example", [1, 2])
def test_numbers_agree_to_what_finite_elements_claim(example: int) -> None:
    reference, data = stored(example), reference_data(example)
    (places,), answer = reference.places, reference.answer
    mine = {
        "energy": answer.energy,
        "Fn": answer.force_normal,
        "Ft": answer.force_tangential,
        "Mn": -places.weight @ (places.s * answer.sigma_n),
    }
    for name, value in mine.items():
        entry = data["scalars"][name]
        # their claims are differences to the mesh before; twice that, and the round-off of 14 digits
        assert abs(value - entry["value"]) <= 2.0 * entry["err"] + 1e-13 * abs(value), name
    for zone, entry in zip(answer.zones, data["transitions"], strict=True):
        assert abs(zone.s - entry["x"]) <= 2.0 * entry["err"]


@pytest.mark.parametrize("example", [1, 2])
def test_fields_agree_away_from_the_places_of_change(example: int) -> None:
    """Cubic splines through the table of finite elements, 3e-3 apart, are good to 1e-6 there."""
    reference, table = stored(example), reference_table(example)
    (places,) = reference.places
    distance = np.abs(places.s[:, None] - [*(zone.s for zone in reference.answer.zones), 0.0, table["x"][-1]]).min(1)
    away = distance > 0.03
    assert np.count_nonzero(away) > 20
    for name in ("u_n", "u_t", "sigma_n", "sigma_t"):
        theirs = CubicSpline(table["x"], table[name])(places.s[away])
        size = np.abs(table[name]).max()
        np.testing.assert_allclose(getattr(reference.answer, name)[away], theirs, rtol=0.0, atol=2e-6 * size)


@pytest.mark.parametrize("example", [1, 2])
def test_own_errors_are_small(example: int) -> None:
    own = stored(example).own_errors
    assert own["energy"] <= 1e-11
    assert max(own[name] for name in ("sigma_n", "sigma_t", "displacement", "transitions")) <= 2e-7
