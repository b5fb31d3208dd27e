"""The plan: what is needed, what is left out, and what fits."""

from __future__ import annotations

import dataclasses
import re
import tracemalloc
from collections.abc import Callable
from typing import Any

import pytest

import bemkit as bk
import bemkit.plan.plan
from bemkit.cli.main import main
from bemkit.contact.laws import Frictionless
from bemkit.contact.obstacle import RigidHalfPlane
from bemkit.geometry.shapes import Disk, Rectangle
from bemkit.operators.linear_solvers import LinearSolver
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.plan.costs import physical_memory
from bemkit.plan.plan import Plan, TooLargeError, check_elements, check_memory, make_plan
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.conditions import Clamped, Condition, Contact, Part, PrescribedDisplacement, Roller
from bemkit.scene.discretisation import MeshOptions
from bemkit.scene.scene import Scene
from bemkit.scene.toml import load_scene, with_overrides
from tests.slow import slow_only


def plan_of(scene: Scene) -> Plan:
    return make_plan(scene, scene.build_mesh())


def needed(scene: Scene) -> dict[str, bool]:
    return {item.name: item.is_needed for item in plan_of(scene).items}


def reasons(scene: Scene) -> dict[str, str]:
    return {item.name: item.reason for item in plan_of(scene).items}


def block(*conditions: tuple[str, Condition]) -> Scene:
    parts = [Part("foundation", Contact(RigidHalfPlane()), ("bottom",))]
    parts += [Part(side, condition, (side,)) for side, condition in conditions]
    return Scene(
        title="t", shape=Rectangle(2.0, 1.0), material=Material(1.0, 0.3), parts=tuple(parts), mesh=MeshOptions(24)
    )


@pytest.mark.parametrize(
    ("scene", "n_free"),
    [
        (block(), 3),
        (block(("right", Roller())), 1),
        (block(("top", PrescribedDisplacement(y=0.0))), 1),
        (block(("right", Roller()), ("top", Roller())), 0),
        (block(("right", Roller()), ("left", Roller())), 1),
        (block(("left", Clamped())), 0),
    ],
)
def test_rigid_motions_that_only_contact_holds_are_counted(scene: Scene, n_free: int) -> None:
    assert plan_of(scene).sizes.n_free_motions == n_free
    assert needed(scene)["rigid motions as unknowns"] == (n_free > 0)


def test_numbers_and_verbs_agree() -> None:
    one, three = (reasons(scene)["rigid motions as unknowns"] for scene in (block(("right", Roller())), block()))
    assert one == "1 of 3 rigid motions is held only by contact"
    assert three == "3 of 3 rigid motions are held only by contact"


def test_a_disc_on_rollers_all_round_may_still_turn() -> None:
    arcs = ("arc-1", "arc-2", "arc-3")
    parts = (Part("floor", Contact(RigidHalfPlane()), ("arc-4",)), Part("ring", Roller(), arcs))
    scene = Scene(title="t", shape=Disk(1.0), material=Material(1.0, 0.3), parts=parts, mesh=MeshOptions(64))
    assert plan_of(scene).sizes.n_free_motions == 1
    assert needed(scene)["quadrature on curved elements"]


def test_what_is_left_out_depends_on_the_scene() -> None:
    scene = load_scene("paper-1")
    constant = needed(scene)
    linear = needed(with_overrides(scene, discretisation="linear"))
    frictionless = needed(dataclasses.replace(scene, law=Frictionless()))
    assert not constant["hypersingular operator W"]
    assert linear["hypersingular operator W"]
    assert not constant["columns of V on the free surface"]
    assert constant["friction"]
    assert constant["tangential unknowns"]
    assert not frictionless["friction"]
    assert frictionless["tangential unknowns"]  # only tangents that a support gives are eliminated
    assert not constant["quadrature on curved elements"]
    assert not constant["stress inside the body"]
    assert not constant["figures (matplotlib)"]
    assert not linear["second elastic body"]
    assert "columns of V on the free surface" not in linear  # Galerkin takes whole matrices
    held = [Part(side, Roller(), (side,)) for side in ("left", "right", "bottom", "top")]
    without = block(*((part.name, part.condition) for part in held if part.name != "bottom"))
    without = dataclasses.replace(without, parts=tuple(held), law=Frictionless())
    without = with_overrides(without, discretisation="constant")
    assert not needed(without)["contact system"]
    assert "second elastic body" not in needed(without)
    assert not needed(without)["columns of V on the free surface"]


