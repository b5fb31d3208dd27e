"""Bodies of one assembly that other threads, processes and computers assemble and factor."""

from __future__ import annotations

import os
import pickle
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from multiprocessing import get_context, parent_process
from typing import Any

import numpy as np
import pytest

import bemkit as bk
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.model.shapes import NotSentError
from bemkit.operators.linear_solvers import SingularMatrixError
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.results.solution import Solution

SAME = 1e-9
"""The same operations on the same numbers, but BLAS may take another number of threads."""


@pytest.fixture(scope="module")
def processes() -> Iterator[ProcessPoolExecutor]:
    with ProcessPoolExecutor(1, get_context("spawn")) as executor:
        yield executor


def coarse(name: str = "pin-in-plate", discretisation: Any = None, n_elements: int = 40, **changes: Any) -> bk.Scene:
    loaded = bk.load_scene(name)
    assert isinstance(loaded, bk.Scene)
    mesh = replace(loaded.mesh, elements=n_elements, accuracy=None)
    return replace(loaded, discretisation=discretisation or bk.Galerkin(1), mesh=mesh, **changes)


def assert_same(one: Solution, other: Solution) -> None:
    assert one.is_converged
    assert other.is_converged
    size = np.abs(one.contact.sigma_n).max()
    np.testing.assert_allclose(other.contact.sigma_n, one.contact.sigma_n, atol=SAME * size)
    for name, body in one.bodies.items():
        assert other.bodies[name].energy == pytest.approx(body.energy, rel=SAME)


@pytest.mark.parametrize(
    ("name", "discretisation", "changes"),
    [
        ("pin-in-plate", bk.ConstantCollocation(), {}),
        pytest.param("masonry-arch", bk.Galerkin(1), {}, marks=pytest.mark.slow),  # copies, and their weight
        pytest.param("pin-in-plate", bk.Galerkin(2), {"load_factors": (0.5, 1.0)}, marks=pytest.mark.slow),
        pytest.param(
            "pin-in-plate",
            bk.ConstantCollocation(),
            {"n_elements": 400, "linear_solver": bk.Hierarchical()},
            marks=pytest.mark.slow,
        ),
    ],
)
def test_processes_give_the_same(processes: Executor, name: str, discretisation: Any, changes: Any) -> None:
    bodies = coarse(name, discretisation, **changes)
    assert_same(bk.run(bodies), bk.run(bodies, executor=processes))


@pytest.mark.slow
def test_meshes_that_follow_the_solution_give_the_same(processes: Executor) -> None:
    pin = bk.load_scene("pin-in-plate")
    assert_same(bk.run(pin), bk.run(pin, executor=processes))


@pytest.mark.slow
def test_load_steps_ask_nothing_of_the_executor() -> None:
    steps = coarse(load_factors=(0.5, 1.0))
    counted = Counted()
    assert_same(bk.run(steps), bk.run(steps, executor=counted))
    assert counted.n_calls == len(steps.bodies)


def test_copies_are_factored_once() -> None:
    arch, counted = coarse("masonry-arch"), Counted()
    bk.run(arch, executor=counted)
    assert counted.n_calls == len(arch.bodies)


def test_a_cluster_gives_the_same() -> None:
    distributed = pytest.importorskip("distributed")
    with ExitStack() as stack:
        local = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
        client = stack.enter_context(distributed.Client(stack.enter_context(local)))
        there = bk.run(coarse(), executor=client.get_executor())
    assert_same(bk.run(coarse()), there)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("paper-1", {"discretisation": bk.Galerkin(1)}),
        ("paper-1", {"discretisation": bk.ConstantCollocation()}),
        ("gravity-column", {}),
    ],
)
def test_condensed_bodies_can_be_sent(name: str, changes: Any) -> None:
    scene = bk.load_scene(name)
    scene = replace(scene, mesh=replace(scene.mesh, elements=24, accuracy=None, density={}), **changes)
    model = build_model(prepare(scene, scene.build_mesh()))
    condensed = model.elastic[0].condense(model.prepared.only.conditions, model.prepared.only.force)
    sent = pickle.loads(pickle.dumps(condensed))
    displacement = np.linspace(-1.0, 1.0, len(condensed.load))
    force, fixed = condensed.recover(displacement)[1], np.zeros_like(condensed.recover(displacement)[0])
    for one, other in (
        (condensed.recover(displacement), sent.recover(displacement)),
        (condensed.under(force, fixed).recover(displacement), sent.under(force, fixed).recover(displacement)),
    ):
        np.testing.assert_array_equal(one, other)


class Counted(Executor):
    """Works at once, on a copy of what it gets, as another process does."""

    n_calls = 0

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Call a function."""
        self.n_calls += 1
        future: Future[Any] = Future()
        try:
            future.set_result(pickle.loads(pickle.dumps(fn(*pickle.loads(pickle.dumps(args)), **kwargs))))
        except Exception as error:
            future.set_exception(error)
        return future


def test_one_body_is_condensed_elsewhere_or_not_at_all(processes: Executor) -> None:
    scene = replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=48))
    here, there = bk.run(scene), bk.run(scene, executor=processes)
    np.testing.assert_allclose(here.contact.sigma_n, there.contact.sigma_n, rtol=1e-13)
    with pytest.raises(bk.InputError, match="the only body is not condensed onto contact nodes: remove it"):
        bk.run(bk.load_scene("bending"), executor=processes)


class Fading(bk.Galerkin):
    """Elements that end the process which assembles them, or that no other process can be told of."""

    def __init__(self, secret: Any = None) -> None:
        super().__init__(1)
        object.__setattr__(self, "secret", secret)

    def elastic_map(self, *arguments: Any) -> Any:
        """Return a map that leaves."""
        elastic = FadingMap(*arguments[:2])
        elastic.secret = vars(self)["secret"]
        return elastic


class FadingMap(GalerkinElasticity):
    """A map that ends another process."""

    secret: Any

    def condense(self, *arguments: Any) -> Any:
        """Leave, if this is another process."""
        assert parent_process() is not None
        os._exit(1)


class Loose(bk.Galerkin):
    """Elements of bodies that nothing holds."""

    def elastic_map(self, *arguments: Any) -> Any:
        """Return a map that refuses."""
        return LooseMap(*arguments[:2])


class LooseMap(GalerkinElasticity):
    """A map that cannot be condensed."""

    def condense(self, *arguments: Any) -> Any:
        """Refuse."""
        raise SingularMatrixError("nothing holds it")


def test_what_cannot_be_sent_is_named(processes: Executor) -> None:
    bodies = coarse(discretisation=Fading(secret=lambda: None))
    with pytest.raises(NotSentError, match=r"body 'plate' cannot be sent to another process \(.*: write its functions"):
        bk.run(bodies, executor=processes)


def test_a_process_that_ends_is_named() -> None:
    with ProcessPoolExecutor(1, get_context("spawn")) as executor:
        with pytest.raises(NotSentError, match=r"the executor broke down \(.*\): take fewer processes, or remove it"):
            bk.run(coarse(discretisation=Fading()), executor=executor)


def test_errors_of_bodies_come_back(processes: Executor) -> None:
    with pytest.raises(SingularMatrixError, match="body 'plate': nothing holds it"):
        bk.run(coarse(discretisation=Loose(1)), executor=processes)
