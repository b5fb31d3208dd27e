"""Friction coefficients, loads and given displacements that jump inside an element."""

from __future__ import annotations

from dataclasses import replace

import pytest

import bemkit as bk
from bemkit.scene.toml import with_overrides
from tests.scenes import paper


def warned(coefficient: bk.Expression, scene: bk.Scene | bk.Scene) -> list[str]:
    solution = bk.run(replace(scene, law=bk.Coulomb(coefficient)))
    return [str(each) for each in solution.warnings if each.kind == "jump of friction"]


@pytest.mark.parametrize("elements", [bk.ConstantCollocation(), bk.Galerkin(1), bk.Galerkin(2)])
def test_a_jump_inside_an_element_is_named_with_its_place(elements: bk.Galerkin | bk.ConstantCollocation) -> None:
    scene = paper(2, elements, bk.MeshOptions(elements=60))
    (text,) = warned(bk.Expression("where(x < 0.234, 0.2, 0.9)"), scene)
    assert text.startswith("Friction of contact 'foundation' jumps at (0.234, 0), inside an element: divide"), text


@pytest.mark.parametrize("formula", ["0.1 + 0.3 * x", "0.2 + 0.2 * tanh(40 * (x - 0.25))", "where(x < 99, 0.2, 0.9)"])
def test_what_varies_without_a_jump_is_not(formula: str) -> None:
    assert not warned(bk.Expression(formula), paper(2, bk.Galerkin(1), bk.MeshOptions(elements=60)))


def test_a_jump_between_two_bodies_is_named() -> None:
    scene = with_overrides(bk.load_scene("pin-in-plate"), elements=60)
    texts = warned(bk.Expression("where(x < 0.15, 0.1, 0.6)"), scene)
    assert texts
    assert all("Friction of contact 'pin.surface / plate.hole' jumps at (" in text for text in texts), texts
    assert all("jumps at (0.15, " in text for text in texts), texts


def test_a_jump_where_a_part_ends_is_none() -> None:
    """Two parts that meet there, each with its own law, as the warning advises."""
    scene = paper(2, bk.Galerkin(1), bk.MeshOptions(elements=60))
    contact = next(part for part in scene.parts if part.name == "foundation")
    halves = tuple(
        bk.Part(name, bk.Contact(bk.RigidHalfPlane(), bk.Coulomb(friction)), contact.sides, bk.Expression(where))
        for name, friction, where in (("left", 0.2, "x < 0.234"), ("right", 0.9, "x >= 0.234"))
    )
    others = tuple(part for part in scene.parts if part is not contact)
    solution = bk.run(replace(scene, parts=(*halves, *others)))
    assert not [each for each in solution.warnings if each.kind == "jump of friction"]


def test_a_jump_between_two_pieces_of_a_part_is_none() -> None:
    pads = bk.Part("pads", bk.Contact(bk.RigidHalfPlane()), ("bottom",), bk.Expression("abs(x - 2) > 1"))
    scene = bk.Scene(
        title="Two pads",
        shape=bk.Rectangle(4.0, 1.0),
        material=bk.Material(1.0, 0.3),
        parts=(pads, bk.Part("top", bk.PrescribedDisplacement(0.002, -0.01), ("top",))),
        discretisation=bk.Galerkin(1),
        mesh=bk.MeshOptions(elements=80),
    )
    assert not warned(bk.Expression("where(x < 2, 0.2, 0.9)"), scene)
    assert warned(bk.Expression("where(x < 0.7, 0.2, 0.9)"), scene)


def pushed(
    condition: bk.Traction | bk.Pressure | bk.PrescribedDisplacement, mesh: bk.MeshOptions | None = None
) -> bk.Scene:
    """A block of 2 by 1 on a smooth floor, its nodes at multiples of 1/6."""
    return bk.Scene(
        title="Block",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(1.0, 0.3),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), ("bottom",)),
            bk.Part("wall", bk.Roller(), ("left",)),
            bk.Part("top", condition, ("top",)),
        ),
        discretisation=bk.Galerkin(1),
        mesh=bk.MeshOptions(elements=36) if mesh is None else mesh,
    )


