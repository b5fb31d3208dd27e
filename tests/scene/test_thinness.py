"""The plan knows where collocation is weak."""

from __future__ import annotations

import numpy as np
import pytest

import bemkit as bk
from bemkit.geometry import discretise
from bemkit.geometry.neighbours import thicknesses
from bemkit.plan.plan import make_plan


def warned(shape: object, n: int, discretisation: object) -> tuple[str, ...]:
    scene = bk.Scene(
        title="thin",
        shape=shape,  # type: ignore[arg-type]
        material=bk.Material(1.0, 0.3),
        mesh=bk.MeshOptions(n),
        parts=(),
        discretisation=discretisation,  # type: ignore[arg-type]
    )
    return make_plan(scene, scene.build_mesh()).warnings


@pytest.mark.parametrize("symmetry", [None, bk.Symmetry(x=0.0, y=0.0)])
def test_thickness_of_a_ring_and_of_a_strip(symmetry: bk.Symmetry | None) -> None:
    half = {} if symmetry is None else {"symmetry": symmetry}
    ring = discretise(bk.Ring(0.9, 1.0).outline(), n_elements=160, **half)
    # the middles of the elements of the two circles are not opposite to each other: by an element of 0.04 at most
    assert thicknesses(ring).min() == pytest.approx(0.1, rel=1e-2)
    assert thicknesses(ring).max() < np.hypot(0.1, 0.04)
    strip = discretise(bk.Rectangle(10.0, 1.0, (-5.0, -0.5)).outline(), n_elements=88, **half)
    np.testing.assert_allclose(np.sort(thicknesses(strip))[: strip.n_elements // 2], 1.0, rtol=1e-12)


@pytest.mark.parametrize(
    ("shape", "n", "is_weak"),
    [
        (bk.Ring(0.8, 1.0), 40, True),
        (bk.Ring(0.8, 1.0), 120, False),
        (bk.Rectangle(50.0, 1.0), 80, True),
        (bk.Rectangle(50.0, 1.0), 240, False),
        (bk.Rectangle(1.0, 1.0), 8, False),
        (bk.Disk(1.0), 12, False),
        (bk.Polygon(((0.0, 0.0), (4.0, 0.0), (4.0, 1.0))), 60, False),
        (bk.ExteriorOf(bk.Rectangle(50.0, 1.0)), 80, False),
    ],
)
def test_collocation_of_thin_bodies_is_warned_of(shape: object, n: int, is_weak: bool) -> None:
    found = warned(shape, n, bk.ConstantCollocation())
    assert len(found) == is_weak
    if is_weak:
        assert "bends too stiffly: take" in found[0].text
    assert warned(shape, n, bk.Galerkin(1)) == ()


def test_the_warning_reaches_plan_and_solution() -> None:
    parts = (bk.Part("load", bk.Pressure(1.0), sides=tuple(f"outer-{k}" for k in range(1, 5))),)
    scene = bk.Scene(
        title="thin",
        shape=bk.Ring(0.8, 1.0),
        material=bk.Material(1.0, 0.3),
        mesh=bk.MeshOptions(40),
        parts=parts,
        law=bk.Frictionless(),
        discretisation=bk.ConstantCollocation(),
        symmetry=bk.Symmetry(x=0.0, y=0.0),
    )
    solution = bk.run(scene)
    assert any("bends too stiffly" in warning for warning in map(str, solution.plan.warnings))
    assert any("bends too stiffly" in warning for warning in map(str, solution.warnings))
