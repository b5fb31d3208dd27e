"""Load histories: the incremental law, warm starts, the price of a step."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import numpy as np
import pytest

import bemkit as bk
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.runs.steps import UnsolvableSceneError
from bemkit.scene.load_history import load_steps, with_scaled_loads


def block(*, push: Any = 0.2, press: Any = -1.0, law: bk.FrictionLaw | None = None, **options: Any) -> bk.Scene:
    """A block on a floor, pressed from above and pushed to the right at its top by a shear traction."""
    return bk.Scene(
        title="block",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(100.0, 0.3),
        law=bk.Coulomb(0.4) if law is None else law,
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
            bk.Part("load", bk.Traction(x=push, y=press), sides=("top",)),
        ),
        mesh=bk.MeshOptions(elements=60),
        **options,
    )


def cylinder(radius: float, factors: tuple[float, ...], *, elements: int = 320, fineness: float = 2.0) -> bk.Scene:
    """Half of a block, pressed from below against a rigid cylinder; by symmetry a roller stands for the other half.

    The gap is measured along the normals of the block, as in the theory of the half-plane.

    The contact half-width comes out near a = `radius`, small against the block of size 1, so that the block is nearly
    a half-plane.
    """
    a, wide = radius, 2.0 * radius
    near = 10.0 * wide
    corners = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (near, 1.0), (wide, 1.0), (0.0, 1.0), (0.0, 1.0 - near))
    names = ("bottom", "right", "free", "near", "contact", "near-axis", "axis")
    density = {"contact": fineness / a, "near": fineness / a / 15, "near-axis": fineness / a / 15}
    depth = 0.25 * a**2 * (2.0 * np.log(2.0 / a) - 0.43)  # approach of a cylinder of radius 1 to the depth 1
    return bk.Scene(
        title="cylinder on a block",
        shape=bk.Polygon(corners, side_names=names),
        material=bk.Material(1.0, 0.3),
        law=bk.Coulomb(0.3),
        load_factors=factors,
        parts=(
            bk.Part("contact", bk.Contact(bk.Gap(bk.Expression("1 - sqrt(1 - x**2)"))), sides=("contact",)),
            bk.Part("symmetry", bk.Roller(), sides=("axis", "near-axis")),
            bk.Part("base", bk.PrescribedDisplacement(x=0.0, y=float(depth)), sides=("bottom",)),
        ),
        mesh=bk.MeshOptions(elements=elements, density=density),
    )


def stick_ratio(solution: bk.Solution) -> float:
    places = {transition.from_status: transition.x for transition in solution.transitions}
    return places["slip"] / places["separated"]


@pytest.mark.slow
def test_static_and_incremental_law_differ_by_a_factor_of_two_under_a_cylinder() -> None:
    static = bk.run(cylinder(0.01, (1.0,), elements=640, fineness=3.0))
    # forces grow like the square of the width, so squares make equal steps of the width
    factors = tuple(float(factor) for factor in (np.arange(1, 41) / 40.0) ** 2)
    incremental = bk.run(cylinder(0.01, factors, elements=640, fineness=3.0))
    # half-plane, continuous loading: 0.299 and 0.687; nodes stand 0.01 a apart, 40 steps advance by 0.025 a
    assert stick_ratio(static) == pytest.approx(0.299, abs=0.01)
    assert stick_ratio(incremental) == pytest.approx(0.687, abs=0.015)
    assert incremental.linear_solves <= 8 * len(factors)


@pytest.mark.slow
def test_static_and_incremental_law_differ_on_a_coarse_mesh_too() -> None:
    static = bk.run(cylinder(0.03, (1.0,)))
    incremental = bk.run(cylinder(0.03, tuple(float(factor) for factor in (np.arange(1, 9) / 8.0) ** 2)))
    assert stick_ratio(static) == pytest.approx(0.31, abs=0.02)
    assert stick_ratio(incremental) > 0.6


@pytest.mark.slow
def test_proportional_frictionless_loading_does_not_depend_on_the_steps() -> None:
    scene = dataclasses.replace(cylinder(0.03, (1.0,)), law=bk.Frictionless())
    at_once = bk.run(scene)
    in_steps = bk.run(dataclasses.replace(scene, load_factors=(0.3, 0.7, 1.0)))
    np.testing.assert_allclose(in_steps.contact.sigma_n, at_once.contact.sigma_n, atol=1e-9)
    np.testing.assert_array_equal(in_steps.contact.status, at_once.contact.status)


def test_friction_remembers() -> None:
    """Pushed and let go again: slip leaves a displacement and tractions that the static law knows nothing of."""
    scene = block(push=0.38)
    pushed, released = bk.run([scene, dataclasses.replace(scene, parts=block(push=0.0).parts)])
    never = bk.run(block(push=0.0))
    slips = np.array(pushed.contact.status_words()) == "slip"
    assert slips.any()
    assert not slips.all()
    assert np.abs(released.contact.sigma_t - never.contact.sigma_t).max() > 0.01
    # released at once, the floor holds everything where it slid to
    np.testing.assert_allclose(released.contact.u_t[slips], pushed.contact.u_t[slips], rtol=1e-9)
    assert released.force_tangential == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(UnsolvableSceneError, match="slides the body to the right"):
        bk.run(block(push=0.3, press=-0.5, load_factors=(1.0, 0.0)))
    unheld = bk.run(block(push=0.3, press=-0.5, load_factors=(0.0, 1.0)))
    assert unheld.status is bk.Status.UNSOLVABLE_LOAD
    assert re.search("slides the body to the right.* Finished: 1 of 2 steps, up to load factor 0", unheld.message)


def test_an_elastic_step_back_and_forth_changes_nothing() -> None:
    """Without slip in between, unloading to the same load returns to the same state."""
    rough = bk.Coulomb(100.0)
    there, _, back = bk.run([block(push=0.3, law=rough), block(push=0.25, law=rough), block(push=0.3, law=rough)])
    np.testing.assert_allclose(back.contact.sigma_t, there.contact.sigma_t, atol=1e-9)


@pytest.mark.parametrize("discretisation", [bk.Galerkin(1), bk.ConstantCollocation()], ids=lambda d: type(d).__name__)
def test_the_body_is_assembled_once_and_loads_are_exact(
    discretisation: bk.Discretisation, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []
    for kind in (GalerkinElasticity, CollocationElasticity):
        original = kind.condense
        monkeypatch.setattr(kind, "condense", lambda self, *a, original=original: calls.append(1) or original(self, *a))
    first = cylinder(0.03, (1.0,), elements=120)
    first = dataclasses.replace(first, discretisation=discretisation)
    second = with_scaled_loads(first, 0.6)
    mesh = first.build_mesh()
    model = build_model(prepare(first, mesh))
    moved = model.under(model.prepared.under(second))
    fresh = build_model(prepare(first, mesh).under(second))
    assert len(calls) == 2
    np.testing.assert_allclose(moved.body.load, fresh.body.load, atol=1e-12 * np.abs(fresh.body.load).max())
    state = fresh.problem.sticking_state
    for one, other in zip(moved.boundary_fields(state)[0], fresh.boundary_fields(state)[0], strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * np.max(np.abs(other)))
    calls.clear()
    bk.run([first, second, first])
    assert len(calls) == 1


def test_scaling_of_loads() -> None:
    scene = block(push=bk.Expression("x - 1"), press=lambda x, y: -1.0 - x)
    half = with_scaled_loads(scene, -0.5).parts[1].condition
    points = np.array([[0.0, 1.0], [2.0, 1.0]])
    np.testing.assert_allclose(half.at(points, points), -0.5 * scene.parts[1].condition.at(points, points))
    pressure = bk.Part("p", bk.Pressure(2.0, 4.0), sides=("top",))
    clamp = bk.Part("c", bk.PrescribedDisplacement(y=0.5), sides=("left",))
    scene = dataclasses.replace(scene, parts=(scene.parts[0], pressure, clamp), load_factors=(0.5, 1.0))
    steps = load_steps(scene)
    assert [step.load_factors for step in steps] == [(1.0,), (1.0,)]
    assert [step.steps for step in steps] == [(bk.Step(1.0),), (bk.Step(2.0),)]
    assert steps[0].parts[1].condition == bk.Pressure(1.0, 2.0)
    assert steps[0].parts[2].condition == bk.PrescribedDisplacement(y=0.25)
    assert steps[1].parts == scene.parts


def test_the_summary_covers_all_steps() -> None:
    records: list[Any] = []
    factors = (0.25, 0.5, 1.0)
    whole = bk.run(block(load_factors=factors), callback=records.append)
    steps = bk.run([block(load_factors=factors)])
    assert whole.linear_solves == sum(step.linear_solves for step in steps) == whole.history[-1].linear_solves
    assert len(whole.history) == len(records)
    assert [record.step for record in whole.history] == list(range(len(records)))
    assert whole.message.startswith("load step 3 of 3: ")
    assert whole.history[0].message.startswith("load step 1 of 3")
    assert whole.stated == block(load_factors=factors)
    assert whole.scene == load_steps(whole.stated)[-1]
    np.testing.assert_array_equal(whole.contact.sigma_n, steps[-1].contact.sigma_n)
    history_item = next(item for item in whole.plan.items if item.name == "load history")
    assert history_item.is_needed
    assert history_item.reason.startswith("3 load steps")


def test_a_step_that_fails_ends_the_history() -> None:
    impatient = bk.SemismoothNewton(max_steps=1)
    easy, hard = (block(push=push, solver=impatient) for push in (0.1, 0.39))
    steps = bk.run([easy, hard, easy])
    assert [step.status for step in steps] == [bk.Status.CONVERGED, bk.Status.LOAD_NOT_REACHED]
    whole = bk.run(dataclasses.replace(hard, load_factors=(0.5, 1.0, 0.0)))
    assert whole.status is bk.Status.MAX_STEPS  # the first step is not reached in increments
    assert "of 3: " in whole.message
    assert len(whole.history) < 6


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (dataclasses.replace(block(), material=bk.Material(1.0, 0.2)), "material is .*build a new model"),
        (dataclasses.replace(block(), shape=bk.Rectangle(1.0, 1.0)), "shape is "),
        (dataclasses.replace(block(), discretisation=bk.ConstantCollocation()), "discretisation is "),
        (dataclasses.replace(block(), parts=block().parts[:1]), "part 'load' changes its place or its kind"),
        (
            dataclasses.replace(block(), parts=(block().parts[0], bk.Part("load", bk.Clamped(), sides=("top",)))),
            "part 'load' changes its place or its kind",
        ),
    ],
)
def test_only_numbers_may_change(other: bk.Scene, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        bk.run([block(), other])


def test_no_scene_is_an_error() -> None:
    with pytest.raises(ValueError, match="scene is an empty sequence"):
        bk.run([])
