"""The sweeps: right on the paper's examples, and not to be fooled."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

import bemkit as bk
from bemkit.scene.toml import load_scene, with_overrides
from bemkit.studies.engine import StudyError
from bemkit.studies.stability.axes import Axis, axes_of, find_axes
from bemkit.studies.stability.case import Case
from bemkit.studies.stability.records import StabilityRecord, Verdict
from bemkit.studies.stability.sweep import difference, solve_and_judge, sweep
from bemkit.testing.independent_check import violations_of
from tests.scenes import CONSTANT, LINEAR, small_paper_scene
from tests.slow import slow_except

EXTREMES = {
    "youngs-modulus": (1e-12, 1e15),
    "load": (1e-12, 1e15),
    "size": (1e-9, 1e9),
    "degenerate-size": (0.99, 1.0),
    "position": (1e4, 1e12),
    "poisson-ratio": (0.4999999, 0.5),
    "friction": (0.0, 10.0, 1e3),
    "gap": (-1e3, 1e3),
    "load-direction": (30.0, 90.0),
    "sliding": (0.9999, 1.0001),
    "aspect-ratio": (0.01, 100.0),
    "rho-newton": (1e-8, 1e12),
    "rho-augmented": (1e3, 1e12),
    "elements": (0.5,),
    "grading": (1e6, 1e12),
}


def shortened(name: str) -> Axis:
    (axis,) = find_axes([name])
    return dataclasses.replace(axis, values=EXTREMES[name])


def test_every_axis_is_tested_here() -> None:
    assert {axis.name for axis in axes_of(bk.load_scene("paper-1"))} == set(EXTREMES)
    with pytest.raises(StudyError, match="'rho': the axes are youngs-modulus, load"):
        find_axes(["rho"])


@pytest.mark.parametrize("name", slow_except(EXTREMES, "sliding"))
@pytest.mark.parametrize(
    ("number", "discretisation"),
    slow_except([(1, CONSTANT), (2, LINEAR)], (1, CONSTANT)),
    ids=["paper-1", "paper-2"],
)
def test_the_ends_of_every_axis_are_right_or_named(
    name: str, number: int, discretisation: bk.Galerkin | bk.ConstantCollocation
) -> None:
    scene = small_paper_scene(number, 48, discretisation=discretisation)
    for row in sweep(scene, [shortened(name)]):
        verdict = Verdict(row.verdict)
        assert verdict in (Verdict.RIGHT, Verdict.NAMED, Verdict.COARSE), row
        if name in ("youngs-modulus", "load", "size", "degenerate-size", "rho-newton", "grading", "poisson-ratio"):
            assert verdict is Verdict.RIGHT, row
        if verdict is Verdict.RIGHT:
            assert row.certificate <= 1e-8
            assert row.condition >= 1.0
        else:
            assert row.message


def test_axes_make_the_scenes_that_they_name() -> None:
    baseline = bk.run(small_paper_scene(1, 24))
    values = {"position": 1e3, "poisson-ratio": 0.4, "rho-augmented": 7.0, "elements": 1.5}
    scenes = {axis.name: axis.make(baseline, values[axis.name]).scene for axis in find_axes(list(values))}
    moved = scenes["position"].build_mesh().centres.mean(axis=0) - baseline.mesh.centres.mean(axis=0)
    np.testing.assert_allclose(moved, np.array([0.8, -0.6]) * 1e3 * baseline.mesh.diameter, rtol=1e-12)
    assert scenes["poisson-ratio"].material.poisson_ratio == 0.4
    assert scenes["rho-augmented"].solver == bk.AugmentedLagrangian(rho_n=7.0, rho_t=7.0)
    assert scenes["elements"].mesh.elements == 36


@pytest.mark.parametrize("elements", [64, 65])
@pytest.mark.slow
def test_curved_bodies_far_away_are_what_they_are_at_home(elements: int) -> None:
    # equal sides stay equal whatever the round-off of their lengths; curves are known to that of where they were
    disc = with_overrides(load_scene("disc-between-plates"), elements=elements)
    assert isinstance(disc, bk.Scene)
    axis = dataclasses.replace(shortened("position"), values=(1.0, 1e6, 1e8))
    rows = list(sweep(disc, [axis]))
    assert [row.verdict for row in rows] == ["right"] * 2 + ["named"]
    assert rows[0].deviation <= 1e-12
    assert "times its size from the origin" in rows[-1].message


def test_a_case_that_cannot_be_made_is_a_named_row_and_the_sweep_goes_on() -> None:
    def make(baseline: bk.Solution, value: float) -> Case:
        return Case(value, dataclasses.replace(baseline.scene, material=bk.Material(value, 0.3)))

    bad, good = sweep(small_paper_scene(1), [Axis("modulus", "modulus", "any", (-1.0, 1e4), make)])
    assert (bad.verdict, bad.status) == ("named", "refused")
    assert "youngs_modulus is -1" in bad.message
    assert good.verdict == "right"


@pytest.mark.slow
def test_answers_approach_the_incompressible_one_smoothly() -> None:
    axis = dataclasses.replace(shortened("poisson-ratio"), values=(0.49, 0.499, 0.4999, 0.49999))
    deviations = [row.deviation for row in sweep(small_paper_scene(1), [axis])]
    # proportional to 1/2 - nu; sets change on the way, so the first ratio is not exact
    np.testing.assert_allclose(np.array(deviations[:-1]) / deviations[1:], 10.0, rtol=0.2)


def altered(solution: bk.Solution) -> bk.Solution:
    table = solution.contact
    return dataclasses.replace(solution, contact=dataclasses.replace(table, sigma_t=0.99 * table.sigma_t))


def row_of(case: Case, reference: bk.Solution, solve: Callable[..., bk.Solution] = bk.run) -> StabilityRecord:
    return solve_and_judge("axis", case, reference, solve)


def test_a_driver_that_lies_is_found_out() -> None:
    scene = small_paper_scene(1)
    reference = bk.run(scene)
    assert row_of(Case(1.0, scene), reference).verdict == "right"
    lying = row_of(Case(1.0, scene), reference, lambda scene, mesh: altered(bk.run(scene, mesh=mesh)))
    assert lying.verdict == "wrong"
    assert "independent check finds" in lying.message


def test_an_answer_that_depends_on_the_units_is_found_out() -> None:
    scene = small_paper_scene(1)
    reference = bk.run(scene)

    def unit_bound(scene: bk.Scene, mesh: object = None) -> bk.Solution:
        stiff = scene.material.youngs_modulus > 1e6
        return bk.run(dataclasses.replace(scene, law=bk.Coulomb(0.4)) if stiff else scene)

    assert row_of(Case(1.0, scene), reference, unit_bound).verdict == "ambiguous"
    held_to_it = row_of(Case(1.0, scene, deviation_limit=1e-6), reference, unit_bound)
    assert held_to_it.verdict == "wrong"
    assert "scaled copy differs" in held_to_it.message


def test_deviation_unsolvable_claims_and_other_statuses_are_found_out() -> None:
    scene = small_paper_scene(1)
    reference = bk.run(scene)
    other = dataclasses.replace(scene, law=bk.Coulomb(0.4))
    assert "deviates" in row_of(Case(1.0, other, deviation_limit=1e-6), reference).message
    assert "other" in row_of(Case(1.0, other, keeps_steps=True), reference).message
    assert "no solution exists" in row_of(Case(1.0, scene, is_solvable=False), reference).message
    few = dataclasses.replace(scene, solver=bk.SemismoothNewton(max_steps=1))
    named = row_of(Case(1.0, few), reference)
    assert (named.verdict, named.status) == ("named", "max_steps")
    assert row_of(Case(1.0, few, is_solvable=True), reference).verdict == "wrong"
    stiff_fails = lambda scene, mesh=None: bk.run(few if scene.material.youngs_modulus > 1e6 else scene)  # noqa: E731
    assert "but its scaled copy: max_steps" in row_of(Case(1.0, scene), reference, stiff_fails).message


def test_an_error_without_a_name_is_not_hidden() -> None:
    def broken(scene: bk.Scene, mesh: object = None) -> bk.Solution:
        raise ValueError("operands could not be broadcast together")

    reference = bk.run(small_paper_scene(1))
    with pytest.raises(ValueError, match="broadcast"):
        row_of(Case(1.0, small_paper_scene(1)), reference, broken)


def test_a_scene_without_a_solution_is_no_baseline() -> None:
    scene = small_paper_scene(1, solver=bk.SemismoothNewton(max_steps=1))
    with pytest.raises(StudyError, match=r"no converged solution .*: give one that has"):
        list(sweep(scene, axes_of(scene)))


def test_a_load_history_is_no_baseline() -> None:
    with pytest.raises(StudyError, match="the scene has 32 load steps, but a sweep solves one: give it a single load"):
        list(sweep(bk.load_scene("friction-loop"), find_axes(["load"])))


def test_differences_on_other_meshes_are_means_and_see_missing_parts() -> None:
    one, finer = bk.run(small_paper_scene(1, 64)), bk.run(small_paper_scene(1, 128))
    assert 1e-6 < difference(one, finer, Case(1.0, one.scene).similarity) < 0.05
    table = dataclasses.replace(one.contact, part=("elsewhere",) * one.contact.n_contact)
    assert math.isinf(difference(one, dataclasses.replace(one, contact=table), Case(1.0, one.scene).similarity))


@pytest.mark.slow
@pytest.mark.parametrize("discretisation", [LINEAR, CONSTANT], ids=["linear", "constant"])
@pytest.mark.parametrize("name", ["paper-1", "paper-2"])
def test_no_row_of_the_whole_sweep_is_wrong(name: str, discretisation: bk.Galerkin) -> None:
    scene = dataclasses.replace(bk.load_scene(name), discretisation=discretisation)
    assert violations_of(bk.run(scene)).is_good
    wrong = [row for row in sweep(scene, axes_of(scene)) if row.verdict == "wrong"]
    assert wrong == []
