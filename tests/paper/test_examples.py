"""The paper's two examples at N = 320 against the independent reference, for both element types and both drivers."""

from __future__ import annotations

import dataclasses
import json
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import FloatArray
from tests.slow import slow_except

REFERENCE = Path(__file__).parents[1] / "reference" / "data"
DISCRETISATIONS = {"constant": bk.ConstantCollocation(), "linear": bk.Galerkin(1)}
SOLVERS = {"ssn": bk.SemismoothNewton(), "alm": bk.AugmentedLagrangian()}


@lru_cache
def solved(example: int, discretisation: str, solver: str) -> bk.Solution:
    scene = bk.load_scene(f"paper-{example}")
    scene = dataclasses.replace(scene, discretisation=DISCRETISATIONS[discretisation], solver=SOLVERS[solver])
    return bk.run(scene)


@lru_cache
def scalars(example: int) -> dict[str, float]:
    data = json.loads((REFERENCE / f"paper-{example}.json").read_text())
    values = {name: entry["value"] for name, entry in data["scalars"].items()}
    return values | {f"transition_{k}": entry["x"] for k, entry in enumerate(data["transitions"])}


def relative_error(example: int, solution: bk.Solution, *names: str) -> float:
    """Relative L2 error of some columns of the contact table."""
    table = np.genfromtxt(REFERENCE / f"paper-{example}.csv", delimiter=",", names=True)
    contact = solution.contact
    miss = size = 0.0
    for name in names:
        exact: FloatArray = np.interp(contact.x, table["x"], table[name])
        miss += float(np.sum(contact.weight * (getattr(contact, name) - exact) ** 2))
        size += float(np.sum(contact.weight * exact**2))
    return float(np.sqrt(miss / size))


CASES = [
    pytest.param((example, driver), id=f"paper-{example}-{driver}", marks=marks)
    for example, driver, marks in ((1, "ssn", ()), (1, "alm", ()), (2, "ssn", ()), (2, "alm", pytest.mark.slow))
]


@pytest.fixture(params=CASES)
def case(request: pytest.FixtureRequest) -> tuple[int, str]:
    return request.param  # type: ignore[no-any-return]


@pytest.mark.parametrize("discretisation", slow_except(["constant", "linear"], "constant"))
def test_result_is_certified(case: tuple[int, str], discretisation: str) -> None:
    solution = solved(case[0], discretisation, case[1])
    assert solution.status is bk.Status.CONVERGED
    assert solution.mesh.n_elements == 320
    assert solution.certificate.worst <= 1e-8  # the drivers stop at 1e-9
    # equilibrium is built into both maps: only round-off is left
    assert solution.force_normal == pytest.approx({1: 0.5, 2: 1.0 / 60.0}[case[0]], rel=1e-10)


@pytest.mark.parametrize(
    ("discretisation", "force", "displacement", "pressure"),
    [("constant", 1e-2, 4e-2, 1e-2), ("linear", 1e-3, 3e-3, 3e-3)],
)
def test_fields_and_friction_force_agree_with_the_reference(
    case: tuple[int, str], discretisation: str, force: float, displacement: float, pressure: float
) -> None:
    # the discretisation errors on these meshes, with a margin of a fifth or more
    example, solver = case
    solution = solved(example, discretisation, solver)
    assert solution.force_tangential == pytest.approx(scalars(example)["Ft"], rel=force)
    assert relative_error(example, solution, "u_n", "u_t") <= displacement
    assert relative_error(example, solution, "sigma_n") <= pressure


@pytest.mark.parametrize("discretisation", ["constant", "linear"])
def test_transitions_lie_within_one_element(case: tuple[int, str], discretisation: str) -> None:
    example, solver = case
    solution = solved(example, discretisation, solver)
    assert [(t.from_status, t.to_status) for t in solution.transitions] == [("separated", "slip"), ("slip", "stick")]
    for k, transition in enumerate(solution.transitions):
        exact = scalars(example)[f"transition_{k}"]
        elements = solution.mesh.part("foundation")
        start, end = solution.mesh.start[elements, 0], solution.mesh.end[elements, 0]
        length = float((end - start)[np.argmax((start <= exact) & (exact <= end))])
        assert abs(transition.x - exact) <= length


def test_corner_displacement_and_energy_of_linear_elements(case: tuple[int, str]) -> None:
    example, solver = case
    solution = solved(example, "linear", solver)
    corner = int(np.argmin(np.hypot(*solution.boundary.points.T)))
    expected = [scalars(example)["ux0"], scalars(example)["uy0"]]
    np.testing.assert_allclose(solution.boundary.displacement[corner], expected, rtol=1e-3)  # measured 4e-4
    assert solution.energy == pytest.approx(scalars(example)["energy"], rel=1e-4)  # measured 2e-6


@pytest.mark.parametrize("example", [1, 2])
@pytest.mark.parametrize("discretisation", ["constant", "linear"])
def test_both_drivers_reach_the_same_state(example: int, discretisation: str) -> None:
    newton, augmented = (solved(example, discretisation, solver).contact for solver in ("ssn", "alm"))
    np.testing.assert_array_equal(newton.status, augmented.status)
    for names in (("u_n", "u_t"), ("sigma_n", "sigma_t")):
        size = max(np.abs(getattr(newton, name)).max() for name in names)
        for name in names:
            # both are certified to 1e-9
            np.testing.assert_allclose(getattr(newton, name), getattr(augmented, name), rtol=0.0, atol=1e-7 * size)


@pytest.mark.parametrize("example", [1, 2])
@pytest.mark.parametrize("discretisation", slow_except(["constant", "linear"], "constant"))
@pytest.mark.parametrize("rho", slow_except([1e-4, 1e-2, 1.0, 1e2, 1e4, 1e8], 1e-4, 1e8))
def test_newton_needs_at_most_ten_linear_solves_for_any_rho(example: int, discretisation: str, rho: float) -> None:
    scene = bk.load_scene(f"paper-{example}")
    solver = bk.SemismoothNewton(rho=rho)
    solution = bk.run(dataclasses.replace(scene, discretisation=DISCRETISATIONS[discretisation], solver=solver))
    assert solution.is_converged
    assert solution.linear_solves <= 10
    expected = solved(example, discretisation, "ssn").contact
    np.testing.assert_array_equal(solution.contact.status, expected.status)


def test_no_wall_means_no_hold() -> None:
    scene = bk.load_scene("paper-1")
    loads = tuple(part for part in scene.parts if part.name != "wall")
    frictionless = dataclasses.replace(scene, parts=loads, law=bk.Frictionless())
    with pytest.raises(ValueError, match=r"slides|push|turns"):
        bk.run(frictionless)
