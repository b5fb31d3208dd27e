"""Bodies whose Galerkin equations are compressed: the answers, statuses and certificates of dense ones."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.condensation.hierarchical_body import HierarchicalBody
from bemkit.contact.condensation.reduction import CondensedBody
from bemkit.model.contact_model import build_model
from bemkit.model.prepared import prepare
from bemkit.operators.hierarchy.factor import HierarchicalFactor
from bemkit.operators.linear.solvers import DenseCholesky, Hierarchical
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.operators.steklov_poincare.hierarchical_galerkin import HierarchicalGalerkin
from bemkit.testing import check_body
from tests.contact.test_hierarchical_body import SCENES, loose_block, on_floor
from tests.scenes import paper
from tests.slow import slow_except

TOLERANCE = 1e-11
# held at all its corners, where its supports would contradict each other at a common node
BODIES = {name: scene for name, scene in SCENES.items() if name != "tilted block"}
QUICK = (("paper-1", 1),)
DENSE = {("incompressible with a hole", 2), ("twelve holes, incompressible", 2)}
"""Quadratic elements of incompressible bodies with holes stay dense: clusters with holes are nearly singular."""


def in_both_ways(scene: bk.Scene, n_elements: int, degree: int) -> tuple[bk.Scene, bk.Scene]:
    """Return a scene on compressed and on dense equations of Galerkin's method."""
    mesh = replace(scene.mesh, elements=n_elements, accuracy=None)
    scene = replace(scene, discretisation=bk.Galerkin(degree), mesh=mesh)
    return replace(scene, linear_solver=Hierarchical(TOLERANCE)), replace(scene, linear_solver=DenseCholesky())


@pytest.mark.parametrize(
    ("name", "degree"), slow_except([each for each in product(BODIES, (1, 2)) if each not in DENSE], *QUICK)
)
def test_statuses_and_tractions_are_those_of_dense_equations(name: str, degree: int) -> None:
    symmetry = BODIES[name].symmetry
    n_elements = (480 if "holes" in name else 200) * (1 if symmetry is None else symmetry.n_images)
    compressed, dense = (bk.run(each) for each in in_both_ways(BODIES[name], n_elements, degree))
    assert compressed.plan.is_compressed
    assert not dense.plan.is_compressed
    assert compressed.status is dense.status is bk.Status.CONVERGED
    np.testing.assert_array_equal(compressed.contact.status, dense.contact.status)
    stress = np.abs(dense.boundary.traction).max()
    for component in ("sigma_n", "sigma_t"):
        one, two = (getattr(each.contact, component) for each in (compressed, dense))
        # 100 times the tolerance at most on all shapes
        np.testing.assert_allclose(one, two, atol=1e-8 * stress)
    np.testing.assert_allclose(compressed.boundary.traction, dense.boundary.traction, atol=1e-8 * stress)
    size = np.abs(dense.boundary.displacement).max()
    np.testing.assert_allclose(compressed.boundary.displacement, dense.boundary.displacement, atol=1e-9 * size)
    assert compressed.energy == pytest.approx(dense.energy, rel=1e-9)
    assert compressed.certificate.worst < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper-1", "loose block"])
def test_the_body_keeps_the_promises_of_a_body(name: str) -> None:
    compressed = (in_both_ways(replace(BODIES[name], load_factors=(factor,)), 240, 1)[0] for factor in (1.0, 0.4))
    body, reloaded = (build_model(prepare(each, each.build_mesh())).body for each in compressed)
    assert isinstance(body, HierarchicalBody)
    check_body(body, reloaded=reloaded)


@pytest.mark.parametrize("degree", slow_except((1, 2), 1))
def test_the_condensed_map_is_that_of_dense_equations(degree: int) -> None:
    scene = in_both_ways(replace(loose_block(), shape=bk.PlateWithHole(2.0, 1.5, 0.4)), 300, degree)[1]
    given = prepare(scene, scene.build_mesh())
    mesh, spaces = given.mesh.unit, (given.space, scene.discretisation.traction_space(given.mesh.unit))
    tree = HierarchicalGalerkin(mesh, given.material, Hierarchical(TOLERANCE), *spaces)
    dense = GalerkinElasticity(mesh, given.material, *spaces)
    one, two = (each.condense(given.conditions, given.force) for each in (tree, dense))
    # half the tolerance to 20 times on all shapes
    close = 50.0 * TOLERANCE
    np.testing.assert_allclose(one.stiffness, two.stiffness, atol=close * np.abs(two.stiffness).max())
    displacement = np.cos(np.arange(two.load.size))
    (moved, force), (also_moved, same_force) = one.recover(displacement), two.recover(displacement)
    np.testing.assert_allclose(moved, also_moved, atol=close * np.abs(also_moved).max())
    np.testing.assert_allclose(force, same_force, atol=close * np.abs(same_force).max())
    tractions, same = (each.element_tractions(also_moved, same_force) for each in (tree, dense))
    np.testing.assert_allclose(tractions, same, atol=close * np.abs(same).max())


