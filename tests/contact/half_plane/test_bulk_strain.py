"""A cylinder under bulk stress: the stick zone moves, see Hills and Nowell, Mechanics of Fretting Fatigue."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.testing import check_solution
from tests.slow import slow_only

# incompressible on a rigid cylinder: pressures do not shear
MATERIAL, FRICTION, RADIUS, HALF_WIDTH = bk.Material(1.0, 0.5), 0.4, 1.0, 0.05
MODULUS = MATERIAL.plane_modulus
LOAD = np.pi * MODULUS * HALF_WIDTH**2 / (4.0 * RADIUS)
PRESSURE = MODULUS * HALF_WIDTH / (2.0 * RADIUS)


def specimen(strain: float, n_elements: int = 500, **changes: object) -> bk.Scene:
    pressed = bk.FarField(force_x=0.0, force_y=LOAD, turn=0.0)
    shear = 0.5 * FRICTION * LOAD
    steps = (bk.Step(1.0), bk.Step(2.0, {"far.force_x": f"{shear} * (t - 1)", "far.strain": f"{strain} * (t - 1)"}))
    scene = bk.Scene(
        title="fretting",
        shape=bk.ElasticHalfPlane(-1.2 * HALF_WIDTH, 1.2 * HALF_WIDTH),
        material=MATERIAL,
        law=bk.Coulomb(FRICTION),
        parts=(bk.Part("zone", bk.Contact(bk.Gap(bk.Expression("x**2 / 2")))),),
        far=pressed,
        steps=steps,
        mesh=bk.MeshOptions(elements=n_elements),
    )
    return replace(scene, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize("share", slow_only([0.1, -0.2], 0.1))
def test_the_stick_zone_is_shifted_by_bulk_stress(share: float) -> None:
    """By a sigma / (2 s p0); its half-width is that without bulk stress, a sqrt(1 - Q / (s P))."""
    stress = 2.0 * share * FRICTION * PRESSURE
    _, last = bk.run([specimen(stress / MODULUS)])
    assert last.is_converged, last.message
    outer = np.array([place.x for place in last.transitions])[[0, -1]]
    stick = [place.x for place in last.transitions if abs(abs(place.x) - HALF_WIDTH) > 0.05 * HALF_WIDTH]
    assert np.abs(outer) == pytest.approx([HALF_WIDTH, HALF_WIDTH], rel=1e-3)
    assert len(stick) == 2
    assert abs(np.mean(stick)) == pytest.approx(abs(share) * HALF_WIDTH, abs=1e-3 * HALF_WIDTH)
    assert 0.5 * np.ptp(stick) == pytest.approx(np.sqrt(0.5) * HALF_WIDTH, rel=2e-3)
    assert np.sign(np.mean(stick)) == -np.sign(share)


def test_fields_below_contain_the_bulk_stress() -> None:
    *_, last = bk.run([specimen(0.01, 200)])
    fields = bk.interior_fields(last)
    deep = np.array([[0.3, -1e5 * HALF_WIDTH], [-20.0, -2e5 * HALF_WIDTH]])
    np.testing.assert_allclose(fields.stress(deep)[:, 0, 0], 0.01 * MODULUS, rtol=1e-4)
    np.testing.assert_allclose(fields.strain(deep)[:, 0, 0], 0.01, rtol=1e-4)
    assert check_solution(last).is_good


def test_strain_scales_with_units_and_load_factors() -> None:
    far = bk.FarField(strain=0.02, centre=(1.0, 0.0))
    assert far.scaled(0.5).strain == 0.01
    scene = specimen(0.0, 60, steps=(), far=replace(far, force_y=LOAD, x=0.0, centre=(0.0, 0.0)))
    plain = bk.run(scene)
    larger = replace(
        scene,
        shape=bk.ElasticHalfPlane(-1200.0 * HALF_WIDTH, 1200.0 * HALF_WIDTH),
        material=bk.Material(1e-6, 0.5),
        far=replace(scene.far, force_y=1e-3 * LOAD),
        parts=(bk.Part("zone", bk.Contact(bk.Gap(bk.Expression("x**2 / 2000")))),),
    )
    other = bk.run(larger)
    np.testing.assert_allclose(other.contact.sigma_t, 1e-6 * plain.contact.sigma_t, atol=1e-9 * 1e-6)
    np.testing.assert_allclose(other.boundary.displacement, 1e3 * plain.boundary.displacement, atol=1e-8)


def test_what_cannot_be_strained_is_named() -> None:
    with pytest.raises(bk.InputError, match="strain is inf: give a finite number"):
        bk.FarField(strain=np.inf)
    rough = bk.load_scene("rough-surface")
    with pytest.raises(bk.InputError, match=r"far.strain is 0.1: a strained surface does not repeat: remove it"):
        replace(rough, far=bk.FarField(force_y=1e-3, strain=0.1))
