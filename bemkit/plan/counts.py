"""The work that a plan foresees, in the counts that the solver reports."""

from __future__ import annotations

from bemkit.operators.counts import Entries, Factorisation, FactorKind, Work
from bemkit.plan.decisions import Decisions, Formulation
from bemkit.plan.sizes import Sizes


def planned_work(decisions: Decisions, sizes: Sizes) -> Work:
    """Return what a scene will take; a run whose load steps all converge counts exactly this.

    Parameters
    ----------
    decisions : Decisions
    sizes : Sizes

    Returns
    -------
    Work
    """
    is_collocation = decisions.formulation is Formulation.COLLOCATION
    of_body = _collocation(sizes) if is_collocation else _galerkin(decisions, sizes)
    n_columns = sizes.n_open + (sizes.n_sweeps if is_collocation else decisions.n_load_steps)
    return of_body + Work(right_hand_sides=n_columns, contact_unknowns=sizes.n_contact_unknowns)


def _galerkin(decisions: Decisions, sizes: Sizes) -> Work:
    n_tractions, n_displacements = sizes.n_tractions, sizes.n_displacements
    # of the single layer: the resultants and the pressures; of the body: the one that goes with its volume
    n_columns = sizes.n_motions + sizes.n_pressures + min(sizes.n_pressures, 1)
    factorisations = [Factorisation(FactorKind.CHOLESKY, n_tractions)]
    if decisions.forms_matrix:
        n_columns += n_displacements
        factorisations.append(Factorisation(FactorKind.CHOLESKY, sizes.n_free))
    return Work(
        element_pairs=sizes.n_elements * sizes.n_sources,
        single_layer=Entries.full(n_tractions, n_tractions),
        double_layer=Entries.full(n_tractions, n_displacements),
        hypersingular=Entries.full(n_displacements, n_displacements),
        factorisations=tuple(factorisations),
        right_hand_sides=n_columns,
    )


def _collocation(sizes: Sizes) -> Work:
    n = sizes.n_displacements
    return Work(
        element_pairs=sizes.n_collocation_pairs,
        single_layer=Entries.full(n, sizes.n_fixed + sizes.n_open) + Entries(n * sizes.n_loaded),
        double_layer=Entries.full(n, sizes.n_free + sizes.n_open) + Entries(n * sizes.n_moved),
        factorisations=(Factorisation(FactorKind.LU, n + sizes.n_motions + sizes.n_loops),),
    )
