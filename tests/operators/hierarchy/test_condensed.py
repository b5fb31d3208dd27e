"""Bodies that are condensed over a tree: the maps of dense equations, copies and thin bodies included."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.direct_body import DirectBody
from bemkit.model.model import build_model
from bemkit.model.prepared import Prepared, prepare
from bemkit.operators.hierarchy.system import HierarchicalSystem
from bemkit.operators.linear_solvers import DenseCholesky, Hierarchical
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.hierarchical import HierarchicalCollocation, InexactEquationsError
from tests.scenes import paper
from tests.slow import slow_except

TOLERANCE = 1e-11


def prepared(scene: bk.Scene, n_elements: int = 240, *, slopes: bool = True) -> Prepared:
    mesh = bk.MeshOptions(elements=n_elements)
    scene = replace(scene, discretisation=bk.ConstantCollocation(slopes=slopes), mesh=mesh)
    return prepare(scene, scene.build_mesh())


def loose(shape: object, **changes: object) -> bk.Scene:
    parts = (
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("press", bk.Traction(x=0.1, y=-1.0), sides=("top",)),
    )
    return bk.Scene(title="block", shape=shape, material=bk.Material(1.0, 0.3), law=bk.Coulomb(0.4), parts=parts)  # type: ignore[arg-type]


SCENES = {
    "paper-1": (paper(1), True),
    "floating plate with a round hole": (loose(bk.PlateWithHole(2.0, 1.5, 0.4)), True),
    "without slopes": (loose(bk.Rectangle(2.0, 1.0)), False),
}


@pytest.mark.parametrize("name", slow_except(SCENES, "paper-1"))
def test_the_condensed_map_is_that_of_dense_equations(name: str) -> None:
    scene, slopes = SCENES[name]
    prepared_scene = prepared(scene, slopes=slopes)
    given, material = prepared_scene.only, prepared_scene.material_of(prepared_scene.only)
    mesh, conditions = given.own_mesh.unit, given.conditions
    tree = HierarchicalCollocation(mesh, material, Hierarchical(TOLERANCE), slopes=slopes)
    dense = CollocationElasticity(mesh, material, slopes=slopes).condense(conditions, given.force)
    condensed = tree.condense(conditions, given.force)
    # two to four times the tolerance are found on all shapes
    close = 20.0 * TOLERANCE
    np.testing.assert_allclose(condensed.stiffness, dense.stiffness, atol=close * np.abs(dense.stiffness).max())
    displacement = np.cos(np.arange(dense.load.size))
    moved = replace(conditions, displacement=np.where(conditions.is_fixed, 0.3, 0.0))
    for one, two in (
        (condensed, dense),
        *(((each.under(2.0 * given.force, moved.displacement)) for each in (condensed, dense)),),
    ):
        np.testing.assert_allclose(one.load, two.load, atol=close * max(1.0, np.abs(two.load).max()))
        for ours, theirs in zip(one.recover(displacement), two.recover(displacement), strict=True):
            np.testing.assert_allclose(ours, theirs, atol=close * np.abs(theirs).max())
        directions = np.flatnonzero(conditions.is_free)[::17]
        for ours, theirs in zip(one.follow(directions), two.follow(directions), strict=True):
            np.testing.assert_allclose(ours, theirs, atol=close * max(1.0, np.abs(theirs).max()))


def test_a_rigid_motion_far_away_takes_no_force() -> None:
    prepared_scene = prepared(loose(bk.Rectangle(2.0, 1.0)))
    given, material = prepared_scene.only, prepared_scene.material_of(prepared_scene.only)
    tree = HierarchicalCollocation(given.own_mesh.unit, material, Hierarchical(TOLERANCE))
    condensed = tree.condense(given.conditions, np.zeros_like(given.force))
    way = 1e3 * np.tile([0.6, -0.8], (given.mesh.n_elements, 1))
    retained = np.einsum("nkc,nc->nk", given.conditions.frame, way)[given.conditions.is_retained]
    displacement, force = condensed.recover(retained)
    np.testing.assert_allclose(displacement, way, rtol=1e-13)
    # round-off of the way, 1e-13, and not the tolerance of the compression, 1e-8
    assert np.abs(force).max() < 1e-12
    assert np.abs(condensed.stiffness @ retained).max() < 1e-11


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "slopes", "n_elements"),
    [
        (loose(bk.Rectangle(2.0, 1.0)), False, 200),
        pytest.param(loose(bk.Rectangle(1.0, 0.003)), True, 400, marks=pytest.mark.slow),
    ],
    ids=["without slopes", "thin"],
)
def test_where_the_stiffness_may_be_negative_it_is_examined(scene: bk.Scene, slopes: bool, n_elements: int) -> None:
    given = prepared(replace(scene, linear_solver=Hierarchical(TOLERANCE)), n_elements, slopes=slopes)
    assert isinstance(build_model(given).body, DirectBody)
    compressed = bk.run(given.scene)
    dense = bk.run(replace(given.scene, linear_solver=DenseCholesky()))
    assert compressed.plan.is_compressed
    assert compressed.status is dense.status is bk.Status.NEGATIVE_ENERGY
    stress = np.abs(dense.boundary.traction).max()
    np.testing.assert_allclose(compressed.boundary.traction, dense.boundary.traction, atol=1e-8 * stress)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "elements"), list(product(("two-cylinders", "pin-in-plate"), (200, 600))))
def test_several_bodies_are_those_of_dense_equations(name: str, elements: int) -> None:
    assembly = bk.load_scene(name)
    assert isinstance(assembly, bk.Scene)
    mesh = replace(assembly.mesh, elements=elements, accuracy=None)
    assembly = replace(assembly, discretisation=bk.ConstantCollocation(), mesh=mesh)
    compressed, dense = (
        bk.run(replace(assembly, linear_solver=solver)) for solver in (Hierarchical(TOLERANCE), DenseCholesky())
    )
    assert compressed.plan.is_compressed
    assert not dense.plan.is_compressed
    assert compressed.status is dense.status is bk.Status.CONVERGED
    np.testing.assert_array_equal(compressed.contact.status, dense.contact.status)
    stress = np.abs(dense.contact.sigma_n).max()
    for component in ("sigma_n", "sigma_t"):
        one, two = (getattr(each.contact, component) for each in (compressed, dense))
        np.testing.assert_allclose(one, two, atol=1e-8 * stress)
    assert compressed.energy == pytest.approx(dense.energy, rel=1e-9)


def test_equations_that_are_less_accurate_than_promised_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    prepared_scene = prepared(paper(1))
    given, material = prepared_scene.only, prepared_scene.material_of(prepared_scene.only)
    tree = HierarchicalCollocation(given.own_mesh.unit, material, Hierarchical(TOLERANCE))
    exact = HierarchicalSystem.full_state

    def wrong(system: HierarchicalSystem) -> tuple[np.ndarray, np.ndarray]:
        traction, displacement = exact(system)
        return traction, displacement * (1.0 + 1e-5 * np.cos(np.arange(len(displacement))))[:, None]

    monkeypatch.setattr(HierarchicalSystem, "full_state", wrong)
    with pytest.raises(InexactEquationsError, match="choose the linear solver 'direct'"):
        tree.condense(given.conditions, given.force)
