"""When the equations of collocation are solved without being stored, and what the plan says of it."""

from __future__ import annotations

from dataclasses import replace

import pytest

import bemkit as bk
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from tests.contact.test_hierarchical_body import loose_block
from tests.plan.test_hierarchical_choice import chosen, scene_of
from tests.scenes import Perforated, squeezed

ASKED = bk.MatrixFree(3e-10)


def test_it_is_taken_where_it_is_asked_for() -> None:
    choice = chosen(scene_of(320, linear_solver=ASKED))
    assert choice.hierarchical == ASKED
    assert choice.reason == "asked for"


HINDRANCES = {
    "100 elements are few": scene_of(100),
    "320 elements are curved": squeezed(bk.Disk(1.0), mesh=bk.MeshOptions(elements=320)),
    "divided along a line of symmetry": squeezed(
        bk.Polygon(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))),
        symmetry=bk.Symmetry(x=0.0),
        mesh=bk.MeshOptions(elements=640),
    ),
    "contact sees the stiffness": replace(
        loose_block(), shape=bk.Rectangle(2.0, 1e-3), mesh=bk.MeshOptions(elements=320)
    ),
}


@pytest.mark.parametrize("words", HINDRANCES)
def test_the_plan_says_why_equations_are_stored(words: str) -> None:
    scene = replace(HINDRANCES[words], discretisation=bk.ConstantCollocation(), linear_solver=ASKED)
    choice = chosen(scene)
    assert not isinstance(choice.hierarchical, bk.MatrixFree)
    assert choice.reason.startswith("not matrix-free, because ")
    assert words in choice.reason


@pytest.mark.slow
def test_bodies_with_many_holes_are_stored() -> None:
    scene = squeezed(Perforated(6, 6), mesh=bk.MeshOptions(elements=2400), linear_solver=ASKED)
    reason = chosen(replace(scene, discretisation=bk.ConstantCollocation())).reason
    assert "closed curves" in reason or "curved" in reason


def test_galerkin_takes_what_automatic_takes() -> None:
    scene = scene_of(40, discretisation=bk.Galerkin(1))
    choice = chosen(replace(scene, linear_solver=ASKED))
    assert choice.solver == chosen(scene).solver
    assert "not matrix-free, but" in choice.reason
    with pytest.raises(ValueError, match=r"give DenseCholesky\(\) or your own"):
        GalerkinElasticity(scene.build_mesh(), scene.material, linear_solver=ASKED)


def test_the_plan_says_what_is_used_and_that_it_takes_less_memory() -> None:
    free, direct = (
        bk.make_plan(scene, scene.build_mesh())
        for scene in (scene_of(4000, linear_solver=each) for each in (bk.MatrixFree(), bk.Hierarchical()))
    )
    items = {item.name: item for item in free.items}
    assert "fast multipole" in items["boundary equations"].reason
    assert "GMRES to 1e-10" in items["linear solver of the body"].reason
    assert items["algebraic multigrid (pyamg)"].is_needed
    assert free.memory < 0.4 * direct.memory  # the equations of the groups weigh here
    assert free.seconds > direct.seconds


def test_scene_files_say_it() -> None:
    text = bk.scene_to_toml(scene_of(320, linear_solver=ASKED))
    assert "matrix-free" in text
    assert bk.scene_from_toml(text).linear_solver == ASKED
