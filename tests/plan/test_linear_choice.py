"""Which linear solver is chosen for a body, and what the reason says."""

from __future__ import annotations

from dataclasses import replace

import pytest

import bemkit as bk
from bemkit.plan.plan import make_plan
from tests.plan.test_hierarchical_choice import chosen

SCENE = replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=60))


def test_what_was_asked_for_is_taken() -> None:
    class Own(bk.DenseCholesky):
        """A linear solver of somebody else."""

    requested = Own()
    scene = replace(SCENE, discretisation=bk.Galerkin(1), linear_solver=requested)
    assert chosen(scene).solver is requested
    assert chosen(scene).reason == "asked for"
    assert bk.run(scene).plan.linear_solver is requested


def test_the_plan_says_which_and_why() -> None:
    def reason(scene: bk.Scene) -> str:
        items = make_plan(scene, scene.build_mesh()).items
        return next(item.reason for item in items if item.name == "linear solver of the body")

    scene = replace(SCENE, discretisation=bk.Galerkin(1))
    assert reason(scene).startswith("Cholesky, because S is positive definite")
    assert reason(replace(scene, linear_solver=bk.DenseCholesky())).startswith("asked for")
    assert reason(replace(scene, discretisation=bk.ConstantCollocation())).startswith(
        "LU, because the equations of coll"
    )


def test_scene_files_name_linear_solvers() -> None:
    text = bk.scene_to_toml(replace(SCENE, linear_solver=bk.MatrixFree(max_steps=50)))
    assert "[linear_solver]" in text
    assert bk.scene_from_toml(text).linear_solver == bk.MatrixFree(max_steps=50)
    assert 'linear_solver = "automatic"' in bk.scene_to_toml(SCENE)
    direct = bk.scene_to_toml(replace(SCENE, linear_solver=bk.DenseCholesky()))
    assert bk.scene_from_toml(direct).linear_solver == bk.DenseCholesky()
    with pytest.raises(ValueError, match=r"linear solver 'krylov' was removed: use 'hierarchical', faster"):
        bk.scene_from_toml(direct.replace('"direct"', '"krylov"'))
