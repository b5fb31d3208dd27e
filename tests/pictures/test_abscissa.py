"""Contacts on horizontal lines are drawn over x, from left to right, slip and friction positive along x."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.pictures.abscissa import Abscissa
from bemkit.pictures.contact_curves import draw_contact_displacement, draw_contact_traction
from bemkit.pictures.load_history import draw_friction_loop
from bemkit.scene.toml import with_overrides


@pytest.fixture(scope="module")
def half_plane() -> bk.Solution:
    return bk.run(with_overrides(bk.load_scene("cylinder-on-half-plane"), elements=60))


def test_a_surface_that_runs_to_the_left_is_drawn_to_the_right(half_plane: bk.Solution) -> None:
    """The surface is drawn towards the middle of the contact: friction on it points outward."""
    table = half_plane.contact
    assert np.all(np.diff(table.x) < 0.0)
    for draw, column in ((draw_contact_displacement, table.u_t), (draw_contact_traction, table.sigma_t)):
        axes = draw(half_plane, "zone")
        assert axes.get_xlim() == pytest.approx((-0.068, 0.068))
        curves = [line.get_xydata() for line in axes.lines if len(line.get_xdata()) == table.n_contact]
        assert any(np.allclose(curve, np.stack([table.x, -column], axis=1), rtol=0.0, atol=1e-15) for curve in curves)
        assert axes.child_axes[0].get_xlabel() == "$x$ along 'zone'"
    right = table.x > 0.0
    assert -(table.weight * table.sigma_t)[right].sum() > 0.0


def test_the_status_is_where_x_says(half_plane: bk.Solution) -> None:
    changed = replace(half_plane, transitions=half_plane.transitions[:1])
    place = Abscissa.along(changed, "zone").at(changed.transitions[0].s)
    assert place == pytest.approx(changed.transitions[0].x, abs=1e-12)
    axes = draw_contact_traction(changed, "zone")
    assert place in [line.get_xdata()[0] for line in axes.lines if len(line.get_xdata()) == 2]
    first = axes.child_axes[0].patches[0]
    assert first.get_x() + first.get_width() == pytest.approx(0.068)  # what comes first along the boundary is right


def test_other_contacts_are_drawn_over_the_arc_length() -> None:
    arc = bk.run(with_overrides(bk.load_scene("disc-between-plates"), elements=32))
    assert Abscissa.along(arc, arc.contact.parts[0]).name.startswith("arc length $s$ along")
    assert arc.contact.common_direction == 0.0


def test_the_loop_of_a_surface_that_runs_to_the_left_is_not_mirrored(half_plane: bk.Solution) -> None:
    steps = bk.run(replace(half_plane.scene, load_factors=(0.5, 1.0)))
    axes = draw_friction_loop(steps)
    forces = axes.lines[0].get_ydata()
    assert steps.loading is not None
    np.testing.assert_array_equal(forces[1:], [-step.force_tangential for step in steps.loading.steps])
    assert axes.get_xlabel().startswith("mean tangential displacement along $x$")
