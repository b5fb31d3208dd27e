"""Whether the equations of collocation can be solved without storing them, and what that takes, from sizes.

Times and memory are those of a square with 1e4 to 1e5 elements (`benchmarks/low_memory.py` measures what is
estimated here).
"""

from __future__ import annotations

from bemkit.operators.collocation import compiled
from bemkit.operators.linear.solvers import MatrixFree
from bemkit.operators.steklov_poincare.needs import BodyCase, BodyNeeds, PlanItem

_FEWEST_ELEMENTS = 200
_MOST_LOOPS = 20
"""Each closed curve of the boundary has an equation of its own, which is evaluated for each product."""
_BYTES, _BYTES_OF_GROUPS = 1.5e3, 5e6
"""Bytes of an element: mesh, directions of the iteration, series, conditions and fields; and once, mostly
for the equations of groups of elements."""
_EVALUATIONS, _EVALUATIONS_COMPILED = 4.5e3, 0.3e3
"""Evaluations of a product for each element."""
_STEPS = 17.0
"""Products of a response from cold, to the tolerance of 1e-10."""
_RESPONSES = 6.0
"""From cold that a load step takes; later ones begin near their solution."""


def why_stored(case: BodyCase) -> str:
    """Say why equations cannot do without being stored; empty if they can."""
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


def matrix_free_needs(case: BodyCase, options: MatrixFree, *, takes_slopes: bool) -> BodyNeeds:
    """Return what equations take that are not stored; how many steps an iteration takes is not predicted."""
    n = case.mesh.n_elements
    memory = int(_BYTES * n + _BYTES_OF_GROUPS)
    is_compiled, _ = compiled.expected(n)
    of_product = n * (_EVALUATIONS_COMPILED if is_compiled else _EVALUATIONS)
    slopes = "rotations then cause no tractions" if takes_slopes else "the method of the source paper"
    items = (
        PlanItem("boundary equations", True, f"products by the fast multipole method: {case.linear_solver.reason}"),
        PlanItem("slopes between constant elements", takes_slopes, slopes),
        PlanItem("hypersingular operator W", False, "collocation takes only the displacement equation"),
        PlanItem(
            "linear solver of the body", True, f"GMRES to {options.tolerance:g}, about {_STEPS:.0f} steps from cold"
        ),
        PlanItem("compiled kernels (numba)", *compiled.expected(n)),
        PlanItem("algebraic multigrid (pyamg)", True, "its hierarchy inverts the single layer between elements"),
    )
    evaluations = of_product * _STEPS * _RESPONSES * len(case.loads)
    return BodyNeeds(items=items, memory=memory, kept=memory, evaluations=evaluations, is_matrix_free=True)
