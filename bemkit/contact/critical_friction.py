"""The friction coefficient at which a sliding state loses uniqueness."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.body import LinearBody, SingularResponse, of_statuses, separated, stick
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.rigid_modes import as_dense

LARGEST_COEFFICIENT = 1e3
"""Largest coefficient; larger ones are round-off of a vanishing coupling, as between bodies of equal material."""
_NEARLY_REAL = 1e-9
"""Largest relative imaginary part of a real eigenvalue; round-off may turn two close real ones into a pair."""


def sliding_response(body: LinearBody, is_closed: BoolArray, slides: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return the changes of tractions under tangential displacements of nodes in contact.

    Parameters
    ----------
    body : LinearBody
    is_closed : (n_contact,) bool array
        Nodes in contact; the others carry no traction.
    slides : (n_contact,) bool array
        Nodes in contact that slide; the others have no friction.

    Returns
    -------
    normal, tangential : (n_sliding, n_sliding) arrays [Pa/m]
        Changes of sigma_n and sigma_t (rows) under unit displacements u_t (columns), with u_n fixed at nodes in
        contact.

    Raises
    ------
    SingularResponse
        If a body is free to slide without friction; the message names it.
    """
    n_contact = len(is_closed)
    zero = np.zeros(n_contact)
    rows = np.flatnonzero(slides)
    smooth = of_statuses(is_closed, np.ones(n_contact, bool), stick(zero, zero), separated(n_contact))
    motions = body.rigid_motions()
    if (free := smooth.free_motions(motions)).shape[0]:
        basis, slides_freely = (as_dense(each, n_contact).reshape(-1, 2 * n_contact) for each in (motions, free))
        amounts = np.abs(np.linalg.lstsq(basis.T, slides_freely.T, rcond=None)[0]).sum(axis=1)
        raise SingularResponse(f"only friction keeps {body.moving_bodies(amounts)} from sliding")

    def response(moved: FloatArray) -> FloatArray:
        held: LinearConditions = of_statuses(is_closed, ~slides, stick(zero, moved), separated(n_contact))
        return body.respond(held).traction[rows]

    at_rest = response(zero)
    columns = np.stack([response(unit) - at_rest for unit in np.eye(n_contact)[rows]], axis=2)
    return columns[:, 0], columns[:, 1]


def critical_coefficient(normal: FloatArray, tangential: FloatArray, direction: FloatArray) -> float:
    """Return the smallest friction coefficient at which sliding in given directions loses uniqueness.

    Parameters
    ----------
    normal, tangential : (n_sliding, n_sliding) arrays [Pa/m]
        From `sliding_response`, or a part of these if other nodes stick.
    direction : (n_sliding,) array
        +1 for sliding along the tangent, -1 against it.

    Returns
    -------
    float
        Infinite if there is no coefficient up to `LARGEST_COEFFICIENT`.

    Notes
    -----
    Rates of sliding nodes fulfil ``du_n = 0`` and ``d sigma_t = s direction d sigma_n``, because sigma_t opposes the
    motion and sigma_n is negative. If ``tangential v = s diag(direction) normal v`` has a solution v other than zero,
    the rate problem has no solution for most loads and a line of solutions for the others. So s must be a real
    eigenvalue; complex eigenvalues belong to no quasistatic motion.

    References
    ----------
    [Klarbring1990], [Hild2004].
    """
    from scipy.linalg import eigvals

    if not len(direction):
        return np.inf
    # eigenvalues 1 / s: `tangential` is positive definite, `normal` may be singular
    inverse = eigvals(direction[:, None] * normal, tangential)
    is_real = np.abs(inverse.imag) <= _NEARLY_REAL * np.abs(inverse)
    largest = float(inverse.real[is_real].max(initial=0.0))
    return 1.0 / largest if largest * LARGEST_COEFFICIENT > 1.0 else np.inf
