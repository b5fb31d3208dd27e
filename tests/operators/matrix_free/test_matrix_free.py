"""Boundary equations by iteration: the answers of the direct solver, in steps that do not grow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.geometry import BoundaryMesh
from bemkit.model.prepared import prepare
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.collocation.equations import CollocationEquations, collocation_equations
from bemkit.operators.collocation.layers import Constants
from bemkit.operators.hierarchy.system import HierarchicalSystem
from bemkit.operators.hierarchy.system import solved as solve_conditions
from bemkit.operators.linear_solvers import MatrixFree, SingularMatrixError
from bemkit.operators.material import Material
from bemkit.operators.matrix_free.coarse_equations import ElementGroups
from bemkit.operators.matrix_free.factor import IterativeFactor, NotConvergedError
from bemkit.operators.matrix_free.preconditioner import Preconditioner
from bemkit.operators.matrix_free.traction_hierarchy import TractionHierarchy
from bemkit.operators.steklov_poincare.hierarchical import HierarchicalCollocation
from tests.operators.hierarchy.test_system import MATERIAL, SHAPES, conditions_of, graded, mesh_of, system_of
from tests.scenes import paper
from tests.slow import slow_except

NOTHING = np.zeros(0, np.intp)
ACCURATE = MatrixFree(1e-10)
EMPTY = LinearConditions(np.zeros((0, 2, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2)))


def iterated(
    mesh: BoundaryMesh, frame: FloatArray, options: MatrixFree = ACCURATE, slopes: bool = True
) -> tuple[HierarchicalSystem, IterativeFactor]:
    factor = IterativeFactor(mesh, MATERIAL, options, takes_slopes=slopes)
    return HierarchicalSystem(factor, frame, mesh.diameter / mesh.n_elements / MATERIAL.plane_modulus), factor


def held(mesh: BoundaryMesh, seed: int = 1) -> LinearConditions:
    """Runs of elements held along both, one or none of two turned directions, under loads."""
    conditions, force, _ = conditions_of(mesh, seed)
    traction = np.einsum("nkc,nc->nk", conditions.frame, force) / mesh.lengths[:, None]
    return LinearConditions.given(conditions.is_fixed, traction, conditions.displacement)


def clamped(mesh: BoundaryMesh) -> LinearConditions:
    """The lowest side held, a load on the rest."""
    is_held = np.isclose(mesh.centres[:, 1], mesh.nodes[:, 1].min())
    both = np.repeat(is_held[:, None], 2, axis=1)
    return LinearConditions.given(both, np.where(both, 0.0, np.cos(mesh.centres)), np.zeros_like(mesh.centres))


def solved(system: HierarchicalSystem, conditions: LinearConditions) -> tuple[FloatArray, FloatArray]:
    system.state(system.local_conditions(conditions), NOTHING, EMPTY)
    return system.full_state()


@pytest.mark.parametrize("slopes", slow_except([True, False], True))
@pytest.mark.parametrize("name", slow_except(SHAPES, "hole"))
def test_answers_are_those_of_the_direct_solver(name: str, slopes: bool) -> None:
    mesh = mesh_of(name, 240)
    frame = conditions_of(mesh, 1)[0].frame
    system, _ = iterated(mesh, frame, slopes=slopes)
    answers = solved(system, held(mesh)), solved(system_of(mesh, frame, slopes, 1e-12), held(mesh))
    # tractions are large where supports jump, and displacements err with them
    size = np.abs(answers[1][0]).max() / MATERIAL.plane_modulus
    for own, exact, unit in zip(*answers, (MATERIAL.plane_modulus, 1.0), strict=True):
        # a hundred times the tolerance, as `MatrixFree.accuracy` says
        assert np.abs(own - exact).max() < 1e-8 * size * unit
    places = np.arange(0, 240, 7)
    assert np.abs(system.residual(places, *answers[0])).max() < 1e-9 * size
    assert np.abs(system.residual(places, 1.01 * answers[0][0], answers[0][1])).max() > 1e-6 * size


@pytest.mark.slow
def test_graded_meshes() -> None:
    mesh = graded(120, 4.0)
    frame = np.tile(np.eye(2), (mesh.n_elements, 1, 1))
    system, factor = iterated(mesh, frame)
    answers = solved(system, clamped(mesh)), solved(system_of(mesh, frame, True, 1e-12), clamped(mesh))
    assert np.abs(answers[0][1] - answers[1][1]).max() < 1e-8 * np.abs(answers[1][1]).max()
    # 13 for the mean of all equations and one for the largest; with kinks in the prolongations of tractions 15 and more
    assert factor.steps[0] <= 14


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [1e-2, 1e4])
def test_springs_and_friction(stiffness: float) -> None:
    """Below springs, t + k E' u = 0, beside them t_1 = 0.3 t_2 without moving across, elsewhere loads."""
    mesh = mesh_of("rectangle", 240)
    is_low, is_side = (np.isclose(mesh.centres[:, k], mesh.nodes[:, k].min()) for k in (1, 0))
    on_traction = np.tile(np.eye(2), (240, 1, 1))
    on_displacement = np.where(is_low, stiffness * MATERIAL.plane_modulus, 0.0)[:, None, None] * np.eye(2)
    on_traction[is_side] = [[1.0, -0.3], [0.0, 0.0]]
    on_displacement[is_side] = [[0.0, 0.0], [0.0, 1.0]]
    value = np.where((is_low | is_side)[:, None], 0.0, np.cos(mesh.centres))
    conditions, frame = LinearConditions(on_displacement, on_traction, value), np.tile(np.eye(2), (240, 1, 1))
    system, factor = iterated(mesh, frame)
    answers = solved(system, conditions), solved(system_of(mesh, frame, True, 1e-12), conditions)
    for own, exact in zip(*answers, strict=True):
        assert np.abs(own - exact).max() < 1e-8 * np.abs(exact).max()  # a hundred times the tolerance
    assert factor.steps[0] < 25


