"""The load under which von Mises' stress first reaches the yield stress."""

from __future__ import annotations

from dataclasses import replace

import pytest

import bemkit as bk
from bemkit.results.stress_mesh import largest_equivalent_stress
from tests.perforated_plate import NOMINAL, plate


def test_a_sheared_block_yields_beside_its_support() -> None:
    scene = bk.Scene(
        title="block",
        shape=bk.Rectangle(1.0, 1.0, (2.0, 0.0)),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)), bk.Part("load", bk.Traction(x=1.0), ("top",))),
        mesh=bk.MeshOptions(elements=8),
        discretisation=bk.Galerkin(1),
    )
    found = bk.first_yield(scene, 2.0 * largest_equivalent_stress(bk.run(scene).body).value)
    assert found.load_factor == pytest.approx(2.0, rel=1e-9)  # round-off: stresses are in proportion to the load
    assert found.y < 0.5
    assert 2.0 <= found.x <= 3.0


@pytest.mark.slow
def test_a_plate_yields_at_its_hole() -> None:
    scene = plate(is_biaxial=False, mesh=bk.MeshOptions(elements=48), discretisation=bk.Galerkin(6))
    found = bk.first_yield(scene, 12.0)
    assert found.load_factor == pytest.approx(12.0 / (3.0 * NOMINAL), rel=1e-3)
    assert abs(found.x) < 1e-6
    assert abs(found.y) == pytest.approx(1.0)


@pytest.mark.slow  # a plate yields quickly; here the root is found among stresses that do not follow the load
def test_below_a_contact_the_stress_follows_a_power_of_the_load() -> None:
    """A disc on a plane [Johnson1985, 4.4]: 0.56 p_0 for nu = 0.3 at a depth of 0.7 half widths, p_0 ~ force**0.5."""
    scene = bk.Scene(
        title="disc",
        shape=bk.Disk(1.0, (0.0, 1.0)),
        material=bk.Material(100.0, 0.3),
        parts=(
            bk.Part("contact", bk.Contact(bk.RigidHalfPlane()), ("arc-3", "arc-4")),
            bk.Part("load", bk.Traction(y=-0.05), ("arc-1", "arc-2")),
        ),
        law=bk.Frictionless(),
        symmetry=bk.Symmetry(x=0.0),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(accuracy=1e-2, rising_degrees=True),
    )
    one = largest_equivalent_stress(bk.run(scene).body)
    found = bk.first_yield(scene, 2.0**0.5 * one.value, rtol=1e-2)
    assert found.load_factor == pytest.approx(2.0, rel=0.03)  # the contact is 6 % of the radius wide
    assert 0.0 < found.y < 0.2
    pressure = float(-found.solution.contact.sigma_n.min())
    assert 2.0**0.5 * one.value == pytest.approx(0.56 * pressure, rel=0.03)


def test_what_cannot_yield_is_refused() -> None:
    scene = bk.load_scene("disc-between-plates")
    assert isinstance(scene, bk.Scene)
    scene = replace(scene, mesh=bk.MeshOptions(elements=24))
    with pytest.raises(bk.InputError, match=r"the largest stress does not follow the load: 0\.0551"):
        bk.first_yield(scene, 0.05)
    with pytest.raises(bk.InputError, match=r"yield_stress is -1\.0: give a positive stress"):
        bk.first_yield(scene, -1.0)
    with pytest.raises(bk.InputError, match="the scene has several load steps: give first_yield a scene with a single"):
        bk.first_yield(replace(scene, load_factors=(0.5, 1.0)), 1.0)
    with pytest.raises(bk.InputError, match="the scene has no stress under its load"):
        bk.first_yield(replace(scene, parts=(bk.Part("held", bk.Clamped(), ("end",)),), law=bk.Frictionless()), 1.0)
