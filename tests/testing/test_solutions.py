"""The check of solutions passes on right fields, and names each planted fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.errors import InputError
from bemkit.testing import CheckFailed, check_solution
from tests.scenes import FLOOR, block
from tests.testing.independent_check.company import first_body, in_company, with_body


@pytest.fixture(scope="module", params=[False, True], ids=["one body", "one of several"])
def solution(request: pytest.FixtureRequest) -> bk.Solution:
    scene = block(FLOOR, bk.Part("load", bk.Pressure(1e-3), sides=("top",)), mesh=bk.MeshOptions(160))
    return bk.run(in_company(scene) if request.param else scene)


def test_right_fields_pass(solution) -> None:
    assert check_solution(solution).worst < 1e-6


def test_two_bodies_pass() -> None:
    two = bk.run(replace(bk.load_scene("two-cylinders"), mesh=bk.MeshOptions(elements=40)))
    assert check_solution(two).is_good


def with_table(solution: bk.Solution, **changes: np.ndarray) -> bk.Solution:
    return replace(solution, contact=replace(solution.contact, **changes))


def test_each_planted_fault_is_named(solution) -> None:
    table, body = solution.contact, first_body(solution)
    fields, energy = body.boundary, body.energy
    faults = {
        "negative_energy": with_body(solution, energy=-energy),
        "energy": with_body(solution, energy=2.0 * energy),
        "tension": with_table(solution, sigma_n=-table.sigma_n),
        "cone_excess": with_table(solution, sigma_t=table.sigma_t + np.abs(table.sigma_n)),
        "status": with_table(solution, status=np.zeros_like(table.status)),
        "gaps": with_table(solution, gap=table.gap + 1e-3),
        "tractions": with_body(solution, boundary=replace(fields, traction=1.1 * fields.traction)),
        "penetration": with_body(solution, boundary=replace(fields, displacement=fields.displacement - [0.0, 1e-3])),
    }
    for name, wrong in faults.items():
        with pytest.raises(CheckFailed, match=rf"the solution violates .*\b{name} "):
            check_solution(wrong)


def test_fields_of_another_material_need_a_warning(solution) -> None:
    scene = replace(first_body(solution).scene, material=bk.Material(3.0, 0.3))
    other = with_body(solution, scene=scene).with_warnings(())
    with pytest.raises(CheckFailed, match="the solution lacks a warning of reciprocity"):
        check_solution(other)


@pytest.mark.parametrize("among", [False, True], ids=["one body", "one of several"])
def test_work_that_is_missing_in_a_load_step_is_named(among: bool) -> None:
    scene = block(FLOOR, bk.Part("load", bk.Pressure(1e-3), sides=("top",)), load_factors=(0.5, 1.0))
    before, step = bk.run([in_company(scene) if among else scene])
    check_solution(step, before)
    last = step.loading.steps[-1]
    wrong = replace(last, work=replace(last.work, external_work=1.0))
    loading = replace(step.loading, steps=(*step.loading.steps[:-1], wrong))
    with pytest.raises(CheckFailed, match=r"the load history does not balance: .* of the work is missing"):
        check_solution(replace(step, loading=loading), before)


def test_a_solution_that_has_not_converged_is_refused(solution) -> None:
    with pytest.raises(InputError, match="the solution ended as stalled: give a converged one"):
        check_solution(replace(solution, status=bk.Status.STALLED))
