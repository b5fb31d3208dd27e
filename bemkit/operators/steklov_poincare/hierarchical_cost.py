"""Predicted costs of boundary equations compressed over a tree, and whether they are less than those of dense ones.

Times and memory are those of a square with 1e3 to 1e6 elements, measured by `benchmarks/large.py`; they hardly depend
on the shape.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bemkit.operators.linear_solvers import ChosenLinearSolver, Hierarchical
from bemkit.operators.steklov_poincare.cost import (
    CONTACT_STEPS,
    NO_HYPERSINGULAR,
    BodyCase,
    BodyCost,
    PlanItem,
    collocation_cost,
    seconds_of,
    slopes_item,
)

_SHARE = 0.5
"""Largest predicted time, relative to that of dense equations, of compressed ones that are chosen automatically."""
_FLOPS_OF_LARGE = 0.2
"""Time of a flop in the factorisation of a large matrix relative to one on small blocks."""


_EVALUATIONS, _COMPILED = 14e3, 3e3
"""Evaluations of integrals for an element at the tolerance 1e-10, in numpy, and their equivalent if compiled."""
_FLOPS, _FLOPS_OF_ELEMENT_IN_STEP = 0.4e6, 25e3
"""Flops of an element in the first factorisation, and in a contact step."""
_BYTES, _BYTES_OF_CONTACT, _BYTES_OF_TOP = 8.6e3, 3.5e3, 9e6
"""Memory of an element, additional memory of one in contact, and that of the largest clusters, whose ranks hardly
depend on the number of elements."""
_FLOPS_OF_STEP = 2e8
"""Flops of a contact step that do not grow with the mesh."""
_BYTES_OF_STATE, _FLOPS_OF_STATE = 40.0, 2e3
"""Costs of a stiffness for each pair of retained directions: tractions, displacements and the stiffness itself."""
_DIGITS = 10.0
"""Digits of the tolerance to which the costs belong."""
LARGEST_BLOCK = 1000
"""Typical order of the largest dense block of a tree."""


def compressed_if_cheaper(case: BodyCase, memory: float) -> ChosenLinearSolver:
    """Return the compressed equations of collocation if they gain time or fit into memory, else the dense ones.

    They are chosen if they are predicted to be at least twice as fast, or the only ones that fit into memory [bytes].
    """
    options, dense = Hierarchical(), collocation_cost(case, takes_slopes=True)
    compressed = _cost(case, options)
    of_dense = _FLOPS_OF_LARGE * (dense.flops + CONTACT_STEPS * 2.0 / 3.0 * case.n_retained**3)
    share = compressed.seconds / seconds_of(dense.evaluations, of_dense)
    if share < _SHARE:
        return ChosenLinearSolver(f"about {share:.2g} of the time of dense equations", options)
    if compressed.memory < memory < dense.memory:
        reason = f"dense ones need about {dense.memory / 1e9:.3g} GB, there are {memory / 1e9:.3g} GB"
        return ChosenLinearSolver(reason, options)
    return ChosenLinearSolver(f"compressed over a tree they would take {share:.2g} times as long")


def hierarchical_cost(case: BodyCase, options: Hierarchical, *, takes_slopes: bool) -> BodyCost:
    """Return the costs of the compressed equations; counts depend on ranks and are not predicted."""
    reason = f"compressed over a tree to {options.tolerance:g}: {case.linear_solver.reason}"
    items = (
        PlanItem("boundary equations", True, f"single and double layer, {reason}"),
        slopes_item(takes_slopes),
        NO_HYPERSINGULAR,
        *_tree_items(case, options),
    )
    return replace(_cost(case, options), items=items)


def _tree_items(case: BodyCase, options: Hierarchical) -> tuple[PlanItem, PlanItem, PlanItem]:
    """Return the items of the linear solver and of the kernels, with the time of the other kernels."""
    from bemkit.operators.collocation import compiled

    is_compiled, why = compiled.expected(case.mesh.n_elements)
    chosen, other = (_cost(case, options, is_compiled=choice).seconds for choice in (is_compiled, not is_compiled))
    others = f"{'numpy' if is_compiled else 'compiled ones'} would take about {other:.3g} s instead of {chosen:.3g} s"
    return (
        PlanItem("linear solver of the body", True, "LU of the clusters of the tree; no matrix of the whole body"),
        PlanItem("compiled kernels (numba)", is_compiled, f"{why}; {others}"),
        PlanItem("algebraic multigrid (pyamg)", False, "the linear solver is direct"),
    )


def _cost(case: BodyCase, options: Hierarchical, *, is_compiled: bool | None = None) -> BodyCost:
    n, digits = case.mesh.n_elements, -math.log10(options.tolerance) / _DIGITS
    n_both = int(np.count_nonzero(case.conditions.is_retained.any(axis=1)))
    if is_compiled is None:
        from bemkit.operators.collocation import compiled

        is_compiled, _ = compiled.expected(n)
    memory = int(digits * (_BYTES_OF_TOP + _BYTES * n + _BYTES_OF_CONTACT * n_both))
    evaluations = digits * n * (_COMPILED if is_compiled else _EVALUATIONS)
    flops = _FLOPS * n
    if n_both:
        flops += CONTACT_STEPS * len(case.loads) * (_FLOPS_OF_STEP + _FLOPS_OF_ELEMENT_IN_STEP * n)
    flops *= digits
    if case.is_condensed:
        memory += int(_BYTES_OF_STATE * case.n_retained**2)
        flops += _FLOPS_OF_STATE * case.n_retained**2
    is_matrix_free = not case.is_condensed
    return BodyCost(memory=memory, kept=memory, evaluations=evaluations, flops=flops, is_matrix_free=is_matrix_free)
