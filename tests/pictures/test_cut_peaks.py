"""Peaks at corners do not flatten the pictures of tractions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

import bemkit as bk
from bemkit.pictures.boundary_traction import draw_boundary_traction
from bemkit.pictures.contact_axes import cut_peaks


@pytest.mark.parametrize(("peak", "is_cut"), [(1.5, False), (50.0, True)])
def test_a_peak_on_a_short_share_is_cut_and_told(peak: float, is_cut: bool) -> None:
    axes = Figure().subplots()
    s = np.linspace(0.0, 1.0, 1001)
    normal = -np.where(s < 0.005, peak, 1.0)
    axes.plot(s, normal)
    cut_peaks(axes, s, (normal, 0.3 * np.ones(1001)), None)
    notes = [text.get_text() for text in axes.texts]
    assert notes == (["peaks down to -50 are cut"] if is_cut else [])
    if is_cut:  # a quarter of the range of all others is added
        assert axes.get_ylim() == pytest.approx((-1.325, 0.625))


def test_a_long_range_is_drawn_as_it_is() -> None:
    axes = Figure().subplots()
    s = np.linspace(0.0, 1.0, 1001)
    cut_peaks(axes, s, (-50.0 * s**3,), None)
    cut_peaks(axes, s, (np.zeros(1001),), None)
    assert not axes.texts


@pytest.mark.slow
def test_the_boundary_of_a_shipped_scene_tells_what_is_cut() -> None:
    scene = replace(bk.load_scene("clamped-angle"), mesh=bk.MeshOptions(accuracy=1e-2))
    axes = draw_boundary_traction(bk.run(scene))
    assert [text.get_text() for text in axes.texts if "are cut" in text.get_text()]
