"""Laws of elements in a few bytes: those that are stored in full."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.conditions import LinearConditions, augmented, separated, slip, stick
from bemkit.operators.hierarchy.element_laws import SolvedConditions, solve_for_two
from bemkit.operators.matrix_free.compact_laws import CompactLaws

N = 4
ONE = np.ones(N)
KINDS = (stick(0.1 * ONE, -0.2 * ONE), separated(N), slip(0.3 * ONE, ONE, -0.4 * ONE, 0.0 * ONE))


def of_conditions(conditions: LinearConditions, n: int) -> SolvedConditions:
    """Return what the conditions of the first nodes are solved for."""
    of = conditions.on_traction, conditions.on_displacement, conditions.value
    return solve_for_two(*(each[:n] for each in of), 1e-3)


def solved(conditions: LinearConditions) -> tuple[CompactLaws, FloatArray, FloatArray]:
    """Return laws, and in full their factors and what is given."""
    of_all = of_conditions(conditions, N)
    return CompactLaws.of(of_all), of_all.in_full().factors, of_all.in_full().given


def test_states_are_those_of_laws_in_full() -> None:
    found = [solved(each) for each in (*KINDS, augmented(ONE, ONE, np.ones((N, 2)), 5.0, 7.0))]
    laws = CompactLaws.joined([each[0] for each in found])
    factors, given = (np.concatenate([each[k] for each in found]) for k in (1, 2))
    elements, unknowns = np.array([1, 4, 9, 10, 13, 15]), np.random.default_rng(0).standard_normal((6, 2))
    change = np.einsum("nqz,nz->nq", factors[elements], unknowns)
    np.testing.assert_allclose(laws.state(elements, unknowns, is_change=True), change)
    state = laws.state(elements, unknowns)
    np.testing.assert_allclose(state, change + given[elements])
    np.testing.assert_array_equal(laws.unknowns(elements, state), unknowns)
    np.testing.assert_array_equal(laws.take(elements).factors, factors[elements])
    np.testing.assert_array_equal(laws.take(elements).given, given[elements])
    # unknowns act along the first and the second direction
    np.testing.assert_array_equal(laws.is_traction(np.array([0, 4, 8])), [[True, True], [False, False], [True, False]])


def test_only_quantities_that_follow_from_others_are_kept_with_coefficients() -> None:
    laws = CompactLaws.joined([solved(each)[0] for each in KINDS])
    np.testing.assert_array_equal(laws.coupled, np.arange(2 * N, 3 * N))


def test_some_laws_are_replaced() -> None:
    laws = CompactLaws.joined([solved(each)[0] for each in KINDS])
    slipping, elements = KINDS[2], np.array([0, 5, 8, 9])
    other = laws.replaced(elements, of_conditions(slipping, N))
    np.testing.assert_array_equal(other.coupled, [0, 5, 8, 9, 10, 11])
    assert not other.has_factors_of(laws)
    unknowns = np.ones((3 * N, 2))
    kept = np.setdiff1d(np.arange(3 * N), elements)
    np.testing.assert_array_equal(other.state(kept, unknowns[kept]), laws.state(kept, unknowns[kept]))
    np.testing.assert_allclose(other.state(elements, unknowns[elements]), laws.state(np.full(4, 8), unknowns[:4]))
    shifted = laws.replaced(np.array([3]), of_conditions(stick(ONE, ONE), 1))
    assert shifted.has_factors_of(laws)
