"""The independent check knows forces and heat inside: right answers pass, others do not."""

from __future__ import annotations

import contextlib
import dataclasses
from functools import lru_cache
from itertools import product

import numpy as np
import pytest

import bemkit as bk
from bemkit.testing.independent_check import violations_of
from bemkit.testing.independent_check.boundary import boundary_of
from bemkit.testing.independent_check.inside import inner_work
from checks.random_scenes import random_case
from tests.slow import slow_only
from tests.testing.independent_check.company import first_body, in_company, with_body

FORCES = (
    bk.Gravity(1.0, (0.1, -1.0)),
    bk.Rotation(1.0, 0.3, (0.4, 0.2)),
    bk.Heating(0.1, bk.Expression("1 + x * y")),
)


@lru_cache
def solved(*, is_symmetric: bool = False, among: bool = False) -> bk.Solution:
    symmetric = (
        bk.Gravity(1.0, (0.0, -1.0)),
        bk.Rotation(1.0, 0.3, (0.5, 0.2)),
        bk.Heating(0.1, bk.Expression("1 + y")),
    )
    scene = bk.Scene(
        title="block",
        shape=bk.Rectangle(1.0, 1.5),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),),
        law=bk.Coulomb(0.5),
        symmetry=bk.Symmetry(x=0.5) if is_symmetric else None,
        body_forces=symmetric if is_symmetric else FORCES,
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(60),
    )
    return bk.run(in_company(scene) if among else scene)


@pytest.mark.parametrize("is_symmetric", [False, True])
def test_right_answers_pass(is_symmetric: bool) -> None:
    solution = solved(is_symmetric=is_symmetric)
    assert solution.is_converged
    check = violations_of(solution)
    assert check.worst < 1e-11
    assert check.reciprocity < 1e-3


@pytest.mark.parametrize(("number", "among"), slow_only(product(range(3), [False, True]), (0, True), (2, True)))
def test_forces_that_are_left_out_are_noticed(number: int, among: bool) -> None:
    solution = solved(among=among)
    assert violations_of(solution).is_good
    others = tuple(force for k, force in enumerate(FORCES) if k != number)
    scene = dataclasses.replace(first_body(solution).scene, body_forces=others)
    forgetful = with_body(solution, scene=scene)
    check = violations_of(forgetful)
    assert check.reciprocity > 1e-2
    assert ("equilibrium" in check.faults) == (number < 2)  # heat has no resultant


def test_resultants_are_those_of_the_domain() -> None:
    """A weight at the centroid; centrifugal forces as those of a point there."""
    solution = solved()
    work = inner_work(solution.body, boundary_of(solution.body, ()))
    arm = np.array([0.5, 0.75]) - [0.4, 0.2]
    np.testing.assert_allclose(work[:2], 1.5 * (np.array([0.1, -1.0]) + 0.09 * arm), rtol=1e-13)
    assert abs(work[2]) < 1e-15  # about the centroid


def test_random_scenes_have_all_kinds() -> None:
    missing = {bk.Gravity, bk.Rotation, bk.Heating}
    for index in range(80):
        with contextlib.suppress(bk.BemkitError):
            missing -= {type(force) for scene in random_case(7, index).scenes for force in scene.body_forces}
        if not missing:
            return
    pytest.fail(f"never drawn: {missing}")
