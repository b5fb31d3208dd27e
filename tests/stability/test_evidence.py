"""The independent check passes right answers and objects to every kind of wrong one."""

from __future__ import annotations

import dataclasses
from functools import lru_cache

import numpy as np
import pytest

import bemkit as bk
from bemkit.stability.evidence import Evidence, examine
from tests.stability.scenes import CONSTANT, FLOOR, LINEAR, block, small_paper_scene


@lru_cache
def solved(number: int, discretisation: bk.LinearGalerkin | bk.ConstantCollocation) -> bk.Solution:
    return bk.run(small_paper_scene(number, discretisation=discretisation))


@pytest.mark.parametrize("discretisation", [LINEAR, CONSTANT])
@pytest.mark.parametrize("number", [1, 2])
def test_right_answers_pass(number: int, discretisation: bk.LinearGalerkin) -> None:
    evidence = examine(solved(number, discretisation))
    assert evidence.worst <= 1e-12  # a solved system of this size carries about 1e-15
    assert evidence.is_good
    assert not evidence.is_coarse
    assert evidence.reciprocity <= 0.02  # the discretisation error at N = 64


def tampered(solution: bk.Solution, **columns: np.ndarray) -> Evidence:
    return examine(dataclasses.replace(solution, contact=dataclasses.replace(solution.contact, **columns)))


@pytest.mark.parametrize("discretisation", [LINEAR, CONSTANT])
def test_each_violation_is_seen_under_its_name(discretisation: bk.LinearGalerkin) -> None:
    solution = solved(1, discretisation)
    table = solution.contact
    pressed, slipping = int(np.argmin(table.sigma_n)), int(np.argmax(np.where(table.status > 1, np.abs(table.u_t), 0)))
    is_open = int(np.argmax(table.clearance))

    def changed(name: str, node: int, factor: float) -> np.ndarray:
        column = getattr(table, name).copy()
        column[node] *= factor
        return column

    length = float(np.abs(table.u_n).max())
    assert tampered(solution, clearance=table.clearance - 1e-3 * length).penetration > 1e-6
    tension = table.sigma_n.copy()
    tension[is_open] = 1e-3
    seen = tampered(solution, sigma_n=tension)
    assert min(seen.tension, seen.complementarity) > 1e-4
    assert tampered(solution, sigma_t=changed("sigma_t", slipping, 1.01)).cone_excess > 1e-4
    assert tampered(solution, sigma_t=changed("sigma_t", slipping, 0.99)).slip_opposition > 1e-4
    assert tampered(solution, u_t=changed("u_t", slipping, -1.0)).slip_opposition > 1e-4
    assert tampered(solution, sigma_n=changed("sigma_n", pressed, 1.01)).equilibrium > 1e-5
    assert tampered(solution, gap=table.gap + 1e-3 * length).obstacle > 1e-6
    assert np.isnan(tampered(solution, u_t=changed("u_t", slipping, np.nan)).worst)
    assert not tampered(solution, u_t=changed("u_t", slipping, np.nan)).is_good


@pytest.mark.parametrize("discretisation", [LINEAR, CONSTANT])
def test_displacements_of_another_body_are_seen(discretisation: bk.LinearGalerkin) -> None:
    solution = solved(2, discretisation)
    boundary = dataclasses.replace(solution.boundary, displacement=2.0 * solution.boundary.displacement)
    assert examine(dataclasses.replace(solution, boundary=boundary)).is_coarse
    softer = dataclasses.replace(solution.scene, material=bk.Material(5e3, 0.3))
    assert examine(dataclasses.replace(solution, scene=softer)).is_coarse


def test_rigid_motions_do_not_hide_anything() -> None:
    pressed = bk.Part("top", bk.Pressure(1.0), sides=("top",))
    solution = bk.run(block(FLOOR, pressed, bk.Part("wall", bk.Roller(), sides=("right",))))
    far = dataclasses.replace(solution.boundary, displacement=solution.boundary.displacement + np.array([0.0, 1e3]))
    assert examine(dataclasses.replace(solution, boundary=far)).reciprocity == pytest.approx(
        examine(solution).reciprocity, abs=1e-9
    )


def test_tresca_friction_across_a_gap_and_loose_bodies_pass() -> None:
    push = bk.Part("push", bk.Pressure(0.1), sides=("left",))
    load = bk.Part("load", bk.Traction(y=bk.Expression("-x")), sides=("top",))
    for law in (bk.Tresca(0.3), bk.Coulomb(bk.Expression("0.2 + x"))):
        for discretisation in (LINEAR, CONSTANT):
            evidence = examine(bk.run(block(FLOOR, push, load, law=law, discretisation=discretisation)))
            assert evidence.worst <= 1e-9


def test_a_body_that_an_overlap_pushed_aside_shows_the_smallest_traction_left_on_it() -> None:
    inside = bk.Part("inside", bk.Contact(bk.Circle((0.5, -9.99), 10.0)), sides=("bottom",))
    solution = bk.run(block(inside))
    table = solution.contact
    assert examine(solution).is_good
    assert examine(solution).tension == 0.0
    # 1e-12 E' per displacement of the body's size: a thousandth of what the old measure, the overlap, let pass
    per_strain = solution.scene.material.plane_modulus * float(np.abs(table.u_n).max())

    def tension(share: float) -> float:
        left = np.zeros(table.n_contact)
        left[3] = share * per_strain
        return tampered(solution, sigma_n=left).tension

    assert tension(1e-12) > 1e-6
    assert tension(1e-14) <= 1e-6  # some eps, divided by the share of an element in the body
    inward = table.clearance - 1e-6 * float(np.abs(table.u_n).max())
    assert tampered(solution, clearance=inward).penetration > 1e-6
