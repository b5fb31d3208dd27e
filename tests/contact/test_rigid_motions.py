"""Which combinations of motions a sparse matrix leaves free."""

import numpy as np
import pytest
from scipy import sparse

from bemkit.contact.body import separated, slip, stick
from bemkit.contact.joined.member import diagonal_blocks
from bemkit.operators.null_space import null_space
from bemkit.operators.rigid_modes import orthonormal
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
    n = 410  # more than a decomposition takes
    matrix = sparse.csr_array(random.normal(size=(n - n_free, n)) / n**0.5)
    free = null_space(matrix)
    assert free.shape == (n_free, n)
    assert np.abs(matrix @ free.T).max() <= 1e-7


def test_conditions_hold_what_they_leave_no_motion_of():
    """Nodes of a straight side: stuck, sliding along it, and open; both motions at once, and the one that lifts it."""
    along, lifting = np.zeros((2, 5, 2))
    along[:, 1] = lifting[:, 0] = 1.0
    none = np.zeros(5)
    for conditions, n_free in ((stick(none, none), 0), (slip(none, none + 1.0, none, none), 1), (separated(5), 2)):
        motions = np.stack([3.0 * along, along + lifting])
        assert len(conditions.free_motions(motions)) == n_free
        assert conditions.hold(orthonormal(motions)) == (n_free == 0)
        assert conditions.hold(orthonormal(lifting[None])) == (n_free < 2)
        assert conditions.hold(orthonormal(np.zeros((0, 5, 2))))