@pytest.mark.parametrize("degree", slow_except((1, 2), 1))
def test_contact_knows_nothing_of_given_forces_on_its_own_nodes(degree: int) -> None:
    floor, press = loose_block().parts
    pushed = bk.Part("push", bk.Pressure(0.3), sides=("left",))  # down to the corner that touches
    scene = replace(loose_block(), parts=(floor, press, pushed))
    compressed, dense = (bk.run(each) for each in in_both_ways(scene, 240, degree))
    assert compressed.plan.is_compressed
    np.testing.assert_array_equal(compressed.contact.status, dense.contact.status)
    stress = np.abs(dense.boundary.traction).max()
    for component in ("sigma_n", "sigma_t"):
        one, two = (getattr(each.contact, component) for each in (compressed, dense))
        np.testing.assert_allclose(one, two, atol=1e-8 * stress)


@pytest.mark.slow
def test_estimated_errors_and_the_meshes_that_follow_them_are_those_of_dense_equations() -> None:
    scene = replace(paper(1), discretisation=bk.Galerkin(1), mesh=bk.MeshOptions(accuracy=5e-3))
    compressed = bk.run(replace(scene, linear_solver=Hierarchical(TOLERANCE)))
    dense = bk.run(replace(scene, linear_solver=DenseCholesky()))
    assert compressed.plan.is_compressed
    assert compressed.status is dense.status is bk.Status.CONVERGED
    assert compressed.n_elements == dense.n_elements
    # the error itself is a small difference of tractions that agree to 1e-9
    assert compressed.estimated_error == pytest.approx(dense.estimated_error, rel=1e-6)


def test_tractions_are_those_of_the_last_answer_without_another_factorisation() -> None:
    model = build_model(prepare(scene := in_both_ways(paper(1), 240, 1)[0], scene.build_mesh()))
    assert isinstance(model.elastic, HierarchicalGalerkin)
    other = HierarchicalGalerkin(model.elastic.mesh, model.elastic.material, model.elastic.options)
    fields = model.body.recover(model.problem.sticking_state)
    factored = []
    with pytest.MonkeyPatch.context() as patch:
        update = HierarchicalFactor.update
        patch.setattr(HierarchicalFactor, "update", lambda *each: (factored.append(each), update(*each)))
        tractions = model.elastic.element_tractions(*fields)
        assert not factored
        again = other.element_tractions(*fields)
        elsewhere = model.elastic.element_tractions(2.0 * fields[0], 2.0 * fields[1])
    assert len(factored) == 2
    size = np.abs(again).max()
    np.testing.assert_allclose(tractions, again, atol=1e-8 * size)
    np.testing.assert_allclose(elsewhere, 2.0 * again, atol=1e-8 * size)


def test_without_contact_all_of_the_body_is_solved_for() -> None:
    compressed, dense = (bk.run(each) for each in in_both_ways(bk.load_scene("bending"), 240, 1))
    assert compressed.plan.is_compressed
    size = np.abs(dense.boundary.displacement).max()
    np.testing.assert_allclose(compressed.boundary.displacement, dense.boundary.displacement, atol=1e-9 * size)


@pytest.mark.slow
def test_several_bodies_are_those_of_dense_equations() -> None:
    assembly = bk.load_scene("two-cylinders")
    assert isinstance(assembly, bk.Assembly)
    mesh = replace(assembly.mesh, elements=480, accuracy=None)
    assembly = replace(assembly, discretisation=bk.LinearGalerkin(), mesh=mesh)
    compressed, dense = (
        bk.run(replace(assembly, linear_solver=solver)) for solver in (Hierarchical(TOLERANCE), DenseCholesky())
    )
    assert compressed.plan.is_compressed
    np.testing.assert_array_equal(compressed.contact.status, dense.contact.status)
    stress = np.abs(dense.contact.sigma_n).max()
    np.testing.assert_allclose(compressed.contact.sigma_n, dense.contact.sigma_n, atol=1e-8 * stress)


@pytest.mark.slow
def test_a_corner_between_two_obstacles_is_seen_by_its_stiffness() -> None:
    floor, press = on_floor()
    wall = bk.Part("wall", bk.Contact(bk.HalfPlane((-1.0, 0.0), (1.0, 0.0))), sides=("left",))
    push = bk.Part("push", bk.Traction(x=-0.5, y=0.0), sides=("right",))
    scene = replace(
        loose_block(),
        shape=bk.Rectangle(2.0, 2.0, (-1.0, -1.0)),
        law=bk.Frictionless(),
        parts=(floor, press, wall, push),
    )
    compressed, dense = in_both_ways(scene, 240, 1)
    given = prepare(compressed, compressed.build_mesh())
    assert given.contact.nodes.is_shared.any()
    assert isinstance(build_model(given).body, CondensedBody)
    one, two = bk.run(compressed), bk.run(dense)
    stress = np.abs(two.boundary.traction).max()
    np.testing.assert_allclose(one.contact.sigma_n, two.contact.sigma_n, atol=1e-8 * stress)
