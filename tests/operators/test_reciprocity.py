"""Betti's theorem for one exact field of each closed curve."""

from __future__ import annotations

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import ComplexArray, FloatArray
from bemkit.geometry import BoundaryMesh, Disk, ExteriorOf, PlateWithHole, Rectangle, Ring, discretise
from bemkit.operators.collocation.corrections import Reciprocity
from bemkit.operators.material import Material

POISSON_RATIOS = [0.0, 0.3, 0.4999999999, 0.5]
HOLED = PlateWithHole(2.0, 1.5, 0.4, (-1.0, 0.3))


def shear(mesh: BoundaryMesh, material: Material) -> tuple[FloatArray, FloatArray]:
    """Displacements and tractions of a uniform shear strain at the midpoints."""
    strain = np.array([[0.3, 0.5], [0.5, -0.3]])
    traction = 2.0 * material.shear_modulus * mesh.normals @ strain
    return (mesh.centres @ strain).ravel(), traction.ravel()


def quadratic(mesh: BoundaryMesh, material: Material) -> tuple[FloatArray, FloatArray]:
    """The same of the displacement conj(z^2), which has neither divergence nor curl."""
    normals = mesh.normals_at(np.arange(mesh.n_elements), np.zeros(1))[:, 0]
    z, n = mesh.centres @ np.array([1.0, 1j]), normals @ np.array([1.0, 1j])
    u, t = (z**2).conj(), 2.0 * material.shear_modulus * (2.0 * z * n).conj()
    return in_turn(u), in_turn(t)


def in_turn(values: ComplexArray) -> FloatArray:
    return np.stack([values.real, values.imag], axis=1).ravel()


@pytest.mark.parametrize("poisson_ratio", POISSON_RATIOS)
@pytest.mark.parametrize("takes_slopes", [True, False])
def test_uniform_shear_of_a_polygon(poisson_ratio: float, takes_slopes: bool) -> None:
    material = Material(2.0, poisson_ratio)
    mesh = discretise(Rectangle(2.0, 1.0, (3.0, 1.0)).outline(), n_elements=24)
    found = Reciprocity(mesh, material, takes_slopes=takes_slopes)
    u, t = shear(mesh, material)
    # tractions are constant and displacements linear on each element; a uniform dilatation sees only their means
    assert np.abs(found.on_traction @ t - found.on_displacement @ u).max() < 1e-13
    assert np.abs(found.on_displacement) @ np.abs(u) > 1.0


@pytest.mark.parametrize("poisson_ratio", POISSON_RATIOS)
@pytest.mark.parametrize("shape", [HOLED, Ring(0.5, 1.0)], ids=["plate with hole", "ring"])
def test_fields_of_a_body_with_a_hole_to_second_order(poisson_ratio: float, shape: PlateWithHole | Ring) -> None:
    material = Material(2.0, poisson_ratio)
    misses = []
    for n in (64, 128, 256):
        mesh = discretise(shape.outline(), n_elements=n)
        found = Reciprocity(mesh, material, takes_slopes=True)
        assert found.on_traction.shape == (2, 2 * n)
        u, t = quadratic(mesh, material)
        size = np.abs(found.on_displacement) @ np.abs(u)
        misses.append(np.abs(found.on_traction @ t - found.on_displacement @ u) / size)
    assert np.max(misses[0]) < 2e-2
    assert np.max(misses[2]) < np.max(misses[0]) / 10.0 + 1e-13  # 16 for the second order


@pytest.mark.parametrize("symmetry", [None, bk.Symmetry(x=0.0, y=0.0)])
def test_rigid_motions_and_resultants_are_no_volume(symmetry: bk.Symmetry | None) -> None:
    half = {} if symmetry is None else {"symmetry": symmetry}
    mesh = discretise(Ring(0.5, 1.0).outline(), n_elements=48, **half)
    found = Reciprocity(mesh, Material(2.0, 0.3), takes_slopes=True)
    if symmetry is None:
        x, y = mesh.centres.T
        motions = np.array([in_turn(np.ones_like(x) + 0j), in_turn(1j + 0.0 * x), in_turn(1j * (x + 1j * y))])
        assert np.abs(found.on_displacement @ motions.T).max() < 1e-13
    # a pressure in the hole: by the divergence theorem its work on the source is its flux, here 2 pi a each
    inner = np.hypot(*mesh.centres.T) < 0.75
    pressed = np.where(inner[:, None], -mesh.normals, 0.0).ravel()
    work = 2.0 * Material(2.0, 0.3).shear_modulus * found.on_traction @ pressed
    sources = 1 if symmetry is None else 4  # of one hole and of its images, which are the same here
    hole = int(np.argmin(mesh.loop_areas))
    # the mean of normals over an arc of 1/24 turn or more is 0.3 per cent short
    assert work[hole] == pytest.approx(2.0 * np.pi * 0.5 * sources, rel=1e-2)


def test_sources_lie_in_holes_of_any_shape_and_in_cavities() -> None:
    material = Material(2.0, 0.3)
    hook = bk.Polygon(((0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (2.0, 3.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)))
    # in the bends of the hook there is room for a circle of radius sqrt(2) / (1 + sqrt(2))
    for shape, least, most in ((hook, 0.5, 0.59), (Disk(1.0), 0.99, 1.0)):
        mesh = discretise(ExteriorOf(shape).outline(), n_elements=80)
        found = Reciprocity(mesh, material, takes_slopes=False)
        # a source outside of the hole would carry no volume through it
        flux = found.fields[:, 0] @ (mesh.lengths[:, None] * mesh.normals).ravel()
        assert 2.0 * np.pi * least < abs(flux) < 2.0 * np.pi * most


@pytest.mark.parametrize("begin", [1, 37])
def test_sources_do_not_depend_on_the_numbers_of_elements(begin: int) -> None:
    """Of more elements than the search takes: those that it took began at the first one."""
    mesh = discretise(ExteriorOf(Rectangle(2.0, 1.3)).outline(), n_elements=150)
    order = np.roll(np.arange(mesh.n_elements), begin)
    other = BoundaryMesh(mesh.nodes, mesh.elements[order], is_exterior=True, follows_outline=True)
    one, two = (Reciprocity(each, Material(2.0, 0.3), takes_slopes=False) for each in (mesh, other))
    for rows, permuted in ((one.on_traction, two.on_traction), (one.on_displacement, two.on_displacement)):
        np.testing.assert_allclose(permuted, rows.reshape(1, -1, 2)[:, order].reshape(1, -1), atol=1e-14)
