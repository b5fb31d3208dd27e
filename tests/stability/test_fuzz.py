"""Random scenes: an answer that the independent check accepts, or a named failure with a remedy, and nothing else."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import bemkit as bk
from bemkit.stability.evidence import examine

REMEDY = re.compile(
    r"\b(give|use|change|hold|raise|make|check|try|start|allow|choose|remove|restrict|list|subtract|move|keep|press)\b"
)


def decades(low: int, high: int) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda power: float(10.0**power))


@st.composite
def shapes(draw: st.DrawFn) -> bk.Rectangle | bk.Polygon | bk.Disk | bk.Ring | bk.PlateWithHole:
    size = draw(decades(-6, 6))
    kind = draw(st.sampled_from(["rectangle", "polygon", "disk", "ring", "plate"]))
    if kind == "rectangle":
        corner = (size * draw(st.floats(-3.0, 3.0)), size * draw(st.floats(-3.0, 3.0)))
        return bk.Rectangle(size, size * draw(decades(-2, 2)), corner=corner)
    if kind == "polygon":
        turns = np.cumsum(draw(st.lists(st.floats(0.2, 1.0), min_size=3, max_size=6)))
        angles = 2.0 * np.pi * turns / turns[-1]
        return bk.Polygon(tuple((size * float(np.cos(a)), size * float(np.sin(a))) for a in angles))
    if kind == "disk":
        return bk.Disk(size, centre=(0.0, size))
    if kind == "ring":
        return bk.Ring(size, size * (1.0 + draw(decades(-1, 1))))
    return bk.PlateWithHole(4.0 * size, 3.0 * size, size * draw(st.floats(0.2, 1.2)))


@st.composite
def conditions(draw: st.DrawFn, size: float, modulus: float) -> object:
    stress = modulus * draw(decades(-9, -2)) * draw(st.sampled_from([-1.0, 0.0, 1.0, 1.0]))
    motion = size * draw(decades(-9, -2)) * draw(st.sampled_from([-1.0, 0.0, 1.0]))
    kind = draw(st.sampled_from(["free", "clamped", "roller", "roller", "motion", "traction", "pressure", "pressure"]))
    match kind:
        case "clamped":
            return bk.Clamped()
        case "roller":
            return bk.Roller()
        case "motion":
            return (
                bk.PrescribedDisplacement(y=motion) if draw(st.booleans()) else bk.PrescribedDisplacement(motion, 0.0)
            )
        case "traction":
            return bk.Traction(x=stress, y=bk.Expression(f"{-abs(stress)!r} * (1 + x / {size!r})"))
        case "pressure":
            return bk.Pressure(stress, shear=draw(st.sampled_from([0.0, 0.1, 1.0])) * stress)
    return None


@st.composite
def obstacles(draw: st.DrawFn, size: float) -> object:
    gap = size * draw(decades(-12, 0)) * draw(st.sampled_from([-1e-2, 0.0, 0.0, 1.0]))
    kind = draw(st.sampled_from(["gap", "gap", "bump", "plane", "circle"]))
    match kind:
        case "bump":
            return bk.Gap(bk.Expression(f"{gap!r} + x**2 / {size!r}"))
        case "plane":
            return bk.HalfPlane(point=(0.0, -gap), normal=draw(st.sampled_from([(0.0, 1.0), (0.1, 1.0), (1.0, 0.0)])))
        case "circle":
            return bk.Circle((0.0, -10.0 * size - gap), 10.0 * size)
    return bk.Gap(gap)


@st.composite
def laws(draw: st.DrawFn, modulus: float) -> object:
    friction = draw(st.sampled_from([0.0, 0.1, 0.5, 1.0, 3.0, 100.0]))
    stress = modulus * draw(decades(-9, -3))
    kind = draw(st.sampled_from(["coulomb", "coulomb", "coulomb", "frictionless", "tresca", "cohesive"]))
    match kind:
        case "frictionless":
            return bk.Frictionless()
        case "tresca":
            return bk.Tresca(stress)
        case "cohesive":
            return bk.CohesiveCoulomb(friction, cohesion=draw(st.sampled_from([0.0, stress])), cap=10.0 * stress)
    return bk.Coulomb(friction)


@st.composite
def scenes(draw: st.DrawFn) -> dict[str, object]:
    shape = draw(shapes())
    sides = [side.name for loop in shape.outline().loops for side in loop]
    points = np.concatenate([side.curve.point(np.array([0.0])) for loop in shape.outline().loops for side in loop])
    size = float(np.ptp(points, axis=0).max())
    modulus = draw(decades(-6, 12))
    touching = draw(st.sets(st.sampled_from(sides), min_size=1, max_size=3))
    parts = [bk.Part(f"touching {side}", bk.Contact(draw(obstacles(size))), sides=(side,)) for side in sorted(touching)]
    for side in sides:
        condition = None if side in touching else draw(conditions(size, modulus))
        if condition is not None:
            parts.append(bk.Part(side, condition, sides=(side,)))
    return {
        "title": "random",
        "shape": shape,
        "material": bk.Material(modulus, draw(st.sampled_from([-0.5, 0.0, 0.2, 0.3, 0.49, 0.4999999, 0.5]))),
        "parts": tuple(parts),
        "law": draw(laws(modulus)),
        "discretisation": draw(
            st.sampled_from([bk.LinearGalerkin(), bk.ConstantCollocation(), bk.QuadraticGalerkin()])
        ),
        "mesh": bk.MeshOptions(draw(st.integers(12, 40)), draw(st.sampled_from([bk.Uniform(), bk.Algebraic(2.0)]))),
        "solver": draw(
            st.sampled_from(
                [bk.SemismoothNewton(), bk.SemismoothNewton(rho=1e-3), bk.AugmentedLagrangian(max_steps=50)]
            )
        ),
    }


def assert_honest(scene: dict[str, object]) -> None:
    """Solve the scene; whatever comes out must be right or a named failure that says what to do."""
    try:
        solution = bk.run(bk.Scene(**scene))  # type: ignore[arg-type]
    except (ValueError, ArithmeticError) as error:
        if not type(error).__module__.startswith("bemkit."):
            raise
        refusal = str(error)
    else:
        refusal = "" if solution.is_converged else solution.message
    if refusal:
        assert REMEDY.search(refusal), f"no remedy: {refusal}"
        return
    for name, column in solution.contact.columns().items():
        assert np.isfinite(column).all() or name in ("gap", "clearance"), name
    assert np.isfinite(solution.boundary.displacement).all()
    assert np.isfinite(solution.boundary.traction).all()
    evidence = examine(solution)
    assert evidence.is_good, dataclasses.asdict(evidence)


@settings(max_examples=100, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much], deadline=None)
@given(scenes())
def test_random_scenes_end_in_the_right_answer_or_a_named_failure(scene: dict[str, object]) -> None:
    assert_honest(scene)


@pytest.mark.slow
@settings(
    max_examples=2000,
    derandomize=False,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
    deadline=None,
    print_blob=True,
)
@given(scenes())
def test_many_random_scenes(scene: dict[str, object]) -> None:
    assert_honest(scene)
