"""Which linear solver is chosen for a body, and what the reason says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.model.prepared import prepare
from bemkit.operators.linear.choice import choose_linear_solver, direct_cost, krylov_cost
from bemkit.plan import make_plan

AUTOMATIC = bk.Automatic()


@pytest.mark.parametrize(
    ("n_dofs", "n_retained", "kind", "reason"),
    [
        (640, 160, bk.DenseCholesky, "Cholesky, because 160 of 640 displacements are retained for contact: conj"),
        (640, 2, bk.DenseCholesky, "conjugate gradients would take"),
        (4000, 400, bk.DenseCholesky, "conjugate gradients would take"),
        (
            8000,
            10,
            bk.Krylov,
            "conjugate gradients, because only 10 of 8000 displacements are retained for contact: about 0.",
        ),
        (20000, 40, bk.Krylov, "of the time of Cholesky"),
        (20000, 4000, bk.DenseCholesky, "times as long"),
    ],
)
def test_small_contact_boundaries_of_large_bodies_are_iterated(
    n_dofs: int, n_retained: int, kind: type, reason: str
) -> None:
    choice = choose_linear_solver(AUTOMATIC, n_dofs, n_retained)
    assert isinstance(choice.solver, kind)
    assert reason in choice.reason


def test_what_does_not_fit_is_iterated() -> None:
    direct, krylov = direct_cost(10000, 1000), krylov_cost(10000, 1000)
    assert krylov.flops > direct.flops
    choice = choose_linear_solver(AUTOMATIC, 10000, 1000, memory=0.5 * (direct.peak + krylov.peak))
    assert choice.solver == bk.Krylov()
    assert choice.reason.startswith(
        "conjugate gradients, because a factorisation needs about 4.96 GB, this computer has"
    )
    # what fits neither way is refused by the plan, and chosen by time here
    assert choose_linear_solver(AUTOMATIC, 10000, 1000, memory=0.5 * krylov.peak).solver == bk.DenseCholesky()


def test_what_was_asked_for_is_taken() -> None:
    requested = bk.Krylov(rtol=1e-6)
    choice = choose_linear_solver(requested, 100, 100)
    assert choice.solver is requested
    assert choice.reason == "asked for"


def test_nearly_incompressible_bodies_are_factored() -> None:
    scene = replace(SCENE, discretisation=bk.LinearGalerkin())
    rubber = replace(scene, material=bk.Material(1e4, 0.4999999))
    choices = [prepare(each, each.build_mesh()).linear_solver for each in (rubber, scene)]
    assert all(choice.solver == bk.DenseCholesky() for choice in choices)
    assert choices[0].reason == "asked for"  # whatever their sizes
    assert choices[1].reason.startswith("Cholesky, because 31 of 120 displacements are retained for contact")
    with pytest.raises(
        ValueError, match=r"at the Poisson ratio 0\.4999999, where its rtol leaves errors of 5e-03: choose"
    ):
        replace(rubber, linear_solver=bk.Krylov())
    replace(rubber, linear_solver=bk.Krylov(rtol=1e-12))
    replace(scene, material=bk.Material(1e4, 0.5), linear_solver=bk.Krylov())  # where the volume has its own equation


SCENE = replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=60))


@pytest.mark.parametrize("solver", [bk.DenseCholesky(), bk.Krylov()])
def test_scenes_are_solved_as_they_ask(solver: bk.DenseCholesky | bk.Krylov) -> None:
    scene = replace(SCENE, discretisation=bk.LinearGalerkin(), linear_solver=solver)
    reference = bk.run(replace(scene, linear_solver=AUTOMATIC))
    solution = bk.run(scene)
    assert solution.is_converged
    assert solution.work == solution.plan.work
    assert len(solution.work.factorisations) == (2 if solver.forms_matrix else 1)
    # the contact system errs by the square of the tolerance 1e-9, the rest of the boundary by 1e-9 in energy
    np.testing.assert_allclose(solution.contact.sigma_n, reference.contact.sigma_n, atol=1e-11, rtol=0)
    size = np.abs(reference.boundary.displacement).max()
    assert np.abs(solution.boundary.displacement - reference.boundary.displacement).max() < 1e-8 * size


def test_the_plan_says_which_and_why() -> None:
    def reason(scene: bk.Scene) -> str:
        items = make_plan(scene, scene.build_mesh()).items
        return next(item.reason for item in items if item.name == "linear solver of the body")

    scene = replace(SCENE, discretisation=bk.LinearGalerkin())
    assert reason(scene).startswith("Cholesky, because 31 of 120 displacements are retained for contact")
    assert reason(replace(scene, linear_solver=bk.Krylov())).startswith("asked for")
    assert reason(replace(scene, discretisation=bk.ConstantCollocation())).startswith(
        "LU, because the equations of coll"
    )


def test_collocation_cannot_be_iterated() -> None:
    with pytest.raises(
        ValueError, match=r"linear_solver is Krylov.*, which needs symmetric equations, and those of coll"
    ):
        replace(SCENE, discretisation=bk.ConstantCollocation(), linear_solver=bk.Krylov())


def test_scene_files_name_linear_solvers() -> None:
    text = bk.scene_to_toml(replace(SCENE, discretisation=bk.LinearGalerkin(), linear_solver=bk.Krylov(max_steps=50)))
    assert "[linear_solver]" in text
    assert bk.scene_from_toml(text).linear_solver == bk.Krylov(max_steps=50)
    assert 'linear_solver = "automatic"' in bk.scene_to_toml(SCENE)
    assert bk.scene_from_toml(text.replace("krylov", "direct").replace("max_steps = 50\n", "")).linear_solver == (
        bk.DenseCholesky()
    )
