"""Two stiff bodies that touch each other between soft ones: motions of the soft size, strains of the stiff one."""

import numpy as np
import pytest

import bemkit as bk


def stack(ratio: float, law: bk.FrictionLaw) -> bk.Scene:
    """Return four slabs under pressure of which the two in the middle are stiffer, with meshes that do not match."""
    bodies = []
    for k, modulus in enumerate((1.0, ratio, ratio, 1.0)):
        parts = {0: (bk.Part("base", bk.Clamped(), ("bottom",)),), 3: (bk.Part("load", bk.Pressure(1e-3), ("top",)),)}
        slab = bk.Body(
            name=f"slab {k}",
            shape=bk.Rectangle(1.0, 0.5),
            material=bk.Material(modulus, 0.3),
            parts=parts.get(k, ()),
            placement=bk.Placement(shift=(0.0, 0.5 * k)),
            mesh=bk.MeshOptions(elements=24 + 2 * k),
        )
        bodies.append(slab)
    contacts = tuple(bk.ContactPair(sides=(f"slab {k + 1}.bottom", f"slab {k}.top")) for k in range(3))
    return bk.Scene(title="A stack", bodies=bodies, contacts=contacts, law=law, discretisation=bk.Galerkin(2))


@pytest.mark.parametrize(
    "law", [pytest.param(bk.Frictionless(), marks=pytest.mark.slow), bk.Coulomb(0.3)], ids=["frictionless", "coulomb"]
)
@pytest.mark.parametrize("ratio", [pytest.param(1e4, marks=pytest.mark.slow), 1e8])
def test_stiff_bodies_between_soft_ones_are_certified(ratio, law):
    solution = bk.run(stack(ratio, law))
    assert solution.is_converged, solution.message
    middle = next(force for force in solution.contacts if force.name.startswith("slab 2"))
    # displacements of 4e-3 hold 1e-18, which is 1e-7 of the forces at 1e8 times the modulus; the rest is the mesh's
    assert abs(middle.force_y) == pytest.approx(1e-3, rel=1e-9)
    assert solution.certificate.force_imbalance < 1e-14 * ratio + 1e-10


@pytest.mark.slow
def test_the_motion_of_stiff_bodies_is_that_of_the_soft_ones():
    few, many = (bk.run(stack(ratio, bk.Coulomb(0.3))) for ratio in (1e6, 1e8))
    for name in ("slab 0", "slab 3"):
        np.testing.assert_allclose(
            few.bodies[name].boundary.displacement, many.bodies[name].boundary.displacement, atol=1e-8
        )  # their strains differ by 1e-6 of 1e-3