def test_pyamg_is_not_needed_by_direct_solvers() -> None:
    linear = block(("left", Clamped()))
    assert not needed(linear)["algebraic multigrid (pyamg)"]
    assert reasons(linear)["algebraic multigrid (pyamg)"] == "the linear solver is direct"


def test_the_pressure_of_an_incompressible_body_is_one_more_unknown_of_galerkin_maps_alone() -> None:
    name, linear = "pressure that keeps the volume", block(("left", Clamped()))
    assert reasons(linear)[name] == "the body is compressible"
    linear = dataclasses.replace(linear, material=Material(1.0, 0.5))
    assert needed(linear)[name]
    constant = with_overrides(linear, discretisation="constant")
    assert not needed(constant)[name]
    assert reasons(constant)[name] == "collocation has it among the tractions"


def test_every_item_has_a_reason_and_costs_grow() -> None:
    scene = load_scene("paper-1")
    small, large, larger = (
        plan_of(with_overrides(scene, elements=n, discretisation="linear")) for n in (400, 800, 1600)
    )
    assert all(item.reason for item in small.items)
    assert large.memory == pytest.approx(4 * small.memory, rel=0.1)  # nodes at ends of parts and fixed buffers
    # the time of dense algebra grows with the cube, that of assembly with the square, and some of it is fixed
    assert 2.0 < large.seconds / small.seconds < larger.seconds / large.seconds < 8.0
    assert small.as_dict()["memory"] == small.memory
    assert small.as_dict()["seconds"] == small.seconds
    assert small.as_dict()["work"] == small.work.as_dict()
    assert small.as_dict()["items"][0] == {"name": "elements", "needed": True, "reason": "400 on 1 closed curve"}


def test_more_load_steps_take_more_time() -> None:
    scene = load_scene("paper-1")
    single, twice = (plan_of(dataclasses.replace(scene, load_factors=factors)) for factors in ((1.0,), (0.5, 1.0)))
    assert single.seconds < twice.seconds < 2.0 * single.seconds


class Borrowed(CollocationElasticity):
    """A map of somebody else, which counts like collocation."""


class BorrowedCollocation(bk.ConstantCollocation):
    def elastic_map(self, mesh: bk.BoundaryMesh, material: Material, linear_solver: LinearSolver) -> Borrowed:
        return Borrowed(mesh, material)


def test_memory_and_time_of_a_map_of_ones_own_follow_from_its_counts() -> None:
    built_in = dataclasses.replace(load_scene("paper-1"), linear_solver=bk.DenseCholesky())
    own = dataclasses.replace(built_in, discretisation=BorrowedCollocation())
    expected, found = plan_of(built_in), plan_of(own)
    assert found.work.factorisations
    assert (found.memory, found.seconds, found.work) == (expected.memory, expected.seconds, expected.work)


TRACED = {
    "constant": with_overrides(load_scene("paper-1"), elements=240),
    "linear": with_overrides(load_scene("paper-1"), elements=200, discretisation="linear"),
    "quadratic": with_overrides(load_scene("paper-1"), elements=120, discretisation="quadratic"),
    "frictionless": with_overrides(load_scene("wavy-obstacle"), elements=200, discretisation="linear"),
    "contact all along": with_overrides(load_scene("receding-layer"), elements=200, discretisation="constant"),
    "curved": with_overrides(load_scene("disc-between-plates"), elements=200, discretisation="linear"),
    "few linear": with_overrides(load_scene("paper-1"), elements=100, discretisation="linear"),
    "few curved": with_overrides(load_scene("disc-between-plates"), elements=50, discretisation="quadratic"),
    "degree 3": with_overrides(load_scene("paper-1"), elements=36, degree=3),
    "degree 5": with_overrides(load_scene("paper-1"), elements=60, degree=5),
    "degree 9": with_overrides(load_scene("paper-1"), elements=40, degree=9),
    "curved of degree 6": with_overrides(load_scene("disc-between-plates"), elements=50, degree=6),
}


