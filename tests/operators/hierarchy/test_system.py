"""Compressed equations under any conditions: the answers of dense ones, however the conditions change."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from bemkit.arrays import BoolArray, FloatArray
from bemkit.geometry import BoundaryMesh, ExteriorOf, PlateWithHole, Polygon, Rectangle, discretise
from bemkit.geometry.proximity.cluster_tree import ClusterTree
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.collocation.equations import collocation_equations
from bemkit.operators.hierarchy.factor import Factor, SingularClusterError
from bemkit.operators.hierarchy.system import HierarchicalSystem, LocalConditions, UndeterminedError
from bemkit.operators.linear_solvers import SingularMatrixError
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare.collocation import MixedSystem
from bemkit.operators.steklov_poincare.hierarchical import LEAF_SIZE
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from tests.slow import slow_except, slow_only

MATERIAL = Material(2.0, 0.3)
OCTAGON = Polygon(tuple((np.cos(a), np.sin(a)) for a in np.pi * (0.25 * np.arange(8) + 0.1)))
SHAPES = {
    "rectangle": Rectangle(1.0, 2.0),
    "strip": Rectangle(10.0, 0.3),
    "hole": PlateWithHole(2.0, 1.5, 0.4),
    "exterior": ExteriorOf(OCTAGON),
}


def mesh_of(name: str, n_elements: int) -> BoundaryMesh:
    mesh = discretise(SHAPES[name].outline(), n_elements=n_elements).unit
    return BoundaryMesh(mesh.nodes, mesh.elements, is_exterior=mesh.is_exterior)  # chords of the hole


def graded(n_side: int, power: float) -> BoundaryMesh:
    """A square whose elements shrink towards all corners."""
    half = 0.5 * np.linspace(0.0, 1.0, n_side // 2 + 1) ** power
    side = np.concatenate([half, 1.0 - half[-2:0:-1]])
    square = np.concatenate([side, 1.0 + 1j * side, 1.0 - side + 1j, 1j * (1.0 - side)])
    places = np.arange(square.size)
    return BoundaryMesh(np.stack([square.real, square.imag], axis=1), np.stack([places, np.roll(places, -1)], axis=1))


def conditions_of(mesh: BoundaryMesh, seed: int) -> tuple[NodalConditions, FloatArray, FloatArray]:
    """Runs of elements held, free and retained in turned frames; given forces; retained displacements."""
    rng, n = np.random.default_rng(seed), mesh.n_elements
    angle = np.repeat(rng.uniform(0.0, 6.0, n // 15 + 1), 15)[:n]
    axis = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    frame = np.stack([axis, np.stack([-axis[:, 1], axis[:, 0]], axis=1)], axis=1)
    kind = np.repeat(rng.integers(0, 3, (n // 15 + 1, 2)), 15, axis=0)[:n]
    is_fixed, is_retained = kind == 1, kind == 2
    conditions = NodalConditions(frame, is_fixed, np.where(is_fixed, np.sin(3.0 * mesh.centres), 0.0), is_retained)
    local = np.where(conditions.is_free, np.cos(2.0 * mesh.centres), 0.0) * mesh.lengths[:, None]
    kept = np.sin(0.1 * np.arange(np.count_nonzero(is_retained)))
    return conditions, np.einsum("nkc,nk->nc", frame, local), kept


def system_of(
    mesh: BoundaryMesh,
    frame: FloatArray,
    slopes: bool,
    tolerance: float,
    may_change: BoolArray | None = None,
    *,
    is_dense: bool = False,
) -> HierarchicalSystem:
    n, tree = mesh.n_elements, ClusterTree.of(mesh.centres, LEAF_SIZE)
    if is_dense:
        tree = ClusterTree(np.arange(n), np.array([0, n]), 0)
    equations = collocation_equations(mesh, MATERIAL, tree.order, takes_slopes=slopes)
    changing = None if may_change is None else may_change[tree.order]
    factor = Factor(equations, tree, tolerance, may_change=changing)
    return HierarchicalSystem(factor, frame, mesh.diameter / mesh.n_elements / MATERIAL.plane_modulus)


def local_conditions_of(
    system: HierarchicalSystem, mesh: BoundaryMesh, conditions: NodalConditions, force: FloatArray, kept: FloatArray
) -> LocalConditions:
    displacement = conditions.displacement.copy()
    displacement[conditions.is_retained] = kept
    traction = np.einsum("nkc,nc->nk", conditions.frame, force) / mesh.lengths[:, None]
    return system.local_conditions(LinearConditions.given(~conditions.is_free, traction, displacement))


NOWHERE = np.zeros(0, np.intp)
NOTHING = LinearConditions(np.zeros((0, 2, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2)))


@pytest.mark.parametrize("slopes", slow_except([True, False], True), ids=["slopes", "constant"])
@pytest.mark.parametrize("name", slow_only(SHAPES, "rectangle", "strip"))
def test_answers_are_those_of_dense_equations(name: str, slopes: bool) -> None:
    mesh = mesh_of(name, 160)
    conditions, force, kept = conditions_of(mesh, 3)
    dense = MixedSystem(mesh, MATERIAL, conditions, "body", force, slopes=slopes).condensed()
    displacement, all_force = dense.recover(kept)
    # round-off of LU is all that a single leaf adds
    for tolerance, is_dense in ((1e-6, False), (1e-11, False), (1e-13, True)):
        system = system_of(mesh, conditions.frame, slopes, tolerance, is_dense=is_dense)
        system.state(local_conditions_of(system, mesh, conditions, force, kept), NOWHERE, NOTHING)
        traction, found = system.full_state()
        expected = all_force / mesh.lengths[:, None]
        # two to four times the tolerance are found on all shapes
        assert np.abs(found - displacement).max() <= 20.0 * tolerance * np.abs(displacement).max()
        assert np.abs(traction - expected).max() <= 20.0 * tolerance * np.abs(expected).max()
        # and the residual says so
        left = system.residual(np.arange(0, mesh.n_elements, 7), traction, found)
        assert np.abs(left).max() <= 20.0 * tolerance * np.abs(found).max()


@pytest.mark.slow
def test_small_elements_of_graded_meshes_keep_their_digits() -> None:
    mesh = graded(150, 6.0)
    assert mesh.lengths.max() > 1e10 * mesh.lengths.min()
    conditions, force, kept = conditions_of(mesh, 3)
    displacement, all_force = (
        MixedSystem(mesh, MATERIAL, conditions, "body", force, slopes=True).condensed().recover(kept)
    )
    system = system_of(mesh, conditions.frame, True, 1e-8)
    system.state(local_conditions_of(system, mesh, conditions, force, kept), NOWHERE, NOTHING)
    traction, found = system.full_state()
    expected = all_force / mesh.lengths[:, None]
    # random combinations of all rows would lose three digits of these tractions
    assert np.abs(found - displacement).max() <= 20e-8 * np.abs(displacement).max()
    assert np.abs(traction - expected).max() <= 20e-8 * np.abs(expected).max()


@pytest.mark.slow
def test_conditions_that_change_leave_what_a_new_factorisation_finds() -> None:
    mesh = mesh_of("rectangle", 220)
    conditions, force, kept = conditions_of(mesh, 4)
    system = system_of(mesh, conditions.frame, True, 1e-9)
    open_elements = np.flatnonzero(conditions.is_retained.any(axis=1))
    rng = np.random.default_rng(0)
    local = local_conditions_of(system, mesh, conditions, force, kept)
    n_leaves = system.factor.compression.tree.n_leaves
    for changed in (open_elements, open_elements[:3], open_elements[:0]):
        some = np.isin(np.arange(mesh.n_elements), changed)[open_elements]
        stiff = np.where(some[:, None], rng.uniform(1.0, 2.0, (open_elements.size, 2)), 1.5)
        held = LinearConditions(
            stiff[:, :, None] * np.eye(2),
            np.broadcast_to(np.eye(2), (open_elements.size, 2, 2)),
            np.ones((open_elements.size, 2)),
        )
        state = system.state(local, open_elements, held)
        fresh = system_of(mesh, conditions.frame, True, 1e-9)
        np.testing.assert_allclose(state, fresh.state(local, open_elements, held), rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(state[:, :2] + stiff * state[:, 2:], 1.0, rtol=1e-12)
        assert fresh.factor.n_factored == n_leaves
    assert 0 < system.factor.n_factored < n_leaves
    system.state(local, open_elements, held)
    assert system.factor.n_factored == 0


def test_a_body_that_nothing_holds_and_conditions_that_are_one_are_named() -> None:
    mesh = mesh_of("rectangle", 220)
    n = mesh.n_elements
    frame = np.broadcast_to(np.eye(2), (n, 2, 2))
    system = system_of(mesh, frame, True, 1e-11)
    nothing_held = system.local_conditions(
        LinearConditions.given(np.zeros((n, 2), bool), np.zeros((n, 2)), np.zeros((n, 2)))
    )
    with pytest.raises(SingularMatrixError, match="check that supports and contacts hold the body"):
        system.state(nothing_held, NOWHERE, NOTHING)
    twice = np.array([[[1.0, 0.0], [2.0, 0.0]]])
    with pytest.raises(UndeterminedError, match="not independent"):
        system.state(nothing_held, np.array([0]), LinearConditions(twice, 0.0 * twice, np.zeros((1, 2))))
    # and it goes on from there
    held = system.local_conditions(LinearConditions.given(np.ones((n, 2), bool), np.zeros((n, 2)), mesh.centres))
    system.state(held, NOWHERE, NOTHING)
    traction, _ = system.full_state()
    # a uniform dilatation has the pressure 2 (mu + lambda) = 2 mu / (1 - 2 nu) on all sides
    pressure = 2.0 * MATERIAL.shear_modulus / (1.0 - 2.0 * MATERIAL.poisson_ratio)
    np.testing.assert_allclose(traction, pressure * mesh.normals, atol=1e-7 * pressure)


def test_a_leaf_that_becomes_singular_is_named() -> None:
    mesh = mesh_of("rectangle", 220)
    conditions, force, kept = conditions_of(mesh, 3)
    system = system_of(mesh, conditions.frame, True, 1e-9)
    local = local_conditions_of(system, mesh, conditions, force, kept)
    factors = local.factors.copy()
    factors[7] = 0.0  # neither its traction nor its displacement is unknown
    with pytest.raises(SingularClusterError, match=r"a cluster of \d+ elements is singular.*linear solver 'direct'"):
        system.factor.update(LocalConditions(factors, local.given))
    system.state(local, NOWHERE, NOTHING)
    traction, _ = system.full_state()
    assert np.isfinite(traction).all()


def test_an_interrupted_factorisation_loses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = mesh_of("rectangle", 200)
    conditions, force, kept = conditions_of(mesh, 3)
    system, fresh = (system_of(mesh, conditions.frame, True, 1e-9) for _ in range(2))
    local, other = (local_conditions_of(system, mesh, conditions, force, factor * kept) for factor in (1.0, 2.0))
    system.state(local, NOWHERE, NOTHING)

    def interrupted(*arguments: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Factor, "_parent", interrupted)
        with pytest.raises(KeyboardInterrupt):
            system.state(other, NOWHERE, NOTHING)
    for present in (local, other):
        system.state(present, NOWHERE, NOTHING)
        fresh.state(present, NOWHERE, NOTHING)
        for found, expected in zip(system.full_state(), fresh.full_state(), strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-13)


def test_clusters_that_do_not_change_keep_no_scattering_matrices_and_may_change_all_the_same() -> None:
    mesh = mesh_of("rectangle", 480)
    conditions, force, kept = conditions_of(mesh, 3)
    in_contact = np.arange(mesh.n_elements) < 60
    system = system_of(mesh, conditions.frame, True, 1e-9, in_contact)
    every = system_of(mesh, conditions.frame, True, 1e-9)
    local = local_conditions_of(system, mesh, conditions, force, kept)
    n_leaves = system.factor.compression.tree.n_leaves
    nowhere_else = []
    for place in (0, 479, 240):
        elements, one = (
            np.array([place]),
            LinearConditions.given(np.ones((1, 2), bool), np.zeros((1, 2)), np.ones((1, 2))),
        )
        states = [each.state(local, elements, one) for each in (system, every)]
        np.testing.assert_array_equal(*states)
        for found, expected in zip(system.full_state(), every.full_state(), strict=True):
            np.testing.assert_array_equal(found, expected)
        nowhere_else.append(system.factor.n_factored)
    assert len(pickle.dumps(system.factor._levels)) < 0.9 * len(pickle.dumps(every.factor._levels))
    assert every.factor.n_factored <= 2 < nowhere_else[-1] < n_leaves


@pytest.mark.slow
def test_loads_that_are_expected_and_their_sums_factor_nothing() -> None:
    """Two loads are few enough to be solved for at once, nine are too many."""
    mesh = mesh_of("rectangle", 700)
    conditions, force, kept = conditions_of(mesh, 3)
    conditions = replace(conditions, displacement=np.zeros((mesh.n_elements, 2)))
    in_contact = np.arange(mesh.n_elements) < 80
    few, many, fresh = (system_of(mesh, conditions.frame, True, 1e-9, each) for each in (in_contact, in_contact, None))
    loads = np.stack([force, np.where(mesh.centres[:, :1] > 0.0, force, 0.0), np.cos(5.0 * mesh.centres) * force])
    shares = np.array([(1, 0, 0), (0.5, 0, 0), (1, 1, 0), (2, -3, 0), (0, 0, 0), (0, 0.1, 1), (1, 0, 0)])
    local = [local_conditions_of(few, mesh, conditions, np.tensordot(share, loads, 1), 0.0 * kept) for share in shares]
    more = [np.cos((6.0 + k) * mesh.centres) * force for k in range(7)]
    few.factor.prepare(each.given for each in local[:3])
    others = (local_conditions_of(many, mesh, conditions, each, 0.0 * kept) for each in more)
    many.factor.prepare(each.given for each in (*local[:3], *others))
    factored: dict[str, list[int]] = {"few": [], "many": []}
    for each in local:
        for solver in (few, many, fresh):
            solver.state(each, NOWHERE, NOTHING)
        for system, counts in zip((few, many), factored.values(), strict=True):
            for found, expected in zip(system.full_state(), fresh.full_state(), strict=True):
                # round-off of loads that take each other away, by what responses are larger than loads
                np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())
            counts.append(system.factor.n_factored)
    n_leaves, reached = few.factor.compression.tree.n_leaves, len(few.factor.may_change)
    assert factored["few"][0] == factored["many"][0] == n_leaves > 3 * reached
    assert [count <= reached for count in factored["few"][1:]] == [True, True, True, True, False, False]
    assert not any(count <= reached for count in factored["many"][1:])
