"""Predicted costs of matrix-free collocation equations, and reasons why equations must be stored.

Times and memory are those of a square with 1e4 to 1e5 elements, measured by `benchmarks/low_memory.py`.
"""

from __future__ import annotations

from bemkit.operators.collocation import compiled
from bemkit.operators.linear_solvers import MatrixFree
from bemkit.operators.steklov_poincare.cost import NO_HYPERSINGULAR, BodyCase, BodyCost, PlanItem, slopes_item

_FEWEST_ELEMENTS = 200
_MOST_LOOPS = 20
"""Largest number of closed curves: each adds an equation that is evaluated for each product."""
_BYTES, _BYTES_OF_GROUPS = 1.5e3, 5e6
"""Bytes of each element (mesh, search directions, series, conditions, fields), and of the coarse equations."""
_BYTES_IN_NUMPY, _BYTES_OF_BLOCKS = 0.9e3, 2e6
"""Further bytes without compiled kernels, for integrals of blocks of near elements."""
_EVALUATIONS, _EVALUATIONS_COMPILED = 4.5e3, 0.3e3
"""Evaluations of integrals for each element and product."""
_STEPS = 17.0
"""Products of a response that starts from zero, to the tolerance 1e-10."""
_RESPONSES = 6.0
"""Responses of a load step, counted as if they started from zero; later ones start near their solution."""


def why_stored(case: BodyCase) -> str:
    """Return why the equations of a body must be stored; empty if they need not."""
    mesh = case.mesh
    if mesh.n_elements < _FEWEST_ELEMENTS:
        return f"{mesh.n_elements} elements are few"
    if case.n_curved:
        return f"{case.n_curved} elements are curved"
    if mesh.symmetry is not None:
        return "the body is divided along a line of symmetry"
    if len(mesh.loops) > _MOST_LOOPS:
        return f"the boundary has {len(mesh.loops)} closed curves"
    if case.is_condensed:
        return "contact sees the stiffness of the body"
    return ""


def matrix_free_cost(case: BodyCase, options: MatrixFree, *, takes_slopes: bool) -> BodyCost:
    """Return the costs of equations that are not stored, for a typical number of iterations."""
    n = case.mesh.n_elements
    is_compiled, _ = compiled.expected(n)
    memory = int(_BYTES * n + _BYTES_OF_GROUPS)
    if not is_compiled:
        memory += int(_BYTES_IN_NUMPY * n + _BYTES_OF_BLOCKS)
    of_product = n * (_EVALUATIONS_COMPILED if is_compiled else _EVALUATIONS)
    items = (
        PlanItem("boundary equations", True, f"products by the fast multipole method: {case.linear_solver.reason}"),
        slopes_item(takes_slopes),
        NO_HYPERSINGULAR,
        PlanItem(
            "linear solver of the body", True, f"GMRES to {options.tolerance:g}, about {_STEPS:.0f} steps from cold"
        ),
        PlanItem("compiled kernels (numba)", *compiled.expected(n)),
        PlanItem("algebraic multigrid (pyamg)", True, "its hierarchy inverts the single layer between elements"),
    )
    evaluations = of_product * _STEPS * _RESPONSES * len(case.loads)
    return BodyCost(items=items, memory=memory, kept=memory, evaluations=evaluations, is_matrix_free=True)
