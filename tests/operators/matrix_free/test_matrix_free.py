"""Boundary equations by iteration: the answers of the direct solver, in steps that do not grow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.geometry import BoundaryMesh
from bemkit.model.prepared import prepare
from bemkit.operators.collocation.equations import CollocationEquations, collocation_border
from bemkit.operators.collocation.images import collocation_equations
from bemkit.operators.collocation.layers import Constants
from bemkit.operators.hierarchy.system import HierarchicalSystem, NodeConditions
from bemkit.operators.linear.dense import SingularMatrixError
from bemkit.operators.linear.solvers import MatrixFree
from bemkit.operators.material import Material
from bemkit.operators.matrix_free.coarse_equations import ElementGroups
from bemkit.operators.matrix_free.preconditioner import Preconditioner
from bemkit.operators.matrix_free.straight_elements import StraightElements, pairs
from bemkit.operators.matrix_free.system import MatrixFreeSystem, NotConvergedError, WholeBoundary
from bemkit.operators.matrix_free.traction_hierarchy import TractionHierarchy
from bemkit.operators.steklov_poincare.hierarchical import HierarchicalCollocation
from tests.operators.hierarchy.test_system import MATERIAL, SHAPES, conditions_of, graded, mesh_of, system_of
from tests.scenes import paper
from tests.slow import slow_except

NOTHING = np.zeros(0, np.intp)
EMPTY = NodeConditions(np.zeros((0, 2, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2)))


def iterated(mesh: BoundaryMesh, frame: FloatArray, tolerance: float = 1e-10, slopes: bool = True) -> MatrixFreeSystem:
    return MatrixFreeSystem(mesh, MATERIAL, frame, MatrixFree(tolerance), slopes=slopes)


def held(mesh: BoundaryMesh, seed: int = 1) -> NodeConditions:
    """Runs of elements held along both, one or none of two turned directions, under loads."""
    conditions, force, _ = conditions_of(mesh, seed)
    traction = np.einsum("nkc,nc->nk", conditions.frame, force) / mesh.lengths[:, None]
    return NodeConditions.given(conditions.is_fixed, traction, conditions.displacement)


def clamped(mesh: BoundaryMesh) -> NodeConditions:
    """The lowest side held, a load on the rest."""
    is_held = np.isclose(mesh.centres[:, 1], mesh.nodes[:, 1].min())
    both = np.repeat(is_held[:, None], 2, axis=1)
    return NodeConditions.given(both, np.where(both, 0.0, np.cos(mesh.centres)), np.zeros_like(mesh.centres))


def solved(system: HierarchicalSystem, conditions: NodeConditions) -> tuple[FloatArray, FloatArray]:
    system.state(system.laws(conditions), NOTHING, EMPTY)
    return system.everywhere()


@pytest.mark.parametrize("slopes", slow_except([True, False], True))
@pytest.mark.parametrize("name", slow_except(SHAPES, "strip", "hole"))
def test_answers_are_those_of_the_direct_solver(name: str, slopes: bool) -> None:
    mesh = mesh_of(name, 400)
    frame = conditions_of(mesh, 1)[0].frame
    system = iterated(mesh, frame, slopes=slopes)
    answers = solved(system, held(mesh)), solved(system_of(mesh, frame, slopes, 1e-12), held(mesh))
    # tractions are large where supports jump, and displacements err with them
    size = np.abs(answers[1][0]).max() / MATERIAL.plane_modulus
    for own, exact, unit in zip(*answers, (MATERIAL.plane_modulus, 1.0), strict=True):
        # a hundred times the tolerance, as `MatrixFree.accuracy` says
        assert np.abs(own - exact).max() < 1e-8 * size * unit
    places = np.arange(0, 400, 7)
    assert np.abs(system.residual(places, *answers[0])).max() < 1e-9 * size
    assert np.abs(system.residual(places, 1.01 * answers[0][0], answers[0][1])).max() > 1e-6 * size


def test_graded_meshes() -> None:
    mesh = graded(120, 4.0)
    frame = np.tile(np.eye(2), (mesh.n_elements, 1, 1))
    system = iterated(mesh, frame)
    answers = solved(system, clamped(mesh)), solved(system_of(mesh, frame, True, 1e-12), clamped(mesh))
    assert np.abs(answers[0][1] - answers[1][1]).max() < 1e-8 * np.abs(answers[1][1]).max()
    # 13 for the mean of all equations and one for the largest; with kinks in the prolongations of tractions 15 and more
    assert system.steps[0] <= 14


@pytest.mark.parametrize("most", slow_except((1600, 6400), 1600))
def test_steps_do_not_grow_with_the_number_of_elements(most: int) -> None:
    steps = []
    for n in (400, most):
        mesh = mesh_of("rectangle", n)
        system = iterated(mesh, np.tile(np.eye(2), (n, 1, 1)), 3e-10)
        solved(system, clamped(mesh))
        steps.append(system.steps[0])
    # without groups 34 at 400 elements and 38 at 1600, with kinks in the prolongations of tractions 14 and 18
    assert 8 < min(steps)
    assert max(steps) <= 13


def test_responses_begin_with_the_last_one() -> None:
    mesh = mesh_of("rectangle", 400)
    system = iterated(mesh, np.tile(np.eye(2), (400, 1, 1)))
    conditions = clamped(mesh)
    solved(system, conditions)
    solved(system, conditions)
    assert len(system.steps) == 1  # nothing has changed
    conditions.value[200] *= 1.0 + 1e-6
    assert conditions.value[200].any()
    solved(system, conditions)
    assert system.steps[1] < 0.8 * system.steps[0]


def test_steps_that_do_not_suffice() -> None:
    mesh = mesh_of("rectangle", 400)
    system = MatrixFreeSystem(mesh, MATERIAL, np.tile(np.eye(2), (400, 1, 1)), MatrixFree(1e-10, 3), slopes=True)
    with pytest.raises(NotConvergedError, match=r"3 steps of GMRES leave .* above the tolerance 1e-10: allow more"):
        solved(system, clamped(mesh))


def test_conditions_that_hold_nothing() -> None:
    mesh = mesh_of("rectangle", 400)
    free = NodeConditions.given(np.zeros((400, 2), bool), np.zeros((400, 2)), np.zeros((400, 2)))
    system = iterated(mesh, np.tile(np.eye(2), (400, 1, 1)))
    with pytest.raises(SingularMatrixError, match="on groups of elements is singular"):
        solved(system, free)


def test_groups_lose_no_digits_on_fine_meshes() -> None:
    # the LU of the transposed equations of these groups has pivots up to 1e7 and leaves 1e-9, this one 1e-15
    scene = bk.load_scene("paper-1")
    mesh = replace(scene, mesh=replace(scene.mesh, elements=20_000)).build_mesh()
    mesh = BoundaryMesh((mesh.nodes - 0.5) / mesh.diameter, mesh.elements)
    material = Material(1.0, 0.2)
    side = np.repeat(np.arange(4), 5_000)
    is_held = np.stack([side <= 1, side == 0], axis=1)
    nothing = np.zeros_like(mesh.centres)
    system = iterated(mesh, np.tile(np.eye(2), (mesh.n_elements, 1, 1)))
    laws = system.laws(NodeConditions.given(is_held, nothing, nothing))
    inverse = Preconditioner.of(StraightElements.of(mesh, material, takes_slopes=True), material, laws, system._frame)
    right = np.cos(np.arange(2.0 * len(inverse.groups.middle) + 4.0) / 10.0)
    unknowns = inverse.coarse.solve(right)
    assert np.abs(inverse.coarse.solve(3.0 * right) / 3.0 - unknowns).max() < 1e-12 * np.abs(unknowns).max()


@pytest.mark.parametrize("slopes", [True, False])
@pytest.mark.parametrize("name", ["hole", "exterior"])
def test_what_is_not_stored_of_the_whole_boundary(name: str, slopes: bool) -> None:
    mesh = mesh_of(name, 100)
    n, elements = mesh.n_elements, StraightElements.of(mesh, MATERIAL, takes_slopes=slopes)
    own = WholeBoundary.of(elements, MATERIAL)
    stored = collocation_border(mesh, MATERIAL, np.arange(n), takes_slopes=slopes)
    random = np.random.default_rng(1)
    unknowns, (traction, displacement) = random.standard_normal(own.n_unknowns), random.standard_normal((2, n, 2))
    equations = np.zeros(n, complex)
    own.add_errors(unknowns, equations)
    np.testing.assert_allclose(pairs(equations).ravel(), stored.errors @ unknowns)
    t, u = (each @ [1.0, 1j] for each in (traction, displacement))
    exact = stored.balances @ np.concatenate([traction, displacement], axis=1).ravel()
    np.testing.assert_allclose(own.balances(t, *elements.reconstructed(u)), exact, rtol=1e-11)


def test_slopes_that_are_not_stored() -> None:
    mesh = mesh_of("hole", 100)
    equations = collocation_equations(mesh, MATERIAL, np.arange(mesh.n_elements), takes_slopes=True)
    assert isinstance(equations, CollocationEquations)
    displacement = np.random.default_rng(0).standard_normal((mesh.n_elements, 2))
    _, *exact = equations.densities(displacement, displacement)
    found = StraightElements.of(mesh, MATERIAL, takes_slopes=True).reconstructed(displacement @ [1.0, 1j])
    np.testing.assert_allclose(found, exact, rtol=1e-12)


def test_groups_are_short_where_conditions_change_and_their_number_hardly_grows() -> None:
    counts = []
    for n in (1000, 20_000):
        mesh = mesh_of("rectangle", n)
        kind = (mesh.centres[:, 0] > mesh.nodes[:, 0].mean()).astype(int)
        groups = ElementGroups.of(mesh, kind)
        counts.append(groups.middle.size)
        assert np.array_equal(groups.group[groups.middle], np.arange(counts[-1]))
        assert (
            len({(group, kind) for group, kind in zip(groups.group.tolist(), kind.tolist(), strict=True)}) == counts[-1]
        )
        ends = np.flatnonzero(kind != np.roll(kind, 1))
        assert (np.bincount(groups.group)[groups.group[ends]] == 1).all()
    assert counts[1] < 2.5 * counts[0]


def test_there_are_few_groups_however_often_conditions_change() -> None:
    mesh = mesh_of("rectangle", 8000)
    assert ElementGroups.of(mesh, np.arange(8000) // 2 % 2).middle.size <= 1200
    hole = mesh_of("hole", 8000)
    groups = ElementGroups.of(hole, np.zeros(8000, int))
    assert len(groups.mesh.loops) == 2
    assert groups.mesh.lengths.sum() == pytest.approx(hole.lengths.sum(), rel=1e-3)  # chords of the hole


def test_the_hierarchy_inverts_the_single_layer_on_waves() -> None:
    n = 512
    constants = Constants.of(MATERIAL, 1.0)
    is_traction = np.tile([True, False], (n, 1))
    inverse = TractionHierarchy.of(is_traction, np.roll(np.arange(n), -1), np.full(n, 1.0 / n), constants)
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
