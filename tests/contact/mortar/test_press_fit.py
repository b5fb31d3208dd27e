"""A disc pressed into a ring: uniform pressure on any meshes, also on symmetry lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.mortar.facing import is_non_mortar
from bemkit.contact.mortar.sides import ContactSide
from bemkit.model.placed import place
from tests.slow import slow_except, slow_only

FRICTION = bk.Coulomb(0.3)
DISC, RING = (tuple(f"{side}-{k}" for k in range(1, 5)) for side in ("arc", "inner"))


def press_fit(n_elements: int, symmetry: bk.Symmetry | None, law: bk.FrictionLaw = FRICTION) -> bk.Scene:
    """Return a quarter, or all, of a disc that is 1e-3 larger than the hole of a ring."""
    material = bk.Material(1.0, 0.3)
    disc, ring = (
        bk.Body(name=name, shape=shape, material=material, parts=(bk.Part("fit", bk.Free(), sides=sides),))
        for name, shape, sides in (("disc", bk.Disk(1.0005), DISC), ("ring", bk.Ring(0.9995, 2.0), RING))
    )
    fit = bk.ContactPair(("disc.fit", "ring.fit"), law=law, interference=1.5e-3, reach=0.1)
    return bk.Scene(
        title="press fit",
        bodies=(disc, ring),
        contacts=(fit,),
        symmetry=symmetry,
        discretisation=bk.Galerkin(1),
        mesh=bk.MeshOptions(elements=n_elements),
    )


@pytest.mark.parametrize("law", slow_except([FRICTION, bk.Frictionless()], FRICTION))
@pytest.mark.parametrize("n_elements", slow_only([80, 160, 320], 160, 320))
def test_the_pressure_of_a_press_fit_is_uniform(n_elements: int, law: bk.FrictionLaw) -> None:
    solution = bk.run(press_fit(n_elements, bk.Symmetry(x=0.0, y=0.0), law))
    table = solution.contact
    mean = np.average(table.sigma_n, weights=table.weight)
    # equal numbers of elements on unequal perimeters: lengths of 1 to 1.5 where half of the rim's elements remain
    assert np.abs(table.sigma_n / mean - 1.0).max() < 2e-3
    # Lame: the ring in plane strain under an internal pressure, the disc under that pressure all around
    radius, modulus, nu = 1.0, 1.0, 0.3
    of_ring = (1.0 + nu) / modulus * radius * ((1.0 - 2.0 * nu) + 4.0) / 3.0  # (b^2 = 4) / (b^2 - a^2 = 3)
    of_disc = (1.0 + nu) * (1.0 - 2.0 * nu) / modulus * radius
    assert -mean == pytest.approx(1e-3 / (of_ring + of_disc), rel=20.0 / n_elements**1.5)


@pytest.mark.slow
def test_nodes_on_symmetry_lines_stick_like_their_neighbours() -> None:
    solution = bk.run(press_fit(160, bk.Symmetry(x=0.0, y=0.0)))
    assert set(solution.contact.status_words()) == {"stick"}
    assert not solution.transitions
    assert solution.friction_bound.min() > 0.99 * solution.friction_bound.max()
    ends = [0, -1]
    assert not solution.contact.sigma_t[ends].any()
    assert not solution.contact.u_t[ends].any()


@pytest.mark.parametrize("numbers", [(80, 80), (40, 111), (97, 33)])
def test_curved_linear_sides_that_fit_have_multipliers_on_the_coarser_one(numbers: tuple[int, int]) -> None:
    """In either order; without friction and one centre, and for other degrees, on the finer one."""
    # where a density is given, lengths are not matched
    meshes = [bk.MeshOptions(n, density={side: 1.0}) for n, side in zip(numbers, (DISC[0], RING[0]), strict=True)]
    fit = press_fit(80, None)
    bodies = tuple(replace(body, mesh=mesh) for body, mesh in zip(fit.bodies, meshes, strict=True))
    sides = [ContactSide(body.space, body.mesh.part("fit")) for body in place(replace(fit, bodies=bodies))]
    is_first = bool(sides[0].lengths.mean() > sides[1].lengths.mean())
    assert is_non_mortar(*sides, has_friction=True) == is_first
    assert is_non_mortar(*sides[::-1], has_friction=True) != is_first
    assert is_non_mortar(*sides) == is_first
    shifted = place(replace(fit, bodies=(replace(bodies[0], placement=bk.Placement((1e-3, 0.0))), bodies[1])))
    assert is_non_mortar(*(ContactSide(body.space, body.mesh.part("fit")) for body in shifted)) != is_first
    quadratic = place(replace(fit, bodies=bodies, discretisation=bk.Galerkin(2)))
    sides = [ContactSide(body.space, body.mesh.part("fit")) for body in quadratic]
    assert is_non_mortar(*sides, has_friction=True) != is_first
