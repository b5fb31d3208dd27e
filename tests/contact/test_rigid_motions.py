"""Which combinations of motions a sparse matrix leaves free."""

import numpy as np
import pytest
from scipy import sparse

from bemkit.contact.conditions import null_space
from bemkit.contact.joined.member import diagonal_blocks
from tests.slow import slow_except


def chain(n, held):
    """Differences of neighbours of n unknowns, the first `held` of them fixed."""
    differences = sparse.diags_array([np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1], shape=(n - 1, n))
    return sparse.csr_array(sparse.vstack([differences, sparse.eye_array(held, n)]))


@pytest.mark.parametrize("n", [1, 3, 100, 1000])
def test_a_chain_is_free_until_one_end_is_held(n):
    free = null_space(chain(n, 0)).toarray()
    assert np.abs(free) == pytest.approx(np.full((1, n), n**-0.5), rel=1e-6)
    assert null_space(chain(n, 1)).shape == (0, n)


def test_groups_are_told_apart():
    """A long free chain, a short held one and an unknown that nothing touches."""
    matrix = diagonal_blocks([chain(500, 0), chain(4, 1), sparse.csr_array((0, 1))])
    free = null_space(matrix)
    assert free.shape == (2, 505)
    assert np.abs(matrix @ free.T).max() <= 1e-7
    assert (free @ free.T).toarray() == pytest.approx(np.eye(2), abs=1e-12)


@pytest.mark.parametrize("n_free", slow_except([5, 40], 40))
def test_many_motions_may_be_free_at_once(n_free):
    random = np.random.default_rng(0)
    n = 450
    matrix = sparse.csr_array(random.normal(size=(n - n_free, n)) / n**0.5)
    free = null_space(matrix)
    assert free.shape == (n_free, n)
    assert np.abs(matrix @ free.T).max() <= 1e-7
