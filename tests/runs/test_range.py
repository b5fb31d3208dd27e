"""Scenes at the edge of the range of floating-point numbers are solved or refused, and never right by name only."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partialmethod
from typing import Any

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.body import ContactState
from bemkit.errors import GeometryError
from bemkit.geometry.vectors import check_magnitude
from bemkit.model.model import Model
from bemkit.model.units import OutOfRangeError
from bemkit.scene.toml import with_overrides
from tests.slow import slow_except

ELEMENTS = [bk.Galerkin(1), bk.ConstantCollocation()]


def block(
    modulus: float = 1e4, size: float = 1.0, load: float = 1.0, lowered: float | None = None, is_contact: bool = True
) -> bk.Scene:
    top = bk.Traction(y=-load) if lowered is None else bk.PrescribedDisplacement(y=-lowered)
    return bk.Scene(
        title="block",
        shape=bk.Rectangle(size, size),
        material=bk.Material(modulus, 0.2),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()) if is_contact else bk.Clamped(), sides=("bottom",)),
            bk.Part("wall", bk.Roller(), sides=("right",)),
            bk.Part("top", top, sides=("top",)),
        ),
        mesh=bk.MeshOptions(elements=12),
    )


@pytest.mark.parametrize("is_contact", [True, False])
@pytest.mark.parametrize("element", ELEMENTS, ids=lambda element: type(element).__name__)
@pytest.mark.parametrize(
    ("extreme", "name"),
    [
        ({"modulus": 5e-324}, "stiffness is about"),
        ({"modulus": 1e-310}, "stiffness is about 1.0e-310"),
        ({"modulus": 1e300}, "stiffness is about"),
        ({"load": 5e-324}, "stress is about 4.9e-324"),
        ({"load": 1e-300}, "stress is about"),
        ({"load": 1.7e308}, "stress is about 1.7e\\+308"),
        ({"modulus": 1e-100, "load": 1e100}, "strain is about"),
        ({"modulus": 1.0, "load": 1e100, "size": 1e100}, "displacement is about"),
        ({"modulus": 1e139, "load": 1e139, "size": 1e139}, "root of the energy is about"),
        ({"lowered": 1e-310}, "stress is about"),
        ({"lowered": 1e308}, "stress is about inf"),
    ],
)
def test_what_would_overflow_or_vanish_is_refused(
    extreme: dict[str, float], name: str, element: bk.scene.Discretisation, is_contact: bool
) -> None:
    scene = dataclasses.replace(block(is_contact=is_contact, **extreme), discretisation=element)
    with pytest.raises(OutOfRangeError, match=rf"the {name}.* choose units in which"):
        bk.run(scene)


@pytest.mark.parametrize("factor", [1e308, 1e-310])
def test_load_steps_out_of_range_are_refused(factor: float) -> None:
    with pytest.raises(OutOfRangeError, match="the stress is about"):
        bk.run(dataclasses.replace(block(), load_factors=(1.0, factor)))


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda element: type(element).__name__)
@pytest.mark.parametrize("scale", slow_except([1e-60, 1e60], 1e-60))
def test_within_the_range_nothing_is_lost(element: bk.scene.Discretisation, scale: float) -> None:
    expected = bk.run(dataclasses.replace(block(), discretisation=element))
    for extreme, power in (({"modulus": 1e4 * scale}, -1), ({"load": scale}, 2), ({"size": scale}, 2)):
        solution = bk.run(dataclasses.replace(block(**extreme), discretisation=element))
        assert solution.is_converged
        # the same numbers inside, so that only units are multiplied
        assert solution.energy == pytest.approx(expected.energy * scale**power, rel=1e-10)


@pytest.mark.parametrize("size", [1e-320, 1e-200, 1e160, 1e300, 1e308])
def test_bodies_out_of_range_are_refused(size: float) -> None:
    with pytest.raises(GeometryError, match=r"Outline: the boundary measures .* choose a unit of length"):
        block(size=size)
    with pytest.raises(GeometryError, match=r"BoundaryMesh: the boundary measures .* choose a unit of length"):
        bk.BoundaryMesh(size * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([[0, 1], [1, 2], [2, 0]]))


def test_a_point_that_is_no_number_has_no_magnitude() -> None:
    with pytest.raises(GeometryError, match="curve: the boundary measures nan"):
        check_magnitude(np.array([[0.0, np.nan], [1.0, 0.0]]), "curve")


@pytest.fixture
def with_fields(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[..., Any]], None]:
    """Return a function that lets another one make the fields of models, of theirs, the model and its state."""
    actual = Model.boundary_fields
    return lambda other: monkeypatch.setattr(Model, "boundary_fields", partialmethod(other, actual))


@pytest.mark.parametrize("is_contact", [True, False])
def test_results_that_are_not_finite_are_never_converged(is_contact: bool, with_fields) -> None:
    """Whatever overflows on the way back to physical units."""

    def overflowing(model: Model, actual: Callable[..., Any], state: ContactState) -> Any:
        return [(displacement, traction, np.inf) for displacement, traction, _ in actual(model, state)]

    with_fields(overflowing)
    assert bk.run(block(is_contact=is_contact)).status is bk.Status.NOT_FINITE


def test_states_that_are_not_finite_end_as_a_status_without_warnings_of_numpy(with_fields) -> None:
    """As random scene 117 of seed 3002, a plate that nothing holds sideways, on its way to infinity."""

    def infinite(model: Model, actual: Callable[..., Any], state: ContactState) -> Any:
        return actual(model, ContactState(np.full_like(state.displacement, np.inf), state.traction))

    with_fields(infinite)
    solution = bk.run(block())
    assert solution.status is bk.Status.NOT_FINITE
    assert np.isnan(solution.energy)


@pytest.mark.slow
def test_so_do_those_of_several_bodies(with_fields) -> None:
    def infinite(model: Model, actual: Callable[..., Any], state: ContactState) -> Any:
        return actual(model, ContactState(state.displacement, np.full_like(state.traction, np.inf)))

    with_fields(infinite)
    solution = bk.run(with_overrides(bk.load_scene("two-cylinders"), discretisation="hp", accuracy=0.05))
    assert solution.status is bk.Status.NOT_FINITE
    assert np.isnan(solution.energy)
    assert solution.warnings == solution.plan.warnings  # of what is not certified nothing else is in doubt
