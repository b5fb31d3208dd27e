"""What a scene says on a mesh is worked out once for each load step."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import bemkit as bk
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare, prepare_steps
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.scene.load_history import load_steps


def test_load_steps_share_the_units_of_the_largest_load() -> None:
    scene = dataclasses.replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=40), load_factors=(2.0, 0.5))
    first, last = prepare_steps(load_steps(scene), scene.build_mesh())
    assert last.units is first.units
    np.testing.assert_allclose(0.25 * first.only.force, last.only.force, rtol=1e-14)
    assert first.linear_solver(first.only).reason == "the equations are not compressed, because 40 elements are few"


def test_a_node_that_loses_its_friction_keeps_the_condensed_body(monkeypatch: pytest.MonkeyPatch) -> None:
    calls, condense = [], CollocationElasticity.condense
    monkeypatch.setattr(CollocationElasticity, "condense", lambda self, *a: calls.append(1) or condense(self, *a))
    scene = dataclasses.replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=40))
    smooth = dataclasses.replace(scene, law=bk.Frictionless())
    model = build_model(prepare(scene, scene.build_mesh()))
    without = model.under(model.prepared.under(smooth))
    again = without.under(without.prepared.under(scene))
    assert len(calls) == 1
    assert not again.problem.law.is_frictionless
    assert again.body.stiffness.shape == without.body.stiffness.shape
    assert without.problem.law.is_frictionless


def test_supports_that_contradict_each_other_are_named_in_the_coordinates_of_the_shape() -> None:
    corners = ((0.0, 0.0), (2.0, 0.0), (1.7, 1.0), (0.3, 1.0))
    scene = bk.Scene(
        title="supports that contradict each other",
        shape=bk.Polygon(corners, side_names=("bottom", "right", "top", "left")),
        material=bk.Material(1.0, 0.3),
        parts=(
            bk.Part("load", bk.PrescribedDisplacement(0.0, -1e-3), sides=("top",)),
            bk.Part("wall", bk.Roller(), sides=("left",)),
        ),
        mesh=bk.MeshOptions(elements=40),
    )
    with pytest.raises(bk.BemkitError, match=r"common point \(0.3, 1\): give the same displacement there"):
        bk.run(scene)
