"""A scene of one body, and the same body as the only one of several: one answer in every feature."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import FloatArray
from tests.slow import slow_only

CLOSE = 1e-12
COARSE = bk.MeshOptions(elements=48)
PAPER = replace(bk.load_scene("paper-1"), mesh=COARSE)
STEPS = (
    bk.Step(1.0, {"parts.top-load.condition.y": -2.0}),
    bk.Step(2.0, {"parts.top-load.condition.y": -1.0, "law.friction_coefficient": 0.4}),
)
HELD = bk.Scene(  # friction acts at the node that the support guides
    title="a corner on a moving support",
    shape=bk.Rectangle(2.0, 1.0),
    material=bk.Material(1.0, 0.3),
    law=bk.Coulomb(0.3),
    parts=(
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("press", bk.Traction(y=-1.0), sides=("top",)),
        bk.Part("push", bk.PrescribedDisplacement(x=0.05), sides=("left",)),
    ),
    mesh=COARSE,
)


FAR = replace(
    bk.load_scene("cylinder-on-half-plane"),
    mesh=bk.MeshOptions(elements=100),
    far=bk.FarField(y=2e-3),
)


def as_bodies(scene: bk.Scene) -> bk.Scene:
    """Return the scene with its body as the only one of several, of the same names."""
    steps = tuple(
        replace(step, changes={f"bodies.it.{key}" if key.startswith("parts.") else key: value
                               for key, value in step.changes.items()})
        for step in scene.steps
    )  # fmt: skip
    own = {name: getattr(scene, name) for name in ("shape", "material", "parts", "body_forces", "far")}
    body = bk.Body(name="it", **own)
    common = ("title", "law", "symmetry", "discretisation", "linear_solver", "mesh", "solver", "load_factors")
    return bk.Scene(bodies=(body,), steps=steps, **{name: getattr(scene, name) for name in common})


def probed(scene: Any) -> Any:
    solutions = bk.distinct_solutions(scene)
    assert len(solutions) == 1
    return solutions[0]


def started(scene: Any) -> Any:
    coarse = bk.run(replace(scene, mesh=bk.MeshOptions(elements=24)))
    return bk.run(scene, start=coarse)


def elsewhere(scene: Any) -> Any:
    with ProcessPoolExecutor(1) as executor:
        return bk.run(scene, executor=executor)


def on_a_mesh(scene: Any) -> Any:
    outline = PAPER.shape.outline()
    parts = {part.name: part.selection for part in PAPER.parts}
    mesh = bk.discretise(outline, n_elements=60, parts=parts)
    return bk.run(scene, mesh={"it": mesh} if scene.bodies else mesh)


FEATURES: dict[str, tuple[bk.Scene, Callable[[Any], Any]]] = {
    "single load": (PAPER, bk.run),
    "collocation": (replace(PAPER, discretisation=bk.ConstantCollocation()), bk.run),
    "start values": (PAPER, started),
    "probe": (PAPER, probed),
    "cascade": (PAPER, lambda scene: bk.run(scene, coarsest=12)),
    "mesh": (PAPER, on_a_mesh),
    "executor": (PAPER, elsewhere),
    "load factors": (replace(PAPER, load_factors=(0.5, 1.0, 0.2)), bk.run),
    "steps": (replace(PAPER, steps=STEPS), bk.run),
    "scenes in turn": (PAPER, lambda scene: bk.run([scene, scene])[-1]),
    "friction at held nodes": (HELD, bk.run),
    "body forces": (bk.load_scene("gravity-column"), bk.run),
    "symmetry": (
        replace(HELD, parts=HELD.parts[:2], symmetry=bk.Symmetry(x=1.0)),
        bk.run,
    ),
    "without contact": (bk.load_scene("bending"), bk.run),
    "degrees of elements": (replace(PAPER, discretisation=bk.Galerkin((2, 3) * 24)), bk.run),
    "half-plane": (replace(bk.load_scene("cylinder-on-half-plane"), mesh=bk.MeshOptions(elements=200)), bk.run),
    "motion far away": (FAR, bk.run),
    "slip weakening": (replace(PAPER, law=bk.SlipWeakening(0.5, 0.2, 1e-5), steps=STEPS[:1]), bk.run),
    "accuracy": (replace(PAPER, discretisation=bk.Galerkin(2), mesh=bk.MeshOptions(accuracy=2e-2)), bk.run),
    "hp": (
        replace(PAPER, discretisation=bk.Galerkin(2), mesh=bk.MeshOptions(accuracy=2e-3, rising_degrees=True)),
        bk.run,
    ),
}


def boundary_of(solution: Any) -> Iterator[FloatArray]:
    body = solution.body
    yield body.boundary.displacement
    yield body.boundary.traction
    table = solution.contact
    yield from (table.u_n, table.u_t, table.sigma_n, table.sigma_t)


@pytest.mark.parametrize(
    "feature",
    slow_only(
        FEATURES,
        "single load",
        "cascade",
        "executor",
        "body forces",
        "motion far away",
        "start values",
        "probe",
        "scenes in turn",
        "load factors",
        "accuracy",
        "hp",
        "slip weakening",
    ),
)
def test_both_forms_have_one_answer(feature: str) -> None:
    scene, solve = FEATURES[feature]
    one, several = solve(scene), solve(as_bodies(scene))
    assert one.status is several.status is bk.Status.CONVERGED
    assert several.linear_solves == one.linear_solves
    assert several.energy == pytest.approx(one.energy, rel=CLOSE)
    np.testing.assert_array_equal(one.contact.status, several.contact.status)
    for ours, theirs in zip(boundary_of(one), boundary_of(several), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=CLOSE * np.abs(ours).max(initial=1e-300))
    for name in ("estimated_error", "estimated_traction_error", "estimated_local_traction_error"):
        ours, theirs = getattr(one, name), getattr(several, name)
        assert theirs is None if ours is None else theirs == pytest.approx(ours, rel=1e-9, abs=1e-12), name
    if one.between_nodes is None:
        assert several.between_nodes is None
    else:
        assert several.between_nodes.as_dict() == pytest.approx(one.between_nodes.as_dict(), rel=1e-9, abs=1e-12)
    for ours, theirs in zip(one.contacts, several.contacts, strict=True):
        assert theirs.name == f"it.{ours.name}"
        numbers, others = (list(vars(each).values())[1:] for each in (ours, theirs))
        assert others == pytest.approx(numbers, rel=1e-9, abs=1e-12)
    assert [corner.exponent for corner in several.singular_corners] == [
        corner.exponent for corner in one.singular_corners
    ]


def test_sweeps_of_both_forms_have_one_answer() -> None:
    vary = {"law.friction_coefficient": [0.2, 0.5]}
    one, several = bk.sweep(PAPER, vary), bk.sweep(as_bodies(PAPER), vary)
    for ours, theirs in zip(one.rows, several.rows, strict=True):
        assert ours.energy == pytest.approx(theirs.energy, rel=CLOSE)
    assert bk.critical_friction(PAPER).smallest == pytest.approx(
        bk.critical_friction(as_bodies(PAPER)).smallest, rel=1e-10
    )
