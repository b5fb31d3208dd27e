"""Estimated errors of contact tractions between bodies of linear and quadratic elements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.results.contact_table import ContactTable
from bemkit.results.error_indicators import nodal_error
from bemkit.results.solution import Solution
from bemkit.solvers.active_sets import NodeStatus
from tests.slow import slow_except


def solved(name: str, degree: int, mesh: bk.MeshOptions) -> Solution:
    scene = bk.load_scene(name)
    bodies = tuple(replace(body, mesh=None, discretisation=None) for body in scene.bodies)
    return bk.run(replace(scene, bodies=bodies, discretisation=bk.Galerkin(degree), mesh=mesh))


def along_hole(solution: Solution) -> FloatArray:
    """Return the angle, both tractions and the weight of each node, in the order of the angles."""
    table = solution.contact
    angle = np.arctan2(table.y, table.x)
    return np.stack([angle, table.sigma_n, table.sigma_t, table.weight])[:, np.argsort(angle)]


@pytest.fixture(scope="module")
def reference() -> FloatArray:
    return along_hole(solved("pin-in-plate", 2, bk.MeshOptions(accuracy=1e-3, rising_degrees=True)))


@pytest.mark.parametrize("n_elements", slow_except((80, 120, 160, 240), 120))
@pytest.mark.parametrize("degree", [1, 2])
def test_the_estimate_is_near_the_error(degree: int, n_elements: int, reference: FloatArray) -> None:
    solution = solved("pin-in-plate", degree, bk.MeshOptions(elements=n_elements))
    angle, *tractions, weight = along_hole(solution)
    errors = [
        mine - np.interp(angle, reference[0], exact) for mine, exact in zip(tractions, reference[1:3], strict=True)
    ]
    true = np.sqrt(np.sum(weight * np.square(errors)) / np.sum(weight * np.square(tractions)))
    assert solution.estimated_traction_error is not None
    assert 0.5 < solution.estimated_traction_error / true < 3.0
    assert "of contact tractions" in str(solution)


def test_tractions_that_a_few_nodes_carry_are_warned_of() -> None:
    """Tractions are wrong by a third; the estimate of coarse zones is on the safe side."""
    solution = solved("two-cylinders", 2, bk.MeshOptions(elements=80))
    texts = [str(warning) for warning in solution.warnings]
    assert any(text.startswith("The estimated error of contact tractions is 88 %: use more") for text in texts), texts


def test_two_nodes_have_no_estimate() -> None:
    assert solved("tilted-punch", 1, bk.MeshOptions(elements=80)).estimated_traction_error is None


def test_a_contact_of_two_nodes_counts_as_wrong_beside_others() -> None:
    s = np.array([0.0, 1.0, 2.0, 3.0, 0.0, 1.0])
    none, even = np.zeros(6), np.array([-1.0, -1.0, -1.0, -1.0, -3.0, -3.0])
    parts = ("long",) * 4 + ("short",) * 2
    table = ContactTable(
        parts, s, none, s, none, none, even, none, none, none, np.full(6, NodeStatus.STICK), np.full(6, 0.5)
    )
    assert nodal_error(table, 1, lambda _: 2) == 2.0 * 9.0
    assert nodal_error(table.renamed({"short": "short"}), 1, lambda _: 1) is None


def test_a_part_with_few_elements_is_named_with_its_body() -> None:
    solution = solved("tilted-punch", 1, bk.MeshOptions(elements=6))
    warning = next(each for each in solution.warnings if each.kind == "held part with few elements")
    assert str(warning).startswith("Body 'block': Part "), warning
