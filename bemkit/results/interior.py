"""Fields inside the body of a solved scene."""

from __future__ import annotations

from bemkit.operators.somigliana.potentials import PotentialFields
from bemkit.results.solution import Solution
from bemkit.results.solved_body import SolvedBody


def interior_fields(solution: Solution | SolvedBody) -> PotentialFields:
    """Return the displacement, strain and stress inside the body of a solution.

    Parameters
    ----------
    solution : Solution or SolvedBody
        As `run` returns it or `read_result` reads it. Look at its status first: fields of a run that did not converge
        are fields of the last state it reached.

    Returns
    -------
    InteriorFields, or HalfPlaneFields below the surface of a half-plane
        In physical units, on the whole body also where a symmetry halves it; evaluate it at points with
        ``displacement(points)`` and ``stress(points)``, and see `von_mises` and `principal_stresses`.

    Notes
    -----
    Where body forces act, their particular solution is added in closed form. In plane strain heat adds -E alpha T to
    the stress across the plane, which `von_mises` does not know.

    Displacements and tractions are those of the spaces of the discretisation. Inside, their error decays quickly with
    the distance from the boundary. Within about one element length of it, stresses are those of the piecewise data,
    with peaks at the ends of elements: see `InteriorFields`.
    """
    body = solution.body if isinstance(solution, Solution) else solution
    return body.boundary_stress.interior
