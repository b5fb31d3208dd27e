"""Several bodies as one: promises of a body, and what drivers find."""

import numpy as np
import pytest

from bemkit.contact.laws import Coulomb
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import solve
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.ssn import SemismoothNewton
from bemkit.testing import check_body
from tests.contact.joined.blocks import row_of_blocks

EVERY_OTHER = np.arange(20) % 2 == 0


@pytest.mark.parametrize("options", [{}, {"is_frictionless": EVERY_OTHER}, {"is_frictionless": True, "lift": 0.0}])
def test_floating_blocks_keep_the_promises_of_a_body(options):
    body = row_of_blocks((1.0, 3.0, 0.5), **options)
    reloaded = body.under([1.3 * member.load for member in body.members], body.offset + 0.1)
    check_body(body, is_symmetric=True, reloaded=reloaded)


def test_drivers_agree_on_a_row_of_blocks():
    body = row_of_blocks((1.0, 3.0, 0.5), lift=0.01)
    problem = ContactProblem(body, np.full(body.n_contact, -0.2), Coulomb(0.4))
    states = [solve(problem, solver).state for solver in (SemismoothNewton(), AugmentedLagrangian(), FixedPoint())]
    for state in states[1:]:
        assert np.abs(state.traction - states[0].traction).max() <= 1e-7  # certificates of 1e-9, tractions of 0.2
        assert np.abs(state.displacement - states[0].displacement).max() <= 1e-7
