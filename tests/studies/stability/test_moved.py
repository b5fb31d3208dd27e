"""Moved scenes are the same scenes; degenerate sizes are those that closed forms and published numbers give."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import bemkit as bk
from bemkit.geometry.meshing.discretise import discretise
from bemkit.studies.stability.axes import degenerate_diameters
from bemkit.studies.stability.case import Case
from bemkit.studies.stability.similarity import Similarity
from bemkit.studies.stability.sweep import difference
from bemkit.studies.stability.transform import AffineMap, transformed_scene, with_gap_offset, with_turned_loads
from tests.scenes import FLOOR, block, small_paper_scene

SIMILARITY = Similarity(length=3.0, modulus=70.0, stress=11.0, shift=(5.0, -7.0))


def disc() -> bk.Scene:
    """A disc on a plane with curved elements, a formula for friction, and a prescribed motion."""
    return bk.Scene(
        title="disc",
        shape=bk.Disk(1.0, centre=(0.0, 1.0)),
        material=bk.Material(1.0, 0.3, bk.Plane.STRESS),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("arc-3", "arc-4"), where=bk.Expression("y < 0.5")),
            bk.Part("press", bk.PrescribedDisplacement(x=0.0, y=-0.01), ("arc-1", "arc-2"), bk.Expression("y > 1.8")),
        ),
        law=bk.Coulomb(bk.Expression("0.2 + x**2")),
        mesh=bk.MeshOptions(64),
    )


@pytest.mark.parametrize("scene", [small_paper_scene(1), disc()], ids=["paper-1", "disc"])
def test_results_of_a_similar_scene_follow_by_its_factors(scene: bk.Scene) -> None:
    one, other = bk.run(scene), bk.run(SIMILARITY.apply(scene))
    assert difference(one, other, SIMILARITY) <= 1e-10  # a shift of a few diameters costs a digit or two
    assert other.linear_solves == one.linear_solves
    assert other.energy == pytest.approx(
        one.energy * SIMILARITY.stress * SIMILARITY.displacement * SIMILARITY.length, rel=1e-9
    )
    assert difference(one, other, Similarity(stress=11.0)) > 0.1


def test_interference_scales_like_every_other_length() -> None:
    raised = bk.Part("floor", bk.Contact(bk.RigidHalfPlane(point=(0.0, 1e-3))), sides=("bottom",))
    scene = block(raised, bk.Part("top", bk.Clamped(), sides=("top",)))
    one, other = bk.run(scene), bk.run(SIMILARITY.apply(scene))
    # displacements of a clamped body scale with the gap alone, and tractions with E gap / size
    assert np.abs(one.contact.sigma_n).max() > 1e-4
    assert difference(one, other, SIMILARITY) <= 1e-10


def test_a_stretched_scene_is_the_scene_of_the_stretched_shape() -> None:
    press = bk.Part("press", bk.Pressure(bk.Expression("1 + x")), ("top",), bk.Expression("x > 0.25"))
    wall = bk.Part("wall", bk.Roller(), sides=("right",))
    stretched = bk.run(transformed_scene(block(FLOOR, press, wall), AffineMap((3.0, 1.0)), displacement=1.0))
    press = bk.Part("press", bk.Pressure(bk.Expression("1 + x / 3")), ("top",), bk.Expression("x > 0.75"))
    direct = bk.run(block(FLOOR, press, wall, shape=bk.Rectangle(3.0, 1.0)))
    np.testing.assert_allclose(stretched.contact.sigma_n, direct.contact.sigma_n, atol=1e-12)


def test_a_stretched_circle_is_an_ellipse() -> None:
    scene = transformed_scene(disc(), AffineMap((2.0, 1.0)), displacement=1.0)
    nodes = scene.build_mesh().nodes
    np.testing.assert_allclose((nodes[:, 0] / 2.0) ** 2 + (nodes[:, 1] - 1.0) ** 2, 1.0, rtol=1e-12)


def test_gap_offsets_and_turned_loads() -> None:
    wall = bk.Part("wall", bk.Roller(), sides=("right",))
    scene = block(FLOOR, wall, bk.Part("top", bk.Traction(y=-1.0), sides=("top",)), law=bk.Frictionless())
    one, lowered = bk.run(scene), bk.run(with_gap_offset(scene, 0.5))
    np.testing.assert_allclose(lowered.contact.u_n - one.contact.u_n, 0.5, rtol=1e-10)
    turned = bk.run(with_turned_loads(scene, np.pi / 3.0))
    assert turned.force_normal == pytest.approx(0.5, rel=1e-10)
    as_pressure = dataclasses.replace(scene, parts=(FLOOR, wall, bk.Part("top", bk.Pressure(1.0), sides=("top",))))
    assert difference(turned, bk.run(with_turned_loads(as_pressure, np.pi / 3.0)), Similarity()) <= 1e-12


def test_levels_halve_the_elements_at_corners_and_ends_of_parts() -> None:
    scene = small_paper_scene(1)
    counts = [Case(1.0, scene, levels=levels).mesh(scene).n_elements for levels in (0, 1, 2)]
    # four corners and two ends of loads, an element on either side of each
    assert np.diff(counts).tolist() == [12, 12]


@pytest.mark.parametrize(
    ("shape", "poisson_ratio", "diameter"),
    [
        (bk.Rectangle(1.0, 1.0), 0.2, 2.1116510 * np.sqrt(2.0)),
        (bk.Rectangle(1.0, 1.0), 0.3, 2.2131882 * np.sqrt(2.0)),
        (bk.Rectangle(0.5, 1.0), 0.2, 2.6828907 * np.hypot(0.5, 1.0)),
        (bk.Rectangle(3.0, 1.0), 0.2398328, np.hypot(3.0, 1.0)),
        (bk.Disk(1.0), 0.3, 1.3201928 * 2.0 * np.sqrt(2.0)),
    ],
)
def test_degenerate_sizes_are_the_known_ones(shape: bk.Rectangle, poisson_ratio: float, diameter: float) -> None:
    mesh = discretise(shape.outline(), n_elements=160, grading=bk.Algebraic(3.0))
    found = degenerate_diameters(mesh, bk.Material(1.0, poisson_ratio))
    # the discretisation error of V with constant elements on a graded mesh; the 3 x 1 rectangle has two such sizes
    assert np.abs(found / diameter - 1.0).min() <= 2e-4
