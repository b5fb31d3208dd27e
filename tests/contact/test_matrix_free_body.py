"""Bodies whose equations are solved by iteration: the statuses, answers and certificates of dense ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.body import stick
from bemkit.contact.hierarchical_body import HierarchicalBody
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.operators.linear_solvers import DenseCholesky, MatrixFree
from tests.contact.test_hierarchical_body import loose_block, tilted
from tests.scenes import paper
from tests.slow import slow_except


def with_solver(scene: bk.Scene, n_elements: int, solver: object, *, slopes: bool = True) -> bk.Scene:
    mesh = replace(scene.mesh, elements=n_elements, accuracy=None)
    discretisation = bk.ConstantCollocation(slopes=slopes)
    return replace(scene, discretisation=discretisation, mesh=mesh, linear_solver=solver)


def is_iterated(solution: bk.Solution) -> bool:
    return any(item.reason.startswith("GMRES") for item in solution.plan.items)


SCENES = {
    "paper-1": paper(1),
    "paper-2": paper(2),
    "loose block": loose_block(),
    "travelling block": loose_block(5.0),
    "tilted block": tilted(),
    "tresca": replace(paper(1), law=bk.Tresca(0.2)),
    "load history": replace(paper(1), load_factors=(0.5, 1.0)),
    "incompressible": replace(paper(1), material=bk.Material(1.0, 0.5)),
    "weight": replace(loose_block(), body_forces=(bk.Gravity(0.5, (0.02, -0.3)),)),
}


@pytest.mark.parametrize("name", slow_except(SCENES, "weight"))
def test_solutions_are_those_of_dense_equations(name: str) -> None:
    own, dense = (bk.run(with_solver(SCENES[name], 200, each)) for each in (MatrixFree(1e-10), DenseCholesky()))
    assert is_iterated(own)  # fewer elements are dense
    assert own.is_converged
    assert (own.contact.status == dense.contact.status).all()
    scale = np.abs(dense.contact.sigma_n).max()
    # a hundred times the tolerance, as the body says
    assert np.abs(own.contact.sigma_n - dense.contact.sigma_n).max() < 1e-8 * scale
    assert np.abs(own.contact.sigma_t - dense.contact.sigma_t).max() < 1e-8 * scale
    assert own.energy == pytest.approx(dense.energy, rel=1e-7)
    assert own.certificate.worst < 1e-8


@pytest.mark.slow
def test_the_default_tolerance_is_enough_for_certificates() -> None:
    solution = bk.run(with_solver(paper(1), 320, MatrixFree()))
    assert is_iterated(solution)
    assert solution.is_converged  # 1e-9 leaves 1.8e-9


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-10, 3e-10])
def test_every_equation_is_solved_as_well_as_the_mean_of_all(tolerance: float) -> None:
    """The weight of a column leaves 14 times the tolerance on a few elements where the mean is below it."""
    solution = bk.run(with_solver(bk.load_scene("gravity-column"), 220, MatrixFree(tolerance)))
    assert is_iterated(solution)
    assert solution.is_converged
    assert solution.certificate.force_imbalance < 2.6 * tolerance


@pytest.mark.slow
def test_statuses_are_those_of_dense_equations_at_2000_elements() -> None:
    own, dense = (bk.run(with_solver(paper(1), 2000, each)) for each in (MatrixFree(), DenseCholesky()))
    assert (own.contact.status == dense.contact.status).all()
    # a hundred times the tolerance, as the body says
    assert np.abs(own.contact.sigma_n - dense.contact.sigma_n).max() < 1e-8 * np.abs(dense.contact.sigma_n).max()
    assert own.is_converged
    assert own.certificate.worst < 1e-9


@pytest.mark.slow
def test_a_wrong_state_is_out_of_balance() -> None:
    scene = with_solver(paper(1), 240, MatrixFree(1e-10))
    body = build_model(prepare(scene, scene.build_mesh())).body
    assert isinstance(body, HierarchicalBody)
    assert body.accuracy == pytest.approx(1e-8)
    state = body.respond(stick(np.zeros(body.n_contact), np.zeros(body.n_contact)))
    assert body.imbalance(state).force < 1e-8
    assert body.imbalance(replace(state, traction=1.001 * state.traction)).force > 1e-4
