"""Estimated errors of elements inside which the contact status changes, against best approximations by polynomials."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import legendre

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.geometry import discretise
from bemkit.results.contact_table import ContactTable
from bemkit.results.transitions import Transition
from bemkit.results.zone_ends import ZoneEnd, reversal_error, transition_error
from bemkit.solvers.active_sets import NodeStatus
from checks.calibration.true_errors import true_errors

MESH = discretise(bk.Rectangle(1.0, 1.0).outline(), n_elements=4)


def best_error(fraction: float, degree: int) -> float:
    """Return the L2 error of the best polynomial for sqrt(x - fraction) on the element from 0 to 1, zero before."""
    xi, weights = legendre.leggauss(60)
    root = 0.5 * (xi + 1.0) * np.sqrt(1.0 - fraction)
    x, weights = fraction + root**2, weights * root * np.sqrt(1.0 - fraction)
    polynomials = legendre.legvander(2.0 * x - 1.0, degree) * np.sqrt(2.0 * np.arange(degree + 1) + 1.0)
    missed = 0.5 * (1.0 - fraction) ** 2 - np.sum(((weights * root) @ polynomials) ** 2)
    return float(np.sqrt(missed))


def estimated(
    fraction: float, degree: int, tractions: FloatArray, s: FloatArray, others: tuple[float, ...] = ()
) -> float:
    """Return the estimate on an element of length 1 for tractions at the places s, the transition at `fraction`."""
    n = s.size
    table = ContactTable(
        part=("floor",) * n,
        x=s,
        s=s,
        **{name: np.zeros(n) for name in ("y", "u_n", "u_t", "sigma_t", "gap", "clearance")},
        sigma_n=tractions,
        status=np.full(n, NodeStatus.STICK),
        weight=np.full(n, 1.0 / n),
    )
    transitions = [Transition("floor", place, 0.0, place, "separated", "stick") for place in (fraction, *others)]
    end = ZoneEnd(MESH, 4.0, 0, fraction)
    squared, length = transition_error(table, [table.sigma_n], transitions[0], transitions, end, degree)
    assert length == pytest.approx(2.0 * np.sqrt(fraction * (1.0 - fraction)) / degree)
    return float(np.sqrt(squared))


@given(fraction=st.floats(0.03, 0.97), degree=st.integers(2, 10))
def test_the_estimate_is_about_twice_the_best_approximation(fraction: float, degree: int) -> None:
    s = np.linspace(-1.0, 2.0, 3001)
    tractions = -np.sqrt(np.maximum(s - fraction, 0.0))
    # best approximations are 0.1 to 0.2 times K l wherever the transition lies, and closer to it from degree 3 on
    assert 1.4 < estimated(fraction, degree, tractions, s) / best_error(fraction, degree) < 3.5


@given(fraction=st.floats(0.1, 0.9), degree=st.integers(4, 14))
def test_friction_that_changes_its_sign_is_missed_by_somewhat_more_than_the_best_approximation(
    fraction: float, degree: int
) -> None:
    """Of a unit jump at the fraction of an element of length 1, by the primitives of Legendre polynomials."""
    x, n = 2.0 * fraction - 1.0, np.arange(1, degree + 1)
    at = legendre.legvander(np.array([x]), degree + 1)[0]
    coefficients = (at[n - 1] - at[n + 1]) / (2 * n + 1)  # of the jump from the place to the end
    best = fraction * (1.0 - fraction) - 0.25 * float(np.sum((2 * n + 1) * coefficients**2))
    squared, length = reversal_error(1.0, ZoneEnd(MESH, 4.0, 0, fraction), degree)
    assert length == pytest.approx(2.0 * np.sqrt(fraction * (1.0 - fraction)) / degree)
    assert 1.5 < np.sqrt(squared / best) < 2.0


def test_a_zone_of_one_element_is_not_measured_beyond_its_middle() -> None:
    """Of a Hertz pressure on half of an element, from one end to the middle and not to the other end."""
    s = np.linspace(-1.0, 2.0, 3001)
    pressure = -np.sqrt(np.maximum(0.25**2 - (s - 0.5) ** 2, 0.0))
    middle = 0.25  # K l with K**2 = 0.25 from the end to the middle
    expected = 0.3 * np.sqrt(middle) * 2.0 * np.sqrt(0.25 * 0.75) / 6
    assert estimated(0.25, 6, pressure, s, (0.75,)) == pytest.approx(expected, rel=1e-3)  # between the places s


def test_a_transition_beyond_a_node_with_pressure_counts_with_all_of_it() -> None:
    """The place follows from clearances, and may lie behind the last node in contact: there pressure vanishes, too."""
    s = np.linspace(-1.0, 2.0, 31)
    pressure = np.where(s > 1.0, -1.0, np.where(s > 0.3, -0.5, 0.0))
    expected = 0.3 * 1.0 * 2.0 * np.sqrt(0.5 * 0.5) / 4  # K l with K the pressure an element's length away
    assert estimated(0.5, 4, pressure, s) == pytest.approx(expected, rel=1e-12)


@pytest.mark.slow
def test_where_sticking_ends_pressure_is_smooth() -> None:
    """A cylinder pressed on a floor: only friction below its bound has an error there, but pressure varies more."""
    parts = (
        bk.Part("contact", bk.Contact(bk.RigidHalfPlane()), sides=("arc",), where=bk.Expression("y < 0.8")),
        bk.Part("top", bk.PrescribedDisplacement(0.0, -0.013), sides=("start", "end")),
    )
    scene = bk.Scene(
        title="cylinder", shape=bk.Sector(1.0, 180.0, 360.0, (0.0, 1.0)), material=bk.Material(8.0, 0.45),
        parts=parts, law=bk.Coulomb(0.09), discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(accuracy=0.045, rising_degrees=True),
    )  # fmt: skip
    coarse = bk.run(scene)
    assert [each.from_status for each in coarse.transitions] == ["separated", "slip", "stick", "slip"]
    fine = bk.run(replace(scene, mesh=bk.MeshOptions(accuracy=1e-2, rising_degrees=True)))
    _, tractions = true_errors(coarse, fine)
    assert coarse.estimated_traction_error is not None
    assert 0.5 < coarse.estimated_traction_error / tractions < 3.0
