"""When the equations of collocation are compressed over a tree, and what the plan says of it."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace

import pytest

import bemkit as bk
from bemkit.model.prepared import prepare
from bemkit.operators.linear_solvers import DenseCholesky
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.plan import plan
from bemkit.plan.costs import ChosenLinearSolver
from bemkit.plan.plan import check_elements
from bemkit.results.solved_steps import with_times
from bemkit.runs.nested import run_nested
from bemkit.runs.steps import RunOptions
from tests.scenes import Perforated, paper, squeezed

run = importlib.import_module("bemkit.runs.run")
ASKED = bk.Hierarchical(1e-10)


def scene_of(n_elements: int, **changes: object) -> bk.Scene:
    scene = paper(1, bk.ConstantCollocation(), replace(paper(1).mesh, elements=n_elements))
    return replace(scene, **changes)  # type: ignore[arg-type]


def chosen(scene: bk.Scene) -> ChosenLinearSolver:
    prepared = prepare(scene, scene.build_mesh())
    return prepared.linear_solver(prepared.only)


def test_large_bodies_are_compressed_and_small_ones_are_not() -> None:
    small, large = chosen(scene_of(320)), chosen(scene_of(4000))
    assert small.hierarchical is None
    assert "would take" in small.reason
    assert large.hierarchical == bk.Hierarchical()
    assert "of the time of dense equations" in large.reason
    assert chosen(scene_of(4000, linear_solver=DenseCholesky())) == ChosenLinearSolver("asked for")
    assert chosen(scene_of(320, linear_solver=ASKED)).hierarchical == ASKED


SYMMETRIC = {"symmetry": bk.Symmetry(x=0.0), "discretisation": bk.ConstantCollocation()}
HINDRANCES = {
    "100 elements are few": scene_of(100),
    "incompressible, and the body has holes": squeezed(
        bk.Ring(0.5, 1.0),
        mesh=bk.MeshOptions(elements=480),
        material=bk.Material(1.0, 0.5),
        discretisation=bk.ConstantCollocation(),
    ),
    "contact and supports take all of the boundary of the incompressible body": bk.Scene(
        title="half disc",
        shape=bk.Sector(1.0, 180.0, 360.0),
        material=bk.Material(1.0, 0.5),
        parts=(
            bk.Part("flat", bk.PrescribedDisplacement(0.0, -1e-2), ("start", "end")),
            bk.Part("arc", bk.Contact(bk.RigidHalfPlane((0.0, -1.0))), ("arc",)),
        ),
        law=bk.Coulomb(0.3),
        mesh=bk.MeshOptions(elements=240),
        discretisation=bk.ConstantCollocation(),
    ),
    "closed curves": squeezed(Perforated(8, 12), mesh=bk.MeshOptions(elements=2400), **SYMMETRIC),
}


@pytest.mark.parametrize(
    "words", [pytest.param(words, marks=[pytest.mark.slow] * (words == "closed curves")) for words in HINDRANCES]
)
def test_what_cannot_be_compressed_is_dense_and_the_plan_says_why(words: str) -> None:
    scene = replace(HINDRANCES[words], linear_solver=ASKED)
    choice = chosen(scene)
    assert choice.hierarchical is None
    assert choice.reason.startswith("the equations are not compressed, because")
    assert words in choice.reason
    plan = bk.make_plan(scene, scene.build_mesh())
    assert not plan.is_compressed
    assert any(words in item.reason for item in plan.items if item.name == "linear solver of the body")


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_compressed_equations_of_galerkin_are_refused(degree: int) -> None:
    scene = scene_of(240, discretisation=bk.Galerkin(degree), linear_solver=ASKED)
    with pytest.raises(bk.errors.InputError, match=r"linear_solver is 'hierarchical', but .* Galerkin.*\"constant\""):
        bk.make_plan(scene, scene.build_mesh())
    with pytest.raises(bk.errors.InputError, match="dense equations only"):
        bk.run(scene)
    with pytest.raises(ValueError, match=r"give DenseCholesky\(\) or your own"):
        GalerkinElasticity(scene.build_mesh(), scene.material, linear_solver=ASKED)


def test_automatic_keeps_galerkin_dense() -> None:
    assert chosen(scene_of(5000, discretisation=bk.Galerkin(1))).hierarchical is None


def test_half_planes_have_equations_of_their_own() -> None:
    scene = replace(bk.load_scene("cylinder-on-half-plane"), linear_solver=ASKED)
    assert chosen(scene).hierarchical is None


def test_only_what_does_not_fit_otherwise_is_compressed_for_want_of_memory(
    without: Callable[..., None], memory: Callable[[float], None]
) -> None:
    without("numba")  # with numba 1000 elements are compressed anyhow
    scene = scene_of(1000)
    assert chosen(scene).hierarchical is None
    memory(5e7)
    assert chosen(scene).hierarchical is not None
    assert "dense ones need about" in chosen(scene).reason


def test_the_plan_says_what_is_compressed_and_which_kernels_run() -> None:
    scene = scene_of(4000)
    plan = bk.make_plan(scene, scene.build_mesh())
    reasons = {item.name: item.reason for item in plan.items}
    assert plan.is_compressed
    assert "compressed over a tree to 1e-10" in reasons["boundary equations"]
    assert "no matrix of the whole body" in reasons["linear solver of the body"]
    # and what the other kernels would cost
    assert re.search(r"would take about [\d.]+ s instead of [\d.]+ s", reasons["compiled kernels (numba)"])
    assert plan.work.factorisations == ()
    assert prepare(scene, scene.build_mesh()).largest_matrix < plan.sizes.n_displacements


@pytest.mark.slow
def test_memory_of_compressed_equations_grows_like_the_elements(memory: Callable[[float], None]) -> None:
    small, large, larger = (bk.make_plan(scene_of(n), scene_of(n).build_mesh()).memory for n in (3000, 8000, 13000))
    assert larger - large == pytest.approx(large - small, rel=1e-2)
    # the working memory is the same, and less with numba: not quite in proportion to the elements
    assert 1.5 * small < large < 8 / 3 * small
    memory(80.0 * small)
    check_elements(scene_of(300_000))
    with pytest.raises(bk.errors.InputError, match="use at most"):
        check_elements(scene_of(1_000_000))


@pytest.mark.parametrize("tolerance", [1e-13, 1e-7])
def test_tolerances_out_of_range_are_refused(tolerance: float) -> None:
    with pytest.raises(ValueError, match=r"give a number from 1e-12 \(round-off\) to 1e-8 \(the certificate\)"):
        bk.Hierarchical(tolerance)


@pytest.mark.slow
def test_large_compressed_scenes_begin_on_coarser_meshes() -> None:
    assert run.cascade_of(scene_of(16384)) == (1024, 16)
    assert not run.cascade_of(scene_of(16000))
    assert not run.cascade_of(scene_of(20000, linear_solver=DenseCholesky()))
    assert not run.cascade_of(scene_of(20000, load_factors=(0.5, 1.0)))


def test_each_mesh_of_a_cascade_starts_from_the_one_before() -> None:
    scene, records = scene_of(500, linear_solver=bk.Hierarchical()), []
    meshes = run_nested(scene, coarsest=60, ratio=8, options=RunOptions(callback=records.append))
    assert [mesh.mesh.n_elements for mesh in meshes] == [62, 500]
    assert all(mesh.is_converged for mesh in meshes)
    assert meshes[-1].outer_steps <= 4 < len(records) - meshes[-1].outer_steps
    # times are those of all meshes
    total = with_times(meshes[-1], meshes).timings["total"]
    assert total == pytest.approx(sum(mesh.timings["total"] for mesh in meshes))
    assert total > meshes[-1].timings["total"]


def test_a_ratio_of_meshes_below_two_is_refused() -> None:
    with pytest.raises(ValueError, match="ratio = 1: give a whole number from 2 on"):
        run_nested(scene_of(400), ratio=1)


@pytest.mark.slow
def test_a_body_of_many_sides_takes_no_mesh_that_is_too_coarse_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plate with 40 holes in place of one with 1000, whose 2004 sides are more than 20000 elements divided by 16."""
    for module, name, value in ((plan, "_FEW", 50), (plan, "_MANY", 100), (run, "_COARSEST", 40), (run, "_LARGE", 50)):
        monkeypatch.setattr(module, name, value)
    parts = (
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane((0.0, -1.0), (0.0, 1.0))), sides=("bottom",)),
        bk.Part("press", bk.Pressure(0.1), sides=("top",)),
    )
    scene = scene_of(900, shape=Perforated(8, 5), parts=parts, linear_solver=bk.Hierarchical())
    check_elements(scene)
    assert not run.cascade_of(scene)
    cascade = run.cascade_of(replace(scene, mesh=replace(scene.mesh, elements=6000)))
    assert cascade is not None
    assert cascade[1] == 16


def test_a_plan_loads_no_compiler() -> None:
    code = (
        "import sys, bemkit as bk; from dataclasses import replace; scene = bk.load_scene('paper-1'); "
        "scene = replace(scene, discretisation=bk.ConstantCollocation(), linear_solver=bk.Hierarchical()); "
        "assert bk.make_plan(scene, scene.build_mesh()).is_compressed; "
        "assert 'numba' not in sys.modules and not any('compiled_' in name for name in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
