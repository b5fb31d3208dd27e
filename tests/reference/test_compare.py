"""Solutions against references: what errors mean, which reference belongs to a scene, fine solutions as references."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest

import bemkit as bk
from bemkit.errors import InputError
from bemkit.reference import MEASURES, Reference, ZoneEnd, errors_of, find_reference, over_resolved, sampled_fields
from tests.slow import slow_except

WITH_REFERENCE = ("paper-1", "paper-2", "wavy-obstacle", "disc-between-plates", "uniform-slip", "gravity-column")


def known(name: str) -> Reference:
    reference = find_reference(bk.load_scene(name))
    assert reference is not None
    return reference


def test_errors_are_relative_and_zero_for_the_exact_answer() -> None:
    exact = known("paper-1")
    assert set(errors_of(exact.answer, exact)) == set(MEASURES)
    assert all(value == 0.0 for value in errors_of(exact.answer, exact).values())
    answer = exact.answer
    zones = (dataclasses.replace(answer.zones[0], s=answer.zones[0].s + 0.01), answer.zones[1])
    changed = dataclasses.replace(
        answer,
        sigma_n=1.1 * answer.sigma_n,
        u_n=0.8 * answer.u_n,
        u_t=0.8 * answer.u_t,
        energy=0.7 * answer.energy,
        zones=zones,
    )
    errors = errors_of(changed, exact)
    assert [round(errors[name], 9) for name in ("sigma_n", "sigma_t", "displacement", "energy", "transitions")] == [
        0.1,
        0.0,
        0.2,
        0.3,
        0.01,
    ]


def test_missing_and_meaningless_errors() -> None:
    exact = known("wavy-obstacle")
    errors = errors_of(dataclasses.replace(exact.answer, zones=(ZoneEnd("wave", 0.25, "stick", "separated"),)), exact)
    assert math.isinf(errors["transitions"])
    assert math.isnan(errors["sigma_t"])  # a frictionless reference has none
    assert math.isnan(errors["force_tangential"])


def test_statuses_that_flicker_are_one_end_of_a_zone() -> None:
    solution = bk.run(bk.load_scene("paper-1"))
    places = known("paper-1").places
    first, last = solution.transitions
    back = dataclasses.replace(first, s=first.s + 1e-9, from_status=first.to_status, to_status=first.from_status)
    again = dataclasses.replace(first, s=first.s + 2e-9)
    flickering = dataclasses.replace(solution, transitions=(first, back, again, last))
    kinds = [(zone.before, zone.after) for zone in sampled_fields(flickering, places).zones]
    assert kinds == [("separated", "slip"), ("slip", "stick")]
    apart = dataclasses.replace(solution, transitions=(first, dataclasses.replace(back, s=first.s + 1e-3), last))
    assert len(sampled_fields(apart, places).zones) == 3


@pytest.mark.parametrize("name", slow_except(WITH_REFERENCE, "uniform-slip", "gravity-column"))
def test_computed_solutions_approach_the_references(name: str) -> None:
    scene = bk.load_scene(name)
    reference = known(name)
    meshes = (bk.MeshOptions(accuracy=3e-2), bk.MeshOptions(accuracy=3e-4))
    if name in ("uniform-slip", "gravity-column"):  # exact on any mesh
        meshes = (bk.MeshOptions(elements=12), bk.MeshOptions(elements=24))
    coarse, fine = (
        errors_of(sampled_fields(solution, reference.places), reference)
        for solution in (bk.run(dataclasses.replace(scene, discretisation=bk.Galerkin(2), mesh=m)) for m in meshes)
    )
    limits = {"energy": 1e-6, "sigma_n": 2e-3, "sigma_t": 4e-3, "displacement": 2e-4, "transitions": 3e-3}
    for measure, limit in limits.items():
        assert not fine[measure] > limit, measure
    if name in ("uniform-slip", "gravity-column"):
        assert np.nanmax([fine[measure] for measure in ("energy", "sigma_n", "sigma_t", "displacement")]) < 1e-10
    else:
        assert fine["sigma_n"] < 0.8 * coarse["sigma_n"]


def test_fields_are_those_of_the_elements() -> None:
    scene = bk.load_scene("paper-1")
    reference = known("paper-1")
    (places,) = reference.places
    constant = bk.run(dataclasses.replace(scene, mesh=bk.MeshOptions(elements=16)))
    steps = sampled_fields(constant, reference.places).sigma_n
    assert len(set(steps.tolist())) == constant.contact.n_contact
    linear = bk.run(dataclasses.replace(scene, mesh=bk.MeshOptions(elements=16), discretisation=bk.Galerkin(1)))
    expected = np.interp(places.s, linear.contact.s, linear.contact.u_n)
    np.testing.assert_allclose(sampled_fields(linear, reference.places).u_n, expected, rtol=1e-12)


def test_a_reference_belongs_to_its_problem_alone() -> None:
    scene = bk.load_scene("paper-1")
    other_mesh = dataclasses.replace(
        scene,
        title="mine",
        mesh=bk.MeshOptions(elements=20),
        solver=bk.AugmentedLagrangian(),
        discretisation=bk.Galerkin(2),
    )
    assert find_reference(other_mesh) is not None
    assert find_reference(dataclasses.replace(scene, law=bk.Coulomb(0.51))) is None
    assert find_reference(bk.load_scene("receding-layer")) is None


def test_a_fine_solution_knows_how_wrong_it_is() -> None:
    exact = known("paper-1")
    fine = over_resolved(bk.load_scene("paper-1"), 200)
    assert re.search(r"elements of degree [56], estimated error", fine.source)
    assert abs(fine.answer.energy / exact.answer.energy - 1.0) <= fine.own_errors["energy"] + exact.own_errors["energy"]
    at_exact = errors_of(fine.answer, fine)
    assert all(value == 0.0 for value in at_exact.values())
    weight = fine.places[0].weight
    assert weight.sum() == pytest.approx(1.0)
    assert -weight @ fine.answer.sigma_n == pytest.approx(0.5, rel=1e-9)


def test_a_load_history_is_over_resolved_on_given_meshes() -> None:
    scene = dataclasses.replace(bk.load_scene("paper-2"), load_factors=(0.5, 1.0))
    fine = over_resolved(scene, 80)
    assert "80 elements of degree 2" in fine.source
    assert 0.0 < fine.own_errors["sigma_n"] < 0.1


def test_without_two_fine_solutions_there_is_no_reference() -> None:
    scene = dataclasses.replace(bk.load_scene("paper-1"), solver=bk.SemismoothNewton(max_steps=1))
    with pytest.raises(InputError, match="no two converged solutions with up to 100 quadratic elements"):
        over_resolved(scene, 100)
