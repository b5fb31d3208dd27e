"""Collocation with one unknown for each dof: the answers of whole matrices, nothing computed that zero multiplies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.geometry import BoundaryMesh, Disk, PlateWithHole, Rectangle, Ring, discretise
from bemkit.geometry.neighbours import corner_nodes
from bemkit.operators.boundary import SteklovPoincareOperator
from bemkit.operators.collocation.corrections import Reciprocity
from bemkit.operators.counts import Entries
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import traction_free_modes
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from tests.operators.collocation_matrices import collocation_matrices
from tests.operators.test_curved import composite

MATERIAL = Material(2.0, 0.3)
MESHES = {
    "square": lambda: discretise(Rectangle(1.0, 1.0, (3.0, 1.0)).outline(), n_elements=24),
    "plate with hole": lambda: discretise(PlateWithHole(2.0, 1.5, 0.4, (-1.0, 0.3)).outline(), n_elements=36),
    "ring": lambda: discretise(Ring(1.0, 2.0).outline(), n_elements=40),
}


def any_conditions(mesh: BoundaryMesh, seed: int) -> NodalConditions:
    """Every kind of node side by side, in turned frames: the first half along the axes, the others anyhow."""
    rng = np.random.default_rng(seed)
    n = mesh.n_elements
    angle = np.where(np.arange(n) < n // 2, 0.5 * np.pi * rng.integers(0, 4, n), rng.uniform(0.0, 6.0, n))
    axis = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    frame = np.stack([axis, np.stack([-axis[:, 1], axis[:, 0]], axis=1)], axis=1)
    kind = rng.integers(0, 3, (n, 2))
    is_fixed, is_retained = kind == 1, kind == 2
    displacement = np.where(is_fixed & (rng.random((n, 2)) < 0.5), rng.normal(size=(n, 2)), 0.0)
    return NodalConditions(frame, is_fixed, displacement, is_retained)


def whole_equations(
    mesh: BoundaryMesh, conditions: NodalConditions, force: FloatArray, kept: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Solve the bordered equations with full matrices in x and y: unknown u, t and errors, all conditions as rows."""
    n = 2 * mesh.n_elements
    single, double = collocation_matrices(mesh, MATERIAL)[0], with_slopes(mesh)
    motions = traction_free_modes(mesh, mesh.centres)
    weights = np.repeat(mesh.lengths, 2)
    turn = np.zeros((n, n))
    for k, frame in enumerate(conditions.frame):
        turn[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = frame
    reciprocity = Reciprocity(mesh, MATERIAL, takes_slopes=True)
    errors = np.column_stack([motions, reciprocity.fields])
    order = 2 * n + errors.shape[1]
    system, right = np.zeros((order, order)), np.zeros(order)
    system[:n, :n], system[:n, n : 2 * n], system[:n, 2 * n :] = 0.5 * np.eye(n) + double, -single, errors
    is_free = conditions.is_free.ravel()
    held = np.where(conditions.is_fixed, conditions.displacement, 0.0).ravel()
    held[conditions.is_retained.ravel()] = kept
    system[n : 2 * n, :n] = np.where(is_free[:, None], 0.0, turn)
    system[n : 2 * n, n : 2 * n] = np.where(is_free[:, None], turn, 0.0)
    right[n : 2 * n] = np.where(is_free, turn @ (force.ravel() / weights), held)
    system[2 * n : 2 * n + 3, n : 2 * n] = (weights[:, None] * motions).T
    system[2 * n + 3 :, :n], system[2 * n + 3 :, n : 2 * n] = -reciprocity.on_displacement, reciprocity.on_traction
    solution = np.linalg.solve(system, right)
    return solution[:n].reshape(-1, 2), (weights * solution[n : 2 * n]).reshape(-1, 2)


def with_slopes(mesh: BoundaryMesh) -> FloatArray:
    """Return the double layer of displacements with slopes as one matrix."""
    return collocation_matrices(mesh, MATERIAL, takes_slopes=True)[1]


def slopes_of(mesh: BoundaryMesh) -> FloatArray:
    """Return the matrix (2 n, 2 n) of complex slopes, element by element from their definition."""
    x = mesh.centres @ np.array([1.0, 1j])
    is_corner = corner_nodes(mesh)
    result = np.zeros((2 * len(x), 2 * len(x)))
    for loop in mesh.loops:
        for here, i in enumerate(loop.tolist()):
            neighbours = [int(loop[here - 1]), int(loop[here + 1 - len(loop)])]
            is_same = ~is_corner[mesh.elements[i]]
            near = [i, *(j for j, is_one in zip(neighbours, is_same, strict=True) if is_one or not is_same.any())]
            arm = x[near] - x[near].mean()
            for j, c in zip(near, arm.conj() / np.sum(np.abs(arm) ** 2), strict=True):
                result[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] += [[c.real, -c.imag], [c.imag, c.real]]
    return result


def means_of(mesh: BoundaryMesh) -> FloatArray:
    """Return the matrix (2 n, 2 n) of the means of b (y - x)^2, b the leading coefficient of parabolas."""
    x = mesh.centres @ np.array([1.0, 1j])
    span = (mesh.tangents @ np.array([1.0, 1j])) * mesh.lengths
    is_corner = corner_nodes(mesh)
    result = np.zeros((2 * len(x), 2 * len(x)))
    for loop in mesh.loops:
        for here, i in enumerate(loop.tolist()):
            near = [int(loop[here - 1]), i, int(loop[here + 1 - len(loop)])]
            if is_corner[mesh.elements[i]].any():
                continue
            leading = np.linalg.inv(np.vander(x[near], 3))[0]
            for j, c in zip(near, leading * span[i] ** 2 / 12.0, strict=True):
                result[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] += [[c.real, -c.imag], [c.imag, c.real]]
    return result


def test_slopes_against_the_kernels_of_kelvin() -> None:
    mesh = MESHES["plate with hole"]()
    n, nu = mesh.n_elements, 0.3
    points, weights = composite(20)
    moments = np.zeros((n, 2, n, 2))
    for j in range(n):
        y, normal = (at(np.array([j]), points)[0] for at in (mesh.points, mesh.normals_at))
        measure = weights * mesh.jacobian(np.array([j]), points)[0]
        x, y_ = (y - mesh.centres[j]).T
        turned_by = np.array([[x, -y_], [y_, x]])  # the displacement g (y - x_j) of the slope g
        for i in set(range(n)) - {j}:
            r = y - mesh.centres[i]
            d = np.hypot(*r.T)
            across = np.einsum("pi,pi->p", r, normal) / d
            turned = np.einsum("pi,pj->ijp", r / d[:, None], normal)
            along = (1 - 2 * nu) * np.eye(2)[:, :, None] + 2 * np.einsum("pi,pj->ijp", r, r) / d**2
            kernel = -(across * along - (1 - 2 * nu) * (turned - turned.swapaxes(0, 1))) / (4 * np.pi * (1 - nu) * d)
            moments[i, :, j] = np.einsum("ijp,jkp,p->ik", kernel, turned_by, measure)
    _, double = collocation_matrices(mesh, MATERIAL)
    found = (with_slopes(mesh) - double).reshape(n, 2, n, 2)
    added = moments.reshape(2 * n, 2 * n) @ slopes_of(mesh) + double @ means_of(mesh)
    expected = added.reshape(n, 2, n, 2)
    # the moments on their own elements, which quadrature cannot give, act on the element and its neighbours
    rows, columns = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    near = np.zeros((n, n), bool)
    for loop in mesh.loops:
        for shift in (-1, 0, 1):
            near[loop, np.roll(loop, shift)] = True
    is_far = ~near[rows, columns]
    np.testing.assert_allclose(found.transpose(0, 2, 1, 3)[is_far], expected.transpose(0, 2, 1, 3)[is_far], atol=1e-13)
    assert np.abs(found.transpose(0, 2, 1, 3)[is_far]).max() > 1e-3


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("make", MESHES.values(), ids=MESHES)
def test_columns_give_what_whole_matrices_give(make: type, seed: int) -> None:
    mesh = make()
    conditions = any_conditions(mesh, seed)
    rng = np.random.default_rng(seed + 100)
    local = np.where(
        conditions.is_free & (rng.random((mesh.n_elements, 2)) < 0.5), rng.normal(size=(mesh.n_elements, 2)), 0
    )
    force = np.einsum("nkc,nk->nc", conditions.frame, local)
    kept = rng.normal(size=int(conditions.is_retained.sum()))
    u, f = CollocationElasticity(mesh, MATERIAL).condense(conditions, force).recover(kept)
    exact_u, exact_f = whole_equations(mesh, conditions, force, kept)
    # two different eliminations of one well-conditioned system
    np.testing.assert_allclose(u, exact_u, rtol=0.0, atol=1e-10 * np.abs(exact_u).max())
    np.testing.assert_allclose(f, exact_f, rtol=0.0, atol=1e-10 * np.abs(exact_f).max())


@pytest.mark.parametrize("loaded", [[], [7], [3, 7, 22], list(range(2, 40, 4))])
def test_supports_and_loads_in_patches_give_what_whole_matrices_give(loaded: list[int]) -> None:
    mesh = MESHES["ring"]()
    n = mesh.n_elements
    kind = np.repeat(np.arange(n) // 2 % 2, 2).reshape(n, 2)  # two elements held, two free, and so on
    kind[5] = 2
    frame, at_rest = np.broadcast_to(np.eye(2), (n, 2, 2)), np.zeros((n, 2))
    conditions = NodalConditions(frame, kind == 0, at_rest, kind == 2)
    force = at_rest.copy()
    force[loaded] = np.where(conditions.is_free[loaded], (0.3, -1.0), 0.0)
    opened = np.array([0.2, -0.1])
    u, f = CollocationElasticity(mesh, MATERIAL).condense(conditions, force).recover(opened)
    exact_u, exact_f = whole_equations(mesh, conditions, force, opened)
    # as above
    np.testing.assert_allclose(u, exact_u, rtol=0.0, atol=1e-10 * np.abs(exact_u).max())
    np.testing.assert_allclose(f, exact_f, rtol=0.0, atol=1e-10 * np.abs(exact_f).max())


def test_stiffness_and_load_are_those_of_the_retained_directions() -> None:
    mesh = MESHES["square"]()
    conditions = any_conditions(mesh, 3)
    force = np.einsum("nkc,nk->nc", conditions.frame, np.where(conditions.is_free, 1.0, 0.0))
    condensed = CollocationElasticity(mesh, MATERIAL).condense(conditions, force)
    kept = np.random.default_rng(3).normal(size=int(conditions.is_retained.sum()))
    _, f = condensed.recover(kept)
    local = np.einsum("nkc,nc->nk", conditions.frame, f)[conditions.is_retained]
    np.testing.assert_allclose(condensed.stiffness @ kept - condensed.load, local, rtol=0.0, atol=1e-11)


def test_only_columns_that_something_multiplies_are_computed() -> None:
    mesh = MESHES["square"]()  # six elements on each side
    nothing = np.zeros((24, 2), bool)
    is_fixed, is_retained = nothing.copy(), nothing.copy()
    is_fixed[mesh.normals[:, 0] > 0.5, 0] = True
    is_retained[mesh.normals[:, 1] < -0.5] = True
    frame = np.tile(np.eye(2), (24, 1, 1))
    conditions = NodalConditions(frame, is_fixed, np.zeros((24, 2)), is_retained)
    force = np.zeros((24, 2))
    force[mesh.normals[:, 1] > 0.5, 1] = -1.0
    work = CollocationElasticity(mesh, MATERIAL).condense(conditions, force).work
    # tractions of the bottom, the right side along x and the load; displacements but the right side's along x
    assert work.single_layer == Entries(computed=48 * (12 + 6 + 6), stored=48 * (12 + 6))
    assert work.double_layer == Entries(computed=48 * (48 - 6), stored=48 * (48 - 6))
    assert work.element_pairs == 24 * 24
    # 48 equations, three resultants and one reciprocity
    assert [each.order for each in work.factorisations] == [52]
    assert work.right_hand_sides == 12 + 1


def test_later_loads_are_swept_unless_they_are_multiples() -> None:
    mesh = MESHES["plate with hole"]()
    conditions = any_conditions(mesh, 5)
    rng = np.random.default_rng(5)
    none, displacement = np.zeros((36, 2)), np.where(conditions.is_fixed, rng.normal(size=(36, 2)), 0.0)
    force = np.einsum("nkc,nk->nc", conditions.frame, np.where(conditions.is_free, rng.normal(size=(36, 2)), 0.0))
    kept = rng.normal(size=int(conditions.is_retained.sum()))
    first = CollocationElasticity(mesh, MATERIAL).condense(replace(conditions, displacement=none), none)
    loaded = int(np.count_nonzero(conditions.is_free.any(axis=1)))
    # loads alone take their own columns, displacements all of them; multiples, zero among them, nothing at all
    steps = [
        (force, none, 36 * loaded),
        (force, displacement, 36 * 36),
        (-0.3 * force, -0.3 * displacement, 0),
        (none, none, 0),
        (2.0 * force, 2.0 * displacement, 0),
        (2.0 * force, displacement, 36 * 36),
    ]
    condensed = first
    for given, moved, n_pairs in steps:
        condensed = condensed.under(given, moved)
        assert condensed.work.element_pairs == n_pairs
        assert condensed.work.right_hand_sides == (n_pairs > 0)
        fresh = CollocationElasticity(mesh, MATERIAL).condense(replace(conditions, displacement=moved), given)
        for one, other in zip(condensed.recover(kept), fresh.recover(kept), strict=True):
            np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-11 * np.abs(other).max())
        np.testing.assert_allclose(condensed.load, fresh.load, rtol=0.0, atol=1e-11)


def left_on_rotation(mesh: BoundaryMesh, slopes: bool) -> float:
    matrix = SteklovPoincareOperator(CollocationElasticity(mesh, MATERIAL, slopes=slopes)).matrix()
    left = np.abs(matrix @ traction_free_modes(mesh, mesh.centres)).max(axis=0) / np.abs(matrix).max()
    assert left[:2].max() < 1e-12  # translations are exact up to round-off in any case
    return float(left[2])


@pytest.mark.parametrize("make", MESHES.values(), ids=MESHES)
def test_slopes_keep_rotations_and_their_absence_does_not(make: type) -> None:
    assert left_on_rotation(make(), slopes=True) < 1e-12  # round-off
    assert left_on_rotation(make(), slopes=False) > 1e-3


def test_slopes_raise_the_order_from_one_to_two() -> None:
    energies = {}
    for slopes in (True, False):
        energies[slopes] = []
        for n in (24, 48, 96):
            mesh = discretise(Disk(1.0).outline(), n_elements=n)
            elastic = CollocationElasticity(mesh, MATERIAL, slopes=slopes)
            theta = np.arctan2(*mesh.centres.T[::-1])
            u = np.column_stack([np.cos(2 * theta), np.sin(2 * theta)]).ravel()
            exact = 2 * np.pi * 4 * MATERIAL.shear_modulus / MATERIAL.kappa
            energies[slopes].append(abs(u @ SteklovPoincareOperator(elastic).matrix() @ u / exact - 1.0))
    for slopes, order in ((True, 2.0), (False, 1.0)):
        observed = np.log2(energies[slopes][-2] / energies[slopes][-1])
        assert abs(observed - order) < 0.25
    assert energies[True][-1] < 0.1 * energies[False][-1]
