"""Elements of equal lengths on curved sides that fit, so that a uniform pressure is uniform with linear elements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.model.placed import place
from bemkit.results.contact_table import ContactTable
from bemkit.scene.discretisation import Discretisation
from tests.slow import slow_except, slow_only

MATERIAL = bk.Material(1.0, 0.3)


def rings(law: bk.FrictionLaw, radius: float = 1.0, **options: object) -> bk.Scene:
    """Two rings, one 1e-3 too large for the other, and an inner radius of the outer one."""
    held = bk.PrescribedDisplacement(bk.Expression("3e-4 * x"), bk.Expression("3e-4 * y"))
    inner = bk.Body(name="inner", shape=bk.Ring(0.5, 1.0), material=MATERIAL)
    outer = bk.Body(name="outer", shape=bk.Ring(radius, 2.0), material=bk.Material(0.5, 0.2))
    outer = replace(outer, parts=(bk.Part("rim", held, ("outer",)),))
    settings = {"discretisation": bk.Galerkin(1), "mesh": bk.MeshOptions(elements=80)} | options
    return bk.Scene(
        title="press fit",
        bodies=(inner, outer),
        contacts=(bk.ContactPair(("inner.outer", "outer.inner"), gap=-1e-3),),
        law=law,
        **settings,  # type: ignore[arg-type]
    )


def sizes(scene: bk.Scene) -> list[int]:
    """Return the elements of both sides in contact."""
    sides = ("outer", "inner")
    return [body.mesh.part(side).size for body, side in zip(place(scene), sides, strict=True)]


HOLE = bk.PrescribedDisplacement(bk.Expression("1e-4 * x"), bk.Expression("1e-4 * y"))


def rings_on_a_shaft(law: bk.FrictionLaw) -> bk.Scene:
    """The same with a support in the hole of the inner ring instead of one around the outer ring."""
    scene = rings(law)
    inner, outer = scene.bodies
    return replace(scene, bodies=(replace(inner, parts=(bk.Part("hole", HOLE, ("inner",)),)), replace(outer, parts=())))


@pytest.mark.parametrize(
    ("turn", "law"),
    slow_except(
        [(turn, law) for turn in (0.0, 7.0) for law in (bk.Coulomb(0.2), bk.Frictionless())],
        (0.0, bk.Coulomb(0.2)),
    ),
)
@pytest.mark.parametrize(
    ("scene_of", "n_elements", "pressure"),
    # pressures of quadratic elements on 320 elements; unmatched elements miss the first by 1.3e-2 with friction
    slow_only(
        [(rings, 80, 1.8158e-4), (rings_on_a_shaft, 80, 2.5575e-4), (rings, 320, 1.8158e-4)], (rings, 320, 1.8158e-4)
    ),
)
def test_a_uniform_pressure_is_uniform(
    scene_of: Callable[[bk.FrictionLaw], bk.Scene], n_elements: int, pressure: float, turn: float, law: bk.FrictionLaw
) -> None:
    """Whichever ring may turn, and wherever its nodes are."""
    scene = replace(scene_of(law), mesh=bk.MeshOptions(n_elements))
    inner, outer = scene.bodies
    scene = replace(scene, bodies=(replace(inner, placement=bk.Placement(turn=turn)), outer))
    solution = bk.run(scene)
    table = solution.contact
    mean = np.average(table.sigma_n, weights=table.weight)
    # round-off of solves; on elements of 1 to 2 4e-4 with friction, 4e-2 without
    assert np.abs(table.sigma_n / mean - 1.0).max() < 1e-8
    assert mean == pytest.approx(-pressure, rel=3e-3)  # of elements on the holes
    # no more than the slip by the deformation of 1e-3, where friction does not choose the rotation
    assert np.abs(table.u_t).max() < 1e-8


def test_the_rest_of_a_boundary_keeps_half_of_its_elements() -> None:
    large = rings(bk.Coulomb(0.2), mesh=bk.MeshOptions(elements=80))
    inner, outer = large.bodies
    fine = replace(large, bodies=(replace(inner, mesh=bk.MeshOptions(elements=200)), outer))
    body = place(fine)[1]
    assert body.mesh.n_elements == 80
    assert [body.mesh.part(side).size for side in ("inner", "rim")] == [52, 28]  # 28 and 52 without the contact


def shifted(scene: bk.Scene) -> bk.Scene:
    """The same with the inner ring away from the centre."""
    inner, outer = scene.bodies
    return replace(scene, bodies=(replace(inner, placement=bk.Placement((0.0, -1e-3))), outer))


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        (rings(bk.Coulomb(0.2)), [52, 52]),
        (rings(bk.Frictionless()), [52, 52]),
        (shifted(rings(bk.Frictionless())), [52, 28]),  # the inner ring would turn nearly freely
        (shifted(rings(bk.Coulomb(0.2))), [52, 52]),
        (rings(bk.Coulomb(0.2), discretisation=bk.ConstantCollocation()), [52, 52]),
        (rings(bk.Coulomb(0.2), discretisation=bk.Galerkin(2)), [52, 28]),
        (rings(bk.Coulomb(0.2), radius=1.05), [52, 28]),  # a gap: the sides do not fit
        (rings(bk.Coulomb(0.2), mesh=bk.MeshOptions(elements=80, grading=bk.Algebraic(1.5))), [52, 28]),
        (rings(bk.Coulomb(0.2), mesh=bk.MeshOptions(elements=80, density={"outer": 1.0})), [52, 28]),
    ],
)
def test_lengths_are_matched_only_for_low_degrees_on_sides_that_fit(scene: bk.Scene, expected: list[int]) -> None:
    assert sizes(scene) == expected


@pytest.mark.parametrize("mesh", [bk.MeshOptions(64), bk.MeshOptions(64, density={"outer": 1.0})])
@pytest.mark.parametrize("law", [bk.Frictionless(), bk.Coulomb(0.4)])
def test_constant_elements_carry_the_pressure_of_a_stiff_disc_in_a_soft_ring(
    mesh: bk.MeshOptions, law: bk.FrictionLaw
) -> None:
    """Lame; elements of the ring are matched, or four times as long and carry the multipliers."""
    disc = bk.Body(name="disc", shape=bk.Disk(0.5), material=bk.Material(10.0, 0.0))
    ring = bk.Body(name="ring", shape=bk.Ring(0.5, 1.5), material=bk.Material(1.0, 0.45), mesh=mesh)
    solution = bk.run(
        bk.Scene(
            title="press fit",
            bodies=(disc, ring),
            contacts=(bk.ContactPair(("disc.arc", "ring.inner"), gap=-1e-4),),
            symmetry=bk.Symmetry(x=0.0, y=0.0),
            law=law,
            discretisation=bk.ConstantCollocation(),
            mesh=bk.MeshOptions(64),
        )
    )
    modulus, ratio = 1.0 / (1.0 - 0.45**2), 0.45 / (1.0 - 0.45)
    pressure = 1e-4 / 0.5 / (1.0 / 10.0 + ((1.5**2 + 0.5**2) / (1.5**2 - 0.5**2) + ratio) / modulus)
    np.testing.assert_allclose(solution.contact.sigma_n, -pressure, rtol=1e-2)  # 1.0 without either


@pytest.mark.parametrize(
    ("upper_elements", "n_above", "mesh_below"),
    [
        (bk.ConstantCollocation(), 120, bk.MeshOptions(60)),
        (bk.Galerkin(1), 120, bk.MeshOptions(60)),
        # longer than those above in the middle, where contact is, but not in the mean
        (bk.ConstantCollocation(), 60, bk.MeshOptions(120, grading=bk.Algebraic(3.0))),
    ],
)
def test_longer_constant_elements_carry_the_pressure_of_shorter_ones(
    upper_elements: Discretisation, n_above: int, mesh_below: bk.MeshOptions
) -> None:
    """A block on a wider one, against quadratic elements; multipliers of the shorter elements are wrong by 30 %."""
    load = bk.Part("load", bk.Pressure(bk.Expression("1e-3 * (1 + 0.5 * x)")), ("top",))
    base = bk.Part("base", bk.Clamped(), ("bottom",))

    def pressed(above: Discretisation, below: Discretisation, n_above: int, mesh_below: bk.MeshOptions) -> ContactTable:
        upper = bk.Body(
            name="upper",
            shape=bk.Rectangle(2.0, 1.0, (-1.0, 0.0)),
            material=MATERIAL,
            parts=(load,),
            discretisation=above,
            mesh=bk.MeshOptions(n_above),
        )
        lower = bk.Body(
            name="lower",
            shape=bk.Rectangle(4.0, 1.0, (-2.0, -1.0)),
            material=MATERIAL,
            parts=(base,),
            discretisation=below,
            mesh=mesh_below,
        )
        contact = bk.ContactPair(("upper.bottom", "lower.top"))
        return bk.run(bk.Scene(title="p", bodies=(upper, lower), contacts=(contact,), law=bk.Coulomb(0.4))).contact

    exact = pressed(bk.Galerkin(2), bk.Galerkin(2), 120, bk.MeshOptions(200))
    table = pressed(upper_elements, bk.ConstantCollocation(), n_above, mesh_below)
    order, is_inside = np.argsort(exact.x), np.abs(table.x) < 0.8
    expected = np.interp(table.x, exact.x[order], exact.sigma_n[order])
    np.testing.assert_allclose(table.sigma_n[is_inside], expected[is_inside], atol=0.08 * np.abs(expected).mean())


def test_meshes_that_are_given_are_kept() -> None:
    scene = rings(bk.Coulomb(0.2))
    outer = scene.scene_of(scene.bodies[1]).divided(())
    inner_body, outer_body = place(scene, {"outer": outer})
    assert outer_body.own_mesh is outer
    assert inner_body.mesh.n_elements == 80
