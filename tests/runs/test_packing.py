"""Random packings of discs under their weight: many bodies that nothing but contact holds."""

from __future__ import annotations

from dataclasses import replace

import pytest

import bemkit as bk
from tests.runs.packing import packing
from tests.slow import slow_except


def check_packing(assembly: bk.Scene, statuses: tuple[bk.Status, ...] = (bk.Status.CONVERGED,)) -> None:
    solution = bk.run(assembly)
    assert solution.status in statuses
    assert solution.certificate.worst <= 1e-9
    walls = [one for one in solution.contacts if " / " not in one.name]
    weight = sum(body.mesh.area for body in solution.bodies.values())
    assert sum(one.force_y for one in walls) == pytest.approx(weight, rel=1e-9)
    assert sum(one.force_x for one in walls) == pytest.approx(0.0, abs=1e-9 * weight)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "width"), slow_except([(4, 3.0), (12, 5.0)], (4, 3.0)))
def test_a_packing_of_a_few_discs_rests(n: int, width: float) -> None:
    check_packing(packing(n, width))


@pytest.mark.slow
@pytest.mark.parametrize(("n", "width", "seed"), [(200, 20.0, 0), (200, 20.0, 1), (200, 20.0, 2), (300, 24.0, 1)])
def test_packings_of_hundreds_of_discs_rest(n: int, width: float, seed: int) -> None:
    """Springs throughout, then full steps; of 200 discs and seed 1 a path of 37 pieces where these come back.

    Of 300 discs one stands on a single node, out of balance by 1e-8 of its weight, until it is carried to the next.
    """
    # single discs come to rest where they have slid by a third of their radius, which the gaps do not follow
    check_packing(packing(n, width, seed=seed), (bk.Status.CONVERGED, bk.Status.FINITE_SLIDING))


@pytest.mark.slow
def test_points_that_face_two_discs_are_why_contacts_have_a_reach() -> None:
    """With the reach of half a disc the contacts tie many points twice, and six digits are lost."""
    near = packing(12, 5.0)
    far = replace(near, touching=replace(near.touching, reach=None))
    counts = [bk.run(each).contact.n_contact for each in (near, replace(far, touching=bk.Touching(0.02, reach=0.05)))]
    assert counts[0] > counts[1]
    assert bk.run(far).contact.n_contact > 2 * counts[0]
