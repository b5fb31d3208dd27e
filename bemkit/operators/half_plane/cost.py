"""Predicted costs of the elastic maps of half-planes."""

from __future__ import annotations

from bemkit.operators.counts import Entries, Factorisation, FactorKind, OperationCounts
from bemkit.operators.steklov_poincare.cost import CONTACT_STEPS, BodyCase, BodyCost, PlanItem

_BYTES = 8
_BYTES_OF_TREE = 10_000
"""Bytes of each element of equations over a tree."""
_FLOPS_OF_TREE = 6e5
"""Flops of each element of equations over a tree, in all responses."""
_BASIS = 120
"""Vectors that the iteration for a response keeps, with all auxiliary vectors."""
_RESPONSES, _ITERATIONS, _FLOPS_OF_TRANSFORM = 20, 40, 500.0
"""Typical numbers for a rough surface: responses, iterations of each, and flops of each node in an iteration."""


def strip_cost(case: BodyCase, *, has_tree: bool) -> BodyCost:
    """Return the costs of a half-plane with its flexibility stored as a matrix or, without supports, over a tree."""
    n, n_acting = case.mesh.n_elements, case.n_retained + case.n_fixed
    items = (
        PlanItem("flexibility of the surface", True, f"closed form: {n} x {n} means of logarithms"),
        PlanItem("elements inside, around or below", False, "the surface beyond the strip is free in closed form"),
        PlanItem("double layer, hypersingular operator", False, "they vanish on a straight free surface"),
        PlanItem("supports", case.n_fixed > 0, "the half-plane is held or driven far away"),
    )
    square, matrix = _BYTES * n_acting * n_acting, _BYTES * n * n
    if case.is_condensed:  # both components of the whole surface, and the inverse
        return BodyCost(
            items=items,
            work=flexibility_work(n) + inverse_work(n_acting),
            memory=32 * matrix,
            kept=8 * matrix + 2 * square,
            evaluations=4.0 * n**2,
            flops=4.0 / 3.0 * float(n_acting) ** 3,
        )
    if has_tree and not case.n_fixed:
        leaves = PlanItem("tree of clusters", True, f"{n} elements are many: one factor over them")
        kept = _BYTES_OF_TREE * n
        return BodyCost(
            items=(*items, leaves),
            memory=kept,
            kept=kept,
            flops=_FLOPS_OF_TREE * n,
            is_matrix_free=True,
        )
    kept = matrix + 3 * square  # at most all nodes are closed: their equations and the factor
    flops = CONTACT_STEPS * 2.0 / 3.0 * float(n_acting) ** 3
    memory = max(4 * matrix, kept)
    return BodyCost(
        items=items,
        work=flexibility_work(n),
        memory=memory,
        kept=kept,
        evaluations=float(n) ** 2,
        flops=flops,
        is_matrix_free=True,
    )


def periodic_cost(case: BodyCase) -> BodyCost:
    """Return the costs of a periodic half-plane."""
    n = case.mesh.n_elements
    items = (
        PlanItem("flexibility of the surface", True, f"one number for each of {n} waves, by Fourier transforms"),
        PlanItem("elements inside, around or below", False, "waves die out below the surface in closed form"),
        PlanItem(
            "matrices", False, f"each response is found by GMRES, with {_BASIS} vectors of {case.n_retained} numbers"
        ),
        PlanItem("supports", False, "the half-plane is held or driven far away"),
    )
    kept = _BYTES * _BASIS * case.n_retained
    flops = _RESPONSES * _ITERATIONS * n * (_FLOPS_OF_TRANSFORM + 4.0 * _ITERATIONS)
    return BodyCost(items=items, memory=kept, kept=kept, flops=flops, is_matrix_free=True)


def flexibility_work(n_elements: int) -> OperationCounts:
    """Return the operation counts of a flexibility."""
    return OperationCounts(element_pairs=n_elements**2, single_layer=Entries.full(n_elements, n_elements))


def inverse_work(n_acting: int) -> OperationCounts:
    """Return the operation counts of the inverse of a flexibility on retained and fixed directions."""
    factorisations = (Factorisation(FactorKind.CHOLESKY, n_acting),) if n_acting else ()
    return OperationCounts(factorisations=factorisations, right_hand_sides=n_acting)
