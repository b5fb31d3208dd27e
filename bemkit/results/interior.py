"""Fields inside the body of a solved scene."""

from __future__ import annotations

from bemkit.errors import InputError
from bemkit.geometry.reflection import reflected_to_whole
from bemkit.geometry.spaces import ConstantSpace, ElementwiseSpace
from bemkit.operators.somigliana.fields import InteriorFields
from bemkit.results.solved_body import SolvedBody


def interior_fields(solution: SolvedBody) -> InteriorFields:
    """Return the displacement, strain and stress inside the body of a solution.

    Parameters
    ----------
    solution : Solution or BodyResult
        As `run` returns it or `read_result` reads it. Look at its status first: fields of a run that did not converge
        are fields of whatever it reached.

    Returns
    -------
    InteriorFields
        In physical units, on the whole body also where a symmetry halves it; evaluate it at points with
        ``displacement(points)`` and ``stress(points)``, and see `von_mises` and `principal_stresses`.

    Notes
    -----
    Where body forces act, their particular solution is added in closed form. In plane strain heat adds -E alpha T to
    the stress across the plane, which `von_mises` does not know.

    Displacements and tractions are those of the spaces of the discretisation (constant tractions in files of older
    versions). Inside, their error decays quickly with the distance from the boundary. Within about one element length
    of it, stresses are those of the piecewise data, with peaks at the ends of elements: see `InteriorFields`.

    Raises
    ------
    InputError
        If the body is a half-plane.
    """
    if solution.mesh.surface is not None:
        raise InputError("the body is a half-plane, of which only the surface is known: take a block for fields inside")
    mesh, discretisation, boundary = solution.mesh, solution.scene.discretisation, solution.map_boundary
    has_dofs = len(boundary.traction_dofs) > mesh.n_elements
    space, half_space = (discretisation.displacement_space(each) for each in (mesh.whole, mesh))
    displacement = reflected_to_whole(half_space, space, boundary.displacement)
    tractions, half_tractions = (
        ElementwiseSpace(discretisation.traction_space(each) if has_dofs else ConstantSpace(each))
        for each in (mesh.whole, mesh)
    )
    traction = reflected_to_whole(half_tractions, tractions, boundary.traction_dofs)
    material, background = solution.scene.material, solution.particular
    return InteriorFields(mesh.whole, material, space, displacement, tractions, traction, background)
