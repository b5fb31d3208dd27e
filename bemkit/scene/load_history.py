"""Load histories: one scene after the other in time, with slip counted from the end of the step before.

Under the static law slip is the total displacement, as if the whole load came at once. Under the incremental law slip
counts from the last step: a point that sticks under the first tenth of the load keeps that place as its new origin. For
a cylinder pressed into a block the stick zones of the two laws differ in size by a factor of two.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.formulas import Expression, ExpressionError, ScalarField
from bemkit.scene.body_forces import scaled_body_force
from bemkit.scene.conditions import Contact, with_fields
from bemkit.scene.scene import Scene
from bemkit.scene.steps import Step, TimeValue

if TYPE_CHECKING:
    from bemkit.scene.body import Body

_TIME, _COORDINATES = re.compile(r"\bt\b"), re.compile(r"\b[xy]\b")


def load_steps(scene: Scene) -> tuple[Scene, ...]:
    """Return the steps of a load history, each a scene of its own.

    Returns
    -------
    tuple of Scene
        One for each increment of each step, or for each load factor. Each has a single load and, in a history, a single
        step with a time and nothing else.

    Raises
    ------
    SceneKeyError
        If a step names a place that the scene does not have, or a value that does not fit there.
    """
    if scene.is_one_load:
        return (scene,)
    if not scene.steps and len(scene.load_factors) == 1:
        return (with_scaled_loads(scene, scene.load_factors[0]),)
    factors = enumerate(scene.load_factors, start=1)
    steps = scene.steps or [Step(float(number), load_factor=factor) for number, factor in factors]
    base: Scene = replace(scene, load_factors=(1.0,), steps=(Step(steps[-1].time),))
    states: list[Scene] = []
    changes: dict[str, Any] = {}
    load_factor: TimeValue = 1.0
    last = 0.0
    for number, step in enumerate(steps):
        changes = {**{place: value for place, value in changes.items() if place not in step.changes}, **step.changes}
        load_factor = load_factor if step.load_factor is None else step.load_factor
        for increment in range(1, step.increments + 1):
            time = (
                step.time if increment == step.increments else last + (step.time - last) * increment / step.increments
            )
            try:
                states.append(_at_time(base, changes, load_factor, time))
            except ValueError as error:
                raise type(error)(f"steps[{number}]: {error}") if scene.steps else error from error
        # values at the end of a step hold in the steps after it
        last, load_factor = step.time, _value(load_factor, step.time)
        changes = {place: _value(value, step.time) for place, value in changes.items()}
    return tuple(states)


def with_changed_steps(scene: Scene, change: Callable[[Scene], Scene]) -> Scene:
    """Return a scene with each of its load steps changed.

    Parameters
    ----------
    scene : Scene
    change : callable
        Takes a scene of one step, and returns the changed one.

    Returns
    -------
    Scene
        If it has several steps, their changes are Python objects, which a file cannot hold.
    """
    first, *others = (change(step) for step in load_steps(scene))
    if not others:
        return first
    excluded = ("title", "steps", "load_factors")
    names = [entry.name for entry in fields(first) if entry.init and entry.name not in excluded]
    names = [name for name in names if any(getattr(step, name) != getattr(first, name) for step in others)]
    steps = [Step(step.steps[0].time, {name: getattr(step, name) for name in names}) for step in (first, *others)]
    return replace(first, steps=tuple(steps))


def _at_time(scene: Scene, changes: Mapping[str, Any], factor: TimeValue, time: float) -> Scene:
    """Return a scene at a time of its history, under the changes that hold there."""
    from bemkit.scene.keys import Key, with_value

    for place, value in changes.items():
        if place.partition(".")[0] == "law" and not _has_contact_of_its_law(scene):
            raise InputError(
                f"{place} changes, but every contact has a law of its own: change these, such as "
                "parts.<name>.condition.law or contacts[0].law"
            )
        scene = with_value(scene, Key(place), _value(value, time))
    scaled = _value(factor, time)
    if not isinstance(scaled, int | float) or not math.isfinite(scaled):
        raise InputError(f"load_factor is {scaled!r} at t = {time:g}: give a number, or a formula of t only")
    return replace(with_scaled_loads(scene, float(scaled)), steps=(Step(time),))


def _has_contact_of_its_law(scene: Scene) -> bool:
    """Whether a contact, or one that may be found, takes the law of the scene."""
    parts = [*scene.parts, *(part for body in scene.bodies for part in body.parts)]
    contacts = [part.condition for part in parts if isinstance(part.condition, Contact)]
    found = () if scene.touching is None else (scene.touching,)
    return any(each.law is None for each in (*contacts, *scene.contacts, *found))


def _value(value: Any, time: float) -> Any:
    """Evaluate functions and formulas of the time t; formulas of x and y remain."""
    if isinstance(value, Expression) or not (callable(value) or isinstance(value, str)):
        return value
    if not isinstance(value, str):
        return value(time)
    text = _TIME.sub(f"({time!r})", value)
    if _COORDINATES.search(text):
        return text
    try:
        formula = Expression(text)
    except ExpressionError:
        if text != value:
            raise
        return value  # a word
    return text if formula.is_condition else float(formula(0.0, 0.0))


def with_scaled_loads(scene: Scene, factor: float) -> Scene:
    """Return a scene whose loads, prescribed displacements and body forces are multiplied by a number.

    Returns
    -------
    Scene
        With the load factor 1; obstacles, gaps, laws, and body forces that are constant are unchanged.
    """
    if factor == 1.0 and scene.load_factors == (1.0,):
        return scene
    changes: dict[str, Any] = {"load_factors": (1.0,)}
    known: dict[int, Any] = {}
    changes |= _scaled(scene, factor, known)
    changes["rigid"] = tuple(body.scaled(factor) for body in scene.rigid)
    changes["bodies"] = tuple(replace(body, **_scaled(body, factor, known)) for body in scene.bodies)
    return replace(scene, **changes)


def _scaled(loaded: Scene | Body, factor: float, known: dict[int, Any]) -> dict[str, Any]:
    """Return parts, body forces and the far field under scaled loads; those without loads are the same objects.

    Bodies continue to share objects: `known` maps the identity of each to its scaled copy.
    """

    def scaled(field: ScalarField) -> ScalarField:
        return _times(factor, field)

    for part in loaded.parts:
        if id(part) not in known:
            condition = with_fields(part.condition, scaled, scaled)
            known[id(part)] = part if condition is part.condition else replace(part, condition=condition)
    for force in loaded.body_forces:
        if id(force) not in known:
            known[id(force)] = force if force.is_constant else scaled_body_force(force, factor)
    return {
        "parts": tuple(known[id(part)] for part in loaded.parts),
        "body_forces": tuple(known[id(force)] for force in loaded.body_forces),
        "far": None if loaded.far is None else loaded.far.scaled(factor),
    }


@dataclass(frozen=True)
class _ScaledFunction:
    """A function of the coordinates times a number."""

    function: Callable[[FloatArray, FloatArray], FloatArray]
    factor: float

    def __call__(self, x: FloatArray, y: FloatArray) -> FloatArray:
        return self.factor * self.function(x, y)


def _times(factor: float, value: ScalarField) -> ScalarField:
    if factor == 1.0:
        return value
    if isinstance(value, Expression):
        return Expression(f"{factor!r} * ({value.text})")
    if callable(value):
        return _ScaledFunction(value, factor)
    return factor * value