def traced(small: bk.Scene, scene: bk.Scene) -> bk.Solution:
    """Return the solution of a scene with the memory of its steps; the small one loads what is loaded on first use."""
    bk.run(small)
    tracemalloc.start()
    try:
        return bk.run(scene)
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    "kind",
    slow_only(
        TRACED,
        "constant",
        "linear",
        "frictionless",
        "degree 3",
        "degree 5",
        "curved",
        "degree 9",
        "curved of degree 6",
        "contact all along",
        "few curved",
    ),
)
def test_the_largest_memory_is_foreseen(kind: str) -> None:
    """Within a fifth: a model of what is alive at once knows no temporary array of a line of code.

    The mesh is a matter of kilobytes.
    """
    solution = traced(with_overrides(TRACED[kind], elements=40), TRACED[kind])
    assert solution.is_converged
    assert max(solution.memory.values()) == pytest.approx(solution.plan.memory, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("n_elements", [3000, 10_000, 100_000])
def test_the_largest_memory_of_compressed_equations_is_foreseen(n_elements: int) -> None:
    """With and without compiled kernels."""
    scene = load_scene("paper-1")
    scene = dataclasses.replace(scene, discretisation=bk.ConstantCollocation(), linear_solver=bk.Hierarchical())
    solution = traced(with_overrides(scene, elements=400), with_overrides(scene, elements=n_elements))
    assert solution.plan.is_compressed
    assert max(solution.memory.values()) == pytest.approx(solution.plan.memory, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("n_elements", [3000, 10_000])
def test_the_largest_memory_of_equations_that_are_not_stored_is_foreseen(n_elements: int) -> None:
    """With compiled kernels and without."""
    scene = dataclasses.replace(load_scene("paper-1"), discretisation=bk.ConstantCollocation())
    scene = dataclasses.replace(scene, linear_solver=bk.MatrixFree())
    solution = traced(with_overrides(scene, elements=400), with_overrides(scene, elements=n_elements))
    assert any("fast multipole" in item.reason for item in solution.plan.items)
    assert max(solution.memory.values()) == pytest.approx(solution.plan.memory, rel=0.2)


def test_what_does_not_fit_is_refused_before_it_is_tried(memory: Callable[[float], None]) -> None:
    plan = plan_of(load_scene("paper-1"))
    check_memory(plan)
    memory(0.25 * plan.memory)
    message = f"320 elements need about {plan.memory / 1e9:.3g} GB, there are .* GB: use at most 160 elements"
    with pytest.raises(TooLargeError, match=message):
        check_memory(plan)
    with pytest.raises(TooLargeError, match="use at most 160 elements"):
        bk.run(load_scene("paper-1"))


def test_a_limit_of_the_process_counts_as_its_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    resource = pytest.importorskip("resource")
    whole, limits = physical_memory(), [resource.RLIM_INFINITY]
    monkeypatch.setattr(resource, "getrlimit", lambda _: (limits[-1],) * 2)
    assert physical_memory() == whole
    limits.append(1 << 30)
    assert physical_memory() < float(1 << 30)  # what the interpreter takes is off
    limits.append(1 << 20)
    with pytest.raises(TooLargeError, match=r"320 elements need about \S+ GB, there are 0 GB"):
        bk.run(load_scene("paper-1"))


@pytest.mark.parametrize("command", ["run", "plan"])
def test_a_million_elements_are_refused_before_the_mesh_is_made(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    built: list[int | None] = []
    divided = BodyScene.divided

    def watched(scene: BodyScene, *arguments: Any) -> bk.BoundaryMesh:
        built.append(scene.mesh.elements)
        return divided(scene, *arguments)

    monkeypatch.setattr(BodyScene, "divided", watched)
    with pytest.raises(SystemExit, match="2"):
        main([command, "paper-1", "--elements", "1000000", "--degree", "3"])
    message = r"1000000 elements need about \S+ GB, there are \S+ GB: use at most \d+ elements"
    assert re.search(message, capsys.readouterr().err)
    assert max(filter(None, built)) <= 5000  # small ones, by which the large one is judged


@pytest.mark.slow
def test_the_memory_of_large_meshes_is_told_from_a_small_one(memory: Callable[[float], None]) -> None:
    scene = bk.load_scene("paper-1")
    # collocation compares the distances of all elements, which takes seconds
    large = with_overrides(scene, elements=12_000, degree=3)
    needed = make_plan(large, large.build_mesh()).memory
    # the parts that grow more slowly than the square are a few thousandths
    memory(1.01 * needed)
    check_elements(large)
    memory(0.99 * needed)
    with pytest.raises(TooLargeError, match=r"use at most 119.. elements"):
        check_elements(large)
