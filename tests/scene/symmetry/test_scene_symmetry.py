"""Symmetric scenes are recognised, others are refused with the place and the remedy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.errors import GeometryError
from bemkit.geometry.spaces import LinearSpace
from bemkit.geometry.symmetry.images import element_images
from bemkit.scene.symmetry import AsymmetricSceneError, find_symmetry
from tests.scenes import EccentricRing, square, squeezed
from tests.slow import slow_only

HALF = bk.Symmetry(x=0.5)


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        (square(), HALF),
        (squeezed(bk.Disk(1.0)), bk.Symmetry(x=0.0, y=0.0)),
        (squeezed(bk.Ring(0.5, 1.0)), bk.Symmetry(x=0.0, y=0.0)),
        (squeezed(bk.Disk(1.0), law=bk.Coulomb(bk.Expression("0.3 + 0.1 * y"))), bk.Symmetry(x=0.0)),
        (squeezed(EccentricRing((0.0, 0.3))), bk.Symmetry(x=0.0)),
        (squeezed(EccentricRing((0.4, 0.3))), None),
        (squeezed(bk.ExteriorOf(bk.Disk(1.0))), None),
        (bk.load_scene("paper-1"), None),
        (bk.load_scene("paper-2"), None),
    ],
)
def test_lines_are_found(scene: bk.Scene, expected: bk.Symmetry | None) -> None:
    assert find_symmetry(scene.only) == expected


def test_a_scene_whose_formula_fails_has_no_line() -> None:
    scene = changed(square(), "top load", bk.Traction(y=bk.Expression("log(x - 0.5)")))
    assert find_symmetry(scene.only) is None


def changed(scene: bk.Scene, name: str, condition: object) -> bk.Scene:
    """Return a scene with another condition on one of its parts."""
    parts = tuple(replace(part, condition=condition) if part.name == name else part for part in scene.parts)
    return replace(scene, parts=parts)


def held(left: object, right: object) -> bk.Scene:
    return changed(changed(square(), "left load", left), "right load", right)


ASYMMETRIC = {
    "load": (
        changed(square(), "right load", bk.Traction(x=bk.Expression("-3 * y**2 * (1 - y)**2"))),
        r"the traction is \(.*\) at \(1, .*\) and \(.*\) at its image \(0, ",
    ),
    "load along the line": (changed(square(), "top load", bk.Traction(x=1.0)), r"the traction is \(1, 0\) at"),
    "load left out": (
        replace(square(), parts=square().parts[:3]),
        r"the traction is \(0, 0\) at \(1, .*\) and \(.*\) at its image \(0, ",
    ),
    "gap": (
        changed(square(), "foundation", bk.Contact(bk.Gap(bk.Expression("0.1 * x")))),
        r"the gap is .* at \(.*\) and .* at its image",
    ),
    "friction": (
        square(law=bk.Coulomb(bk.Expression("0.1 + x"))),
        r"the friction bound at the pressure 0.011 is .* and .* at its image",
    ),
    "kind": (
        held(bk.Clamped(), bk.Roller()),
        r"the boundary is on rollers at \(1, .*\) and clamped at its image \(0, ",
    ),
    "displacement": (
        held(bk.PrescribedDisplacement(x=0.1), bk.PrescribedDisplacement(x=0.1)),
        r"the displacement is \(0.1, 0\) at \(1, .*\) and \(0.1, 0\) at its image",
    ),
    "components": (
        held(bk.PrescribedDisplacement(x=0.0), bk.PrescribedDisplacement(x=0.0, y=0.0)),
        "the boundary is displaced along x and y at .* and displaced along x at its image",
    ),
    "shape": (
        square(shape=bk.Polygon(((0, 0), (1, 0), (1, 1), (0, 0.9)), ("bottom", "right", "top", "left"))),
        r"the image \(.*\) of the boundary point \(.*\) lies .* away from the boundary",
    ),
}


@pytest.mark.parametrize("case", ASYMMETRIC)
def test_what_is_not_symmetric_is_refused(case: str) -> None:
    scene, message = ASYMMETRIC[case]
    with pytest.raises(AsymmetricSceneError, match=f"not symmetric about x = 0.5: .*{message}"):
        replace(scene, symmetry=HALF).build_mesh()


@pytest.mark.parametrize("x", slow_only([0.4, -0.4], -0.4))
def test_a_hole_on_one_side_only_is_refused(x: float) -> None:
    centre = (x, 0.0)
    scene = squeezed(EccentricRing(centre), symmetry=bk.Symmetry(x=0.0))
    with pytest.raises(AsymmetricSceneError, match="away from the boundary"):
        scene.build_mesh()


def test_a_narrow_difference_is_seen_on_the_elements() -> None:
    bump = bk.Expression("where(x > 0.7 and x < 0.705, -1, -0.5)")  # between the places of the quick look
    scene = changed(square(mesh=bk.MeshOptions(elements=800)), "top load", bk.Traction(y=bump))
    assert find_symmetry(scene.only) == HALF
    with pytest.raises(AsymmetricSceneError, match="the traction is"):
        replace(scene, symmetry=HALF).build_mesh()


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        (
            square(symmetry=bk.Symmetry(x=5.0)),
            r"the line x = 5 does not cross the body, .* between \(0, 0\) and \(1, 1\)",
        ),
        (square(symmetry=bk.Symmetry(x=0.5, y=-1.0)), "the line y = -1 does not cross the body"),
        (square(symmetry=bk.Symmetry(x=1.0)), "side 'right' lies on the line x = 1: describe the whole body"),
        (squeezed(bk.ExteriorOf(bk.Disk(1.0)), symmetry=bk.Symmetry(x=0.0)), "the body is an exterior"),
        (
            square(symmetry=HALF, mesh=bk.MeshOptions(elements=40, density={"right": 2.0})),
            "density names the side 'right', which lies beyond .* name its image among the sides bottom, left, top",
        ),
        (
            square(symmetry=HALF, mesh=bk.MeshOptions(elements=4)),
            "n_elements is 4: symmetry leaves 2 elements for 3 pieces .* give at least 6",
        ),
    ],
)
def test_lines_that_do_not_halve_the_body_are_refused(scene: bk.Scene, message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        scene.build_mesh()


@pytest.mark.parametrize("place", [{}, {"x": np.inf}, {"y": np.nan}])
def test_a_symmetry_needs_a_line(place: dict[str, float]) -> None:
    with pytest.raises(GeometryError, match=r"neither x nor y is given|give a finite number"):
        bk.Symmetry(**place)


def test_scene_and_mesh_must_have_the_same_lines() -> None:
    half = square(symmetry=HALF).build_mesh()
    with pytest.raises(AsymmetricSceneError, match=r"the scene has none, the mesh x = 0.5: give both the same"):
        bk.run(square(), mesh=half)
    with pytest.raises(AsymmetricSceneError, match=r"the scene has x = 0.5, the mesh none"):
        bk.run(square(symmetry=HALF), mesh=square().build_mesh())


def test_later_scenes_of_a_history_must_be_symmetric_too() -> None:
    first = square(symmetry=HALF)
    second = changed(first, "left load", bk.Traction(x=bk.Expression("y**2 * (1 - y)**2")))
    with pytest.raises(AsymmetricSceneError, match="the traction is"):
        bk.run([first, second])
    with pytest.raises(ValueError, match=r"symmetry is None: keep x = 0.5"):
        bk.run([first, replace(first, symmetry=None)])


def test_images_need_symmetric_local_nodes() -> None:
    class Lopsided(LinearSpace):
        @property
        def local_nodes(self) -> np.ndarray:  # type: ignore[override]
            return np.array([-1.0, 0.5])

    with pytest.raises(
        GeometryError, match=r"Lopsided has the local nodes \[-1.0, 0.5\], which its image does not have"
    ):
        list(element_images(Lopsided(square(symmetry=HALF).build_mesh())))
