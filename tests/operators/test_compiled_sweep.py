"""The choice of compiled loops for dense matrices, and their integrals beside those of numpy."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.geometry import Disk, Rectangle, Shape, discretise
from bemkit.operators.compiled_sweep import CompiledSweep, sweep_over, why
from bemkit.operators.hierarchy import compiled
from bemkit.operators.hierarchy.element_pairs import ElementPairs
from bemkit.operators.integrals.pairs import Degrees
from bemkit.operators.integrals.sweep import PairSweep

QUADRATIC = Degrees(log=(1, 1), double=(1, 2))


@pytest.mark.parametrize(("shape", "p"), [(Rectangle(2.0, 1.0), 1), (Rectangle(2.0, 1.0), 2), (Disk(1.0), 2)])
def test_both_sweeps_have_the_same_integrals(shape: Shape, p: int) -> None:
    mesh = discretise(shape.outline(), n_elements=140).unit
    degrees, everything = Degrees(log=(p - 1, p - 1), double=(p - 1, p)), np.arange(mesh.n_elements)
    own, other = CompiledSweep(ElementPairs.of(mesh, p), everything, everything), PairSweep(mesh, degrees)
    chunks = list(own.row_slices([7]))
    assert chunks[0].stop == 7
    assert chunks[-1].stop == mesh.n_elements
    size = mesh.lengths.max() ** 2
    for rows in chunks:
        one, two = own.chunk(rows), other.chunk(rows)
        # Gauss rules on both elements: 7e-14 for each, by the distance between elements that stand inside its bounds
        np.testing.assert_allclose(one.log, two.log, atol=2e-13 * size, rtol=0.0)
        np.testing.assert_allclose(one.quotient, two.quotient, atol=2e-13 * size, rtol=0.0)
        np.testing.assert_allclose(one.double, two.double, atol=2e-13 * size / mesh.lengths.min(), rtol=0.0)


def test_the_reason_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "is_installed", lambda: True)
    monkeypatch.setattr(compiled, "is_cached", lambda _: True)
    assert why(QUADRATIC, 1_000_000) == (True, "the integrals of so many elements are worth loading numba")
    assert "loading numba takes longer" in why(QUADRATIC, 999_999)[1]
    assert "linear and quadratic" in why(Degrees(log=(2, 2), double=(2, 3)), 10**7)[1]
    monkeypatch.setattr(compiled, "is_cached", lambda _: False)
    assert "bemkit warm-up" in why(QUADRATIC, 1_000_000)[1]


def test_small_meshes_are_swept_in_numpy() -> None:
    mesh = discretise(Rectangle(2.0, 1.0).outline(), n_elements=16).unit
    everything = np.arange(mesh.n_elements)
    assert isinstance(sweep_over(mesh, QUADRATIC, everything, everything), PairSweep)
