"""Checks that implementations, ours and yours, keep the promises of bemkit's protocols."""

from bemkit.testing.bodies import check_body as check_body
from bemkit.testing.discretisations import check_discretisation as check_discretisation
from bemkit.testing.failure import CheckFailed as CheckFailed
from bemkit.testing.laws import check_law as check_law
from bemkit.testing.linear import check_linear_solver as check_linear_solver
from bemkit.testing.obstacles import check_obstacle as check_obstacle
from bemkit.testing.operators import check_double_layer as check_double_layer
from bemkit.testing.operators import check_operator as check_operator
from bemkit.testing.shapes import check_shape as check_shape
from bemkit.testing.solutions import check_solution as check_solution
from bemkit.testing.solvers import check_solver as check_solver
from bemkit.testing.spaces import check_curve as check_curve
from bemkit.testing.spaces import check_space as check_space