def jumps_of(scene: bk.Scene) -> list[str]:
    return [str(each) for each in bk.run(scene).warnings if each.kind.startswith("jump of")]


@pytest.mark.parametrize(
    ("condition", "kind"),
    [
        (bk.Traction(y=bk.Expression("where(x < 1.237, -0.01, 0)")), "load"),
        (bk.Pressure(bk.Expression("0.01 + 0.002 * sign(1.237 - x)")), "load"),
        (bk.PrescribedDisplacement(y=bk.Expression("where(x < 1.237, -0.01, -0.02)")), "displacement"),
    ],
)
def test_a_load_that_jumps_inside_an_element_is_named_with_its_place(
    condition: bk.Traction | bk.Pressure | bk.PrescribedDisplacement, kind: str
) -> None:
    (text,) = jumps_of(pushed(condition))
    assert text.startswith(f"Part 'top': the {kind} jumps at (1.237, 1), inside an element: divide the part"), text


def test_a_narrow_load_that_quadrature_misses_is_named() -> None:
    """Half of the load lies on a tenth of an element, between the points of quadrature: its force is lost."""
    scene = pushed(bk.Traction(y=bk.Expression("-0.01 - where(1.03 < x < 1.05, 1, 0)")))
    assert bk.run(scene).force_normal == pytest.approx(0.02, rel=1e-9)  # a sum of 36 numbers; 0.04 is right
    assert len(jumps_of(scene)) == 2


@pytest.mark.parametrize(
    "formula", ["-0.01 * (1 + x)", "-0.01 * (1 + tanh(20 * (x - 1.2)))", "where(x < 1, -0.01, 0)", "0.01 * sin(pi * x)"]
)
def test_a_load_that_jumps_at_a_node_or_nowhere_is_not(formula: str) -> None:
    assert not jumps_of(pushed(bk.Traction(y=bk.Expression(f"{formula} - 0.02"))))


def test_a_jump_that_matters_little_is_not() -> None:
    """A tenth of the load on an element of a hundredth of the side: at most 1e-3 of the load is wrong."""
    load = bk.Traction(y=bk.Expression("where(x < 1.237, -0.01, -0.0112)"))
    assert jumps_of(pushed(load))
    assert not jumps_of(pushed(load, bk.MeshOptions(elements=150, density={"top": 30.0})))


@pytest.mark.parametrize(("formula", "n_jumps"), [("where(x < 0.737, 0, 1e-3)", 1), ("1e-3 * abs(x - 0.737)", 0)])
def test_gaps_that_jump_are_named(formula: str, n_jumps: int) -> None:
    block = pushed(bk.Traction(y=-0.01))
    gap = bk.Part("floor", bk.Contact(bk.Gap(bk.Expression(formula))), ("bottom",))
    texts = jumps_of(replace(block, parts=(gap, *block.parts[1:])))
    assert [text.startswith("Part 'floor': the gap jumps at (0.737, 0), inside") for text in texts] == n_jumps * [True]
    lower = bk.Body(
        name="lower", shape=bk.Rectangle(2.0, 1.0, (0.0, -1.0)), material=bk.Material(1.0, 0.3),
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
    )  # fmt: skip
    upper = bk.Body(name="upper", shape=block.shape, material=lower.material, parts=block.parts[1:])
    pair = bk.ContactPair(("upper.bottom", "lower.top"), gap=bk.Expression(formula))
    mesh = bk.MeshOptions(elements=36)
    texts = jumps_of(bk.Scene(title="Two", bodies=(lower, upper), contacts=(pair,), law=bk.Frictionless(), mesh=mesh))
    start = "Contact 'upper.bottom / lower.top': the gap jumps at (0.737, 0), inside"
    assert [text.startswith(start) for text in texts] == n_jumps * [True]
