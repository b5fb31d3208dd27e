"""Fields inside the body of a solved scene."""

from __future__ import annotations

from bemkit.arrays import FloatArray
from bemkit.geometry.reflection import reflected_to_whole
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, ElementwiseSpace
from bemkit.operators.somigliana.fields import InteriorFields
from bemkit.operators.somigliana.potentials import PotentialFields
from bemkit.results.solved_body import SolvedBody
from bemkit.scene.discretisation import on_whole_body


def interior_fields(solution: SolvedBody) -> PotentialFields:
    """Return the displacement, strain and stress inside the body of a solution.

    Parameters
    ----------
    solution : Solution or BodyResult
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

    Displacements and tractions are those of the spaces of the discretisation (constant tractions in files of older
    versions). Inside, their error decays quickly with the distance from the boundary. Within about one element length
    of it, stresses are those of the piecewise data, with peaks at the ends of elements: see `InteriorFields`.
    """
    if solution.mesh.surface is not None:
        from bemkit.operators.half_plane.fields import HalfPlaneFields

        boundary, far = solution.boundary, solution.scene.far
        strain = 0.0 if far is None else far.strain
        return HalfPlaneFields(solution.mesh, solution.scene.material, boundary.traction, boundary.displacement, strain)
    material, background = solution.scene.material, solution.particular
    return InteriorFields(solution.mesh.whole, material, *whole_boundary(solution), background)


def whole_boundary(solution: SolvedBody) -> tuple[BoundarySpace, FloatArray, ElementwiseSpace, FloatArray]:
    """Return displacements and tractions on the whole boundary, less the particular solution of body forces.

    Each as its space and the dofs (n_scalar, 2) there [m], [Pa].
    """
    mesh, discretisation, boundary = solution.mesh, solution.scene.discretisation, solution.map_boundary
    of_whole = on_whole_body(discretisation, mesh)
    space, half_space = of_whole.displacement_space(mesh.whole), discretisation.displacement_space(mesh)
    displacement = reflected_to_whole(half_space, space, boundary.displacement)
    has_dofs = len(boundary.traction_dofs) > mesh.n_elements
    tractions, half_tractions = (
        ElementwiseSpace(d.traction_space(m) if has_dofs else ConstantSpace(m))
        for d, m in ((of_whole, mesh.whole), (discretisation, mesh))
    )
    return space, displacement, tractions, reflected_to_whole(half_tractions, tractions, boundary.traction_dofs)
