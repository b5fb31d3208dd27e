"""Fields inside the body of a solved scene."""

from __future__ import annotations

from bemkit.geometry.reflection import unfolded
from bemkit.geometry.spaces import ConstantSpace
from bemkit.operators.somigliana.fields import InteriorFields
from bemkit.results.solution import Solution


def interior_fields(solution: Solution) -> InteriorFields:
    """Return the displacement, strain and stress inside the body of a solution.

    Parameters
    ----------
    solution : Solution
        As `run` returns it or `read_result` reads it. Look at its status first: fields of a run that did not converge
        are fields of whatever it reached.

    Returns
    -------
    InteriorFields
        In physical units, on the whole body also where a symmetry halves it; evaluate it at points with
        ``displacement(points)`` and ``stress(points)``, and see `von_mises` and `principal_stresses`.

    Notes
    -----
    A solution holds one traction for each element, the mean over it, and displacements at nodes or element centres.
    Inside, their error decays quickly with the distance from the boundary. Within about one element length of it,
    stresses are those of the piecewise data, with peaks at the ends of elements: see `InteriorFields`.
    """
    mesh = solution.mesh
    make_space = solution.scene.discretisation.displacement_space
    space = make_space(mesh.whole)
    tractions = ConstantSpace(mesh.whole)
    displacement = unfolded(make_space(mesh), space, solution.boundary.displacement)
    traction = unfolded(ConstantSpace(mesh), tractions, solution.boundary.traction)
    return InteriorFields(mesh.whole, solution.scene.material, space, displacement, tractions, traction)