@pytest.mark.slow
@pytest.mark.parametrize("most", [600, 1600, 6400])
def test_steps_do_not_grow_with_the_number_of_elements(most: int) -> None:
    steps = []
    for n in (300, most):
        mesh = mesh_of("rectangle", n)
        system, factor = iterated(mesh, np.tile(np.eye(2), (n, 1, 1)), MatrixFree(3e-10))
        solved(system, clamped(mesh))
        steps.append(factor.steps[0])
    # without groups 34 at 400 elements and 38 at 1600, with kinks in the prolongations of tractions 14 and 18
    assert 8 < min(steps)
    assert max(steps) <= 13


def test_responses_begin_with_the_last_one() -> None:
    mesh = mesh_of("rectangle", 240)
    system, factor = iterated(mesh, np.tile(np.eye(2), (240, 1, 1)))
    conditions = clamped(mesh)
    solved(system, conditions)
    solved(system, conditions)
    assert len(factor.steps) == 1  # nothing has changed
    conditions.value[120] *= 1.0 + 1e-6
    assert conditions.value[120].any()
    solved(system, conditions)
    assert factor.steps[1] < 0.8 * factor.steps[0]


def test_steps_that_do_not_suffice() -> None:
    mesh = mesh_of("rectangle", 240)
    system, _ = iterated(mesh, np.tile(np.eye(2), (240, 1, 1)), MatrixFree(1e-10, 3))
    with pytest.raises(
        NotConvergedError, match=r"after 3 steps of GMRES, above the tolerance 1e-10: increase max_steps"
    ):
        solved(system, clamped(mesh))


def test_conditions_that_hold_nothing() -> None:
    mesh = mesh_of("rectangle", 240)
    free = LinearConditions.given(np.zeros((240, 2), bool), np.zeros((240, 2)), np.zeros((240, 2)))
    system, _ = iterated(mesh, np.tile(np.eye(2), (240, 1, 1)))
    with pytest.raises(SingularMatrixError, match="on groups of elements is singular"):
        solved(system, free)


