"""Bodies that overlap beside their contacts once they are displaced."""

from __future__ import annotations

import pytest

import bemkit as bk

STEEL = bk.Material(1.0, 0.3)


def blocks(push: float, gap: float, *, in_contact: bool) -> bk.Scene:
    """Two blocks on their base, beside each other; the left one is pushed to the right one."""
    mesh = bk.MeshOptions(elements=32)
    left = bk.Body(
        name="left",
        shape=bk.Rectangle(1.0, 1.0),
        material=STEEL,
        parts=(bk.Part("push", bk.PrescribedDisplacement(push, 0.0), ("left", "bottom")),),
        mesh=mesh,
    )
    right = bk.Body(
        name="right",
        shape=bk.Rectangle(1.0, 0.8, (1.0 + gap, 0.1)),
        material=STEEL,
        parts=(bk.Part("base", bk.Clamped(), ("right",)),),
        mesh=mesh,
    )
    floor = bk.RigidBody(name="floor", obstacle=bk.RigidHalfPlane((0.0, 1.0), (0.0, -1.0)), centre=(0.0, 1.0))
    contacts = (bk.ContactPair(("left.top", "floor")),)
    if in_contact:
        contacts += (bk.ContactPair(("left.right", "right.left")),)
    return bk.Scene(
        title="blocks", bodies=(left, right), contacts=contacts, rigid=(floor,), law=bk.Frictionless(),
        discretisation=bk.Galerkin(1),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("push", "in_contact", "is_warned"), [(3e-3, False, True), (3e-3, True, False), (5e-4, False, False)]
)
def test_bodies_that_overlap_beside_contacts_are_warned_of(push: float, in_contact: bool, is_warned: bool) -> None:
    solution = bk.run(blocks(push, 1e-3, in_contact=in_contact))
    assert solution.is_converged
    found = [warning for warning in solution.warnings if warning.kind == "overlap beside contacts"]
    assert len(found) == is_warned
    if is_warned:
        assert found[0].subject == "left / right"
        assert found[0].number == pytest.approx(push - 1e-3, rel=1e-6)
        assert "Bodies 'left' and 'right' overlap by 0.002 at (1" in found[0].text
