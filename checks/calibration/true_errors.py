"""Relative errors of a solution against a much finer one: in the energy norm, and of contact tractions in L2."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial import KDTree

from bemkit.arrays import FloatArray
from bemkit.geometry.local_values import continued_to_ends, from_own_nodes
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import dof_points
from bemkit.results.solution import Solution
from checks.calibration.common_mesh import CommonMesh, Located, space_of, values_at

_N_POINTS = 8
_SAME = 1e-12
"""Distance of a contact node from its dof, relative to the body."""


def true_errors(coarse: Solution, fine: Solution) -> tuple[float, float]:
    """Return the errors that `estimated_error` and `estimated_traction_error` estimate.

    Elements that the estimate of tractions excludes, at singular corners and edges, are excluded here, too. Both
    solutions must have the contact nodes on the same sides: tractions of the other one differ by the ratio of lengths.
    """
    if coarse.contact_sides != fine.contact_sides:
        raise ValueError(
            f"contact nodes are on {coarse.contact_sides} and {fine.contact_sides}: solve with multipliers_on one side"
        )
    meshes = {name: CommonMesh(body, fine.bodies[name]) for name, body in coarse.bodies.items()}
    energy = sum(common.squared_error() for common in meshes.values())
    miss = sum(_squared_miss(coarse, fine, contact, meshes) for contact in coarse.contact.parts)
    size = coarse.contact_traction_size
    return float(np.sqrt(energy / fine.error_unit)), float(np.sqrt(miss)) / size if size > 0.0 else np.nan


def _squared_miss(coarse: Solution, fine: Solution, contact: str, meshes: Mapping[str, CommonMesh]) -> float:
    """Return the squared error of the tractions of a contact [Pa^2 m]; between two bodies it counts for both."""
    name, part = coarse.contact_sides[contact][0]
    common = meshes[name]
    elements = np.intersect1d(coarse.bodies[name].mesh.part(part), coarse.places.elements(name))
    pieces = np.flatnonzero(np.isin(common.parents, elements))
    xi, weights = gauss_legendre(_N_POINTS)
    on_coarse, on_fine = common.on_coarse(pieces, xi), common.on_fine(pieces, xi)
    misses = _tractions_at(coarse, contact, on_coarse) - _tractions_at(fine, contact, on_fine)
    lengths = common.mesh.jacobian(pieces, xi) * weights
    return coarse.n_sides(contact) * float(np.sum(lengths * np.sum(misses**2, axis=2)))


def _tractions_at(solution: Solution, contact: str, places: Located) -> FloatArray:
    """Evaluate sigma_n and sigma_t (m, q, 2) by the basis of the displacements of the body with the contact nodes."""
    table = solution.contact
    body, rows = solution.bodies[solution.contact_sides[contact][0].body], table.rows(contact)
    space = space_of(body)
    tree = KDTree(table.points[rows])
    distances, nearest = tree.query(dof_points(space))  # on the contact boundary the node itself, unless it is held
    at_dofs = np.column_stack([table.sigma_n, table.sigma_t])[rows][nearest][space.element_dofs]
    is_known, elements = distances <= _SAME * body.mesh.diameter, np.arange(body.mesh.n_elements)
    row, unknown, factors = continued_to_ends(space, elements, is_known[space.element_dofs])
    at_dofs[row, unknown] = np.einsum("nl,nlc->nc", factors, at_dofs[row])
    at_dofs[~body.boundary.traction.any(axis=1)] = 0.0  # beyond the end of a partner nothing goes on
    return values_at(space, from_own_nodes(space, at_dofs), places)