@pytest.mark.slow
def test_groups_lose_no_digits_on_fine_meshes() -> None:
    # the LU of the transposed equations of these groups has pivots up to 1e7 and leaves 1e-9, this one 1e-15
    scene = bk.load_scene("paper-1")
    mesh = replace(scene, mesh=replace(scene.mesh, elements=20_000)).build_mesh()
    mesh = BoundaryMesh((mesh.nodes - 0.5) / mesh.diameter, mesh.elements)
    material = Material(1.0, 0.2)
    side = np.repeat(np.arange(4), 5_000)
    is_held = np.stack([side <= 1, side == 0], axis=1)
    nothing = np.zeros_like(mesh.centres)
    local = solve_conditions(LinearConditions.given(is_held, nothing, nothing), 1.0)
    equations = collocation_equations(mesh, material, np.arange(mesh.n_elements), takes_slopes=True)
    assert isinstance(equations, CollocationEquations)
    inverse = Preconditioner(mesh, material, equations, local, 1.0)
    right = np.cos(np.arange(2.0 * len(inverse.groups.middle) + 4.0) / 10.0)
    unknowns = inverse.coarse.solve(right)
    assert np.abs(inverse.coarse.solve(3.0 * right) / 3.0 - unknowns).max() < 1e-12 * np.abs(unknowns).max()


def test_groups_are_short_where_conditions_change_and_their_number_hardly_grows() -> None:
    counts = []
    for n in (500, 10_000):
        mesh = mesh_of("rectangle", n)
        kind = (mesh.centres[:, 0] > mesh.nodes[:, 0].mean()).astype(int)
        groups = ElementGroups(mesh, kind)
        counts.append(groups.middle.size)
        assert np.array_equal(groups.group[groups.middle], np.arange(counts[-1]))
        assert (
            len({(group, kind) for group, kind in zip(groups.group.tolist(), kind.tolist(), strict=True)}) == counts[-1]
        )
        ends = np.flatnonzero(kind != np.roll(kind, 1))
        assert (np.bincount(groups.group)[groups.group[ends]] == 1).all()
    assert counts[1] < 2.5 * counts[0]


@pytest.mark.slow
def test_there_are_few_groups_however_often_conditions_change() -> None:
    mesh = mesh_of("rectangle", 8000)
    assert ElementGroups(mesh, np.arange(8000) // 2 % 2).middle.size <= 1200
    hole = mesh_of("hole", 8000)
    groups = ElementGroups(hole, np.zeros(8000, int))
    assert len(groups.mesh.loops) == 2
    assert groups.mesh.lengths.sum() == pytest.approx(hole.lengths.sum(), rel=1e-3)  # chords of the hole


def test_the_hierarchy_inverts_the_single_layer_on_waves() -> None:
    n = 512
    constants = Constants.of(MATERIAL, 1.0)
    is_traction = np.tile([True, False], (n, 1))
    inverse = TractionHierarchy(is_traction, np.roll(np.arange(n), -1), np.full(n, 1.0 / n), constants)
    ratios = []
    for number in (4, 16, 64, 128, 192):
        wave = np.cos(2.0 * np.pi * number * np.arange(n) / n)
        kappa = 3.0 - 4.0 * MATERIAL.poisson_ratio
        caused = constants.single * np.pi * kappa / (2.0 * np.pi * number) * wave
        found = inverse.apply(caused)
        ratios.append(float(found @ wave / (wave @ wave)))
        # with kinks in the prolongations 0.94
        assert found @ wave > 0.995 * np.linalg.norm(found) * np.linalg.norm(wave)
    # a twentieth from the inverse at all frequencies; with the finest level as heavy as the others a fifth
    assert 0.94 < min(ratios)
    assert max(ratios) < 1.06


@pytest.mark.parametrize(
    ("options", "words"), [((1e-12,), "from 1e-11"), ((1e-9,), "to 3e-10"), ((1e-10, 0), "max_steps is 0")]
)
def test_options_out_of_range(options: tuple[float, int], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        MatrixFree(*options)


def test_no_stiffness_is_condensed_without_stored_equations() -> None:
    scene = paper(1, bk.ConstantCollocation(), replace(paper(1).mesh, elements=240))
    given = prepare(scene, scene.build_mesh()).bodies[0]
    elastic = HierarchicalCollocation(given.own_mesh.unit, given.material, bk.MatrixFree())
    with pytest.raises(
        bk.errors.InputError, match="MatrixFree forms no stiffness: condense this body with Hierarchical"
    ):
        elastic.condense(given.conditions, given.force)
