"""Couplings of congruent pairs are those of one of them, moved."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from bemkit.contact.mortar.congruent import CongruentCouplings, PlacedSide
from bemkit.contact.mortar.coupling import MortarCoupling, couple
from bemkit.contact.mortar.sides import ContactSide
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.placement import Placement
from tests.contact.mortar.pairs import block, space_of

UPPER, LOWER = block((0.0, 0.0), (1.0, 1.0), 5, 2), block((0.0, 0.0), (2.0, 1.0), 7, 2)
NOTHING = np.zeros(0, np.intp)


def placed(mesh: BoundaryMesh, part: str, placement: Placement) -> PlacedSide:
    return PlacedSide(ContactSide(space_of(placement.mesh(mesh), 2), mesh.part(part)), placement)


def pair(motion: Placement, shift: float = 0.4, turn: float = 0.0) -> tuple[PlacedSide, PlacedSide]:
    """A block that hangs a little to the side above another one, both moved together."""
    upper = motion.after(Placement((shift, 1.01), turn))
    return placed(UPPER, "bottom", upper), placed(LOWER, "top", motion)


def assert_alike(one: MortarCoupling, other: MortarCoupling) -> None:
    for entry in fields(MortarCoupling):
        ours, theirs = getattr(one, entry.name), getattr(other, entry.name)
        if entry.name.startswith("on_"):
            ours, theirs = ours.toarray(), theirs.toarray()
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-12, err_msg=entry.name)  # coordinates of about ten


@pytest.mark.parametrize("motion", [Placement((3.0, -7.0)), Placement((2.0, 5.0), 33.0), Placement((0.1, 0.2), 90.0)])
def test_a_congruent_pair_is_coupled_like_the_first_one(motion: Placement) -> None:
    couplings = CongruentCouplings()
    couplings.couple(*pair(Placement(), turn=1.0), NOTHING, 0.5)
    one, two = pair(motion, turn=1.0)  # one place is the deepest
    alone = couple(one.side, two.side, without=NOTHING, reach=0.5)
    assert_alike(couplings.couple(one, two, NOTHING, 0.5), alone)
    assert couplings.n_coupled == 1


@pytest.mark.parametrize("other", [{"shift": 0.5}, {"turn": 0.01}])
def test_a_pair_that_stands_otherwise_is_coupled_anew(other: dict[str, float]) -> None:
    couplings = CongruentCouplings()
    couplings.couple(*pair(Placement()), NOTHING, 0.5)
    one, two = pair(Placement((4.0, 0.0)), **other)
    assert_alike(couplings.couple(one, two, NOTHING, 0.5), couple(one.side, two.side, without=NOTHING, reach=0.5))
    assert couplings.n_coupled == 2


def test_meshes_that_share_no_more_than_the_array_of_elements_are_told_apart() -> None:
    """The bottom of one is higher by a hundred millionth, which its contact is not to ignore."""
    couplings = CongruentCouplings()
    couplings.couple(*pair(Placement()), NOTHING, 0.5)
    upper, lower = pair(Placement((4.0, 0.0)))
    mesh = upper.side.mesh
    is_bottom = mesh.nodes[:, 1] < 1.02
    nodes = mesh.nodes + np.outer(is_bottom, [0.0, 1e-8])
    bent = PlacedSide(ContactSide(space_of(mesh.unchecked_copy(nodes, ()), 2), upper.side.elements), upper.placement)
    assert bent.side.mesh.elements is UPPER.elements
    np.testing.assert_allclose(couplings.couple(bent, lower, NOTHING, 0.5).gap, 0.01 + 1e-8, rtol=0.0, atol=1e-12)


def test_nodes_without_multipliers_and_another_reach_make_another_coupling() -> None:
    couplings = CongruentCouplings()
    whole = couplings.couple(*pair(Placement()), NOTHING, 0.5)
    one, two = pair(Placement((4.0, 0.0)))
    assert couplings.couple(one, two, whole.nodes[:1], 0.5).nodes.size == whole.nodes.size - 1
    with pytest.raises(ValueError, match="face each other nowhere"):
        couplings.couple(one, two, NOTHING, 1e-3)
