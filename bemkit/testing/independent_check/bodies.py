"""The bodies of a solution, each checked separately: boundary, loads, reactions, scales, balances."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.results.solved_body import SolvedBody
from bemkit.testing.independent_check.balance import (
    _free_motions,
    admissible_modes_of,
    load_mismatch,
    motions_at,
    negative_energy,
    reciprocity_mismatch,
    strained_displacement,
    support_mismatch,
)
from bemkit.testing.independent_check.boundary import Boundary, Scales, boundary_of, scales_of
from bemkit.testing.independent_check.half_plane import Surface
from bemkit.testing.independent_check.inside import inner_work
from bemkit.testing.independent_check.nodes import Fields, contact_nodes_of, supported_nodes
from bemkit.testing.independent_check.views import BodyView, freed, obstacles_of


@dataclass(frozen=True, eq=False)
class BodyMeasurements:
    """A body with the quantities that are measured again.

    Parameters
    ----------
    result : SolvedBody
    fields : Fields
        Tractions are given loads, and those of the elements for contacts and reactions.
    is_touched : (n_elements,) bool array
        Elements that belong to contacts, be they with bodies or with rigid obstacles.
    """

    result: SolvedBody
    fields: Fields
    is_touched: BoolArray

    @classmethod
    def of(cls, result: SolvedBody, touched: tuple[str, ...], before: SolvedBody | None = None) -> BodyMeasurements:
        """Measure a body with the names of its sides in contact, and what it was after the load step before."""
        view, earlier = freed(result), None if before is None else freed(before)
        mesh, boundary = result.mesh, boundary_of(view)
        is_touched = np.zeros(mesh.n_elements, bool)
        for name in (*touched, *obstacles_of(result.scene)):
            is_touched[mesh.part(name)] = True
        traction = boundary.traction.copy()
        is_known = is_touched.copy()
        for elements, _, _ in boundary.held:
            is_known[elements] = True
        traction[is_known] = _interpolated(result)[is_known]
        boundary = replace(boundary, traction=traction)
        nodes = contact_nodes_of(view, boundary)
        return cls(result, Fields(view, earlier, boundary, nodes, scales_of(view, earlier)), is_touched)

    @property
    def largest_stress(self) -> float:
        """The larger of its unit and the stress of its strains [Pa]: heat strains a free body without tractions."""
        view = self.fields.solution
        strain = float(np.abs(strained_displacement(view)).max()) / self.result.mesh.diameter
        return max(self.scales.stress, strain * view.scene.material.plane_modulus)

    def measured_by(self, least: float) -> BodyMeasurements:
        """Return the body with units of a stress [Pa] at least, and of the displacement that it causes."""
        scales = self.scales
        length = least * self.result.mesh.diameter / self.result.scene.material.plane_modulus
        larger = scales._replace(stress=max(scales.stress, least), length=max(scales.length, length))
        return replace(self, fields=self.fields._replace(scales=larger))

    @property
    def boundary(self) -> Boundary:
        """Its elements."""
        return self.fields.boundary

    @property
    def scales(self) -> Scales:
        """Its units of stress and length."""
        return self.fields.scales

    @property
    def coarseness(self) -> float:
        """Length of the longest element over the diameter."""
        return float(self.boundary.lengths.max()) / self.result.mesh.diameter

    def supports(self) -> float:
        """Return the larger violation of supports and loads [-]."""
        return max(support_mismatch(self.fields), load_mismatch(self.fields))

    def negative_energy(self) -> float:
        """Return by how much the elastic energy is negative [-]."""
        return negative_energy(self.fields)

    def reciprocity(self) -> float:
        """Return how far tractions and displacements are from belonging to one elastic body [-]."""
        return 0.0 if self.result.mesh.surface is not None else reciprocity_mismatch(self.fields)

    def elasticity(self) -> float:
        """Return how far displacements of a half-plane are from Flamant's solution for its tractions [-]."""
        return 0.0 if self.result.mesh.surface is None else Surface.of(self.fields).elasticity_mismatch()

    def supported_nodes(self) -> IntArray:
        """Return the nodes that supports and symmetry lines hold in some direction."""
        return supported_nodes(self.fields.solution, self.boundary)

    def force_on(self, elements: IntArray) -> tuple[FloatArray, float]:
        """Return resultant (2,) and size [N/m] of the tractions on some elements."""
        forces = self.boundary.traction[elements] * self.boundary.shares[elements][..., None]
        return np.asarray(forces.sum(axis=(0, 1))), float(np.abs(forces).sum())

    def imbalance(self, contact: FloatArray, size: float) -> float:
        """Return the resultant of loads, contacts and forces inside along free translations over that of their sizes.

        Parameters
        ----------
        contact : (2,) array [N/m]
            Of all contacts.
        size : float [N/m]
            Sum of the sizes of their forces.
        """
        view, boundary = self.fields.solution, self.boundary
        is_load = ~self.is_touched
        for elements, _, _ in boundary.held:
            is_load[elements] = False
        loads, load_size = self.force_on(np.flatnonzero(is_load))
        inside = inner_work(view, boundary)[:2]
        total = contact + loads + inside
        forces = boundary.traction * boundary.shares[..., None]
        size += load_size + float(np.abs(inside).sum()) + float(np.abs(forces).sum())
        size += self.scales.stress * float(boundary.lengths.min())
        return float(np.abs(_free_translations(view, boundary) @ total).max(initial=0.0)) / size

    def moment(self) -> float:
        """Return the moment about the centre of all tractions and forces inside over that of their sizes.

        Up to the discretisation error; an exterior passes it on to infinity.
        """
        view, boundary = self.fields.solution, self.boundary
        if 2 not in admissible_modes_of(view):
            return 0.0
        forces = boundary.traction * boundary.shares[..., None]
        work = np.einsum("eqc,eqcm->eqm", forces, motions_at(view, boundary.points))
        inside = inner_work(view, boundary)
        size = float(np.abs(forces).sum()) + float(np.abs(inside).sum())
        size += 1e-6 * self.scales.stress * float(boundary.shares.sum())
        return abs(float(work[..., 2].sum() + inside[2])) / size if size > 0.0 else 0.0


def _interpolated(result: SolvedBody) -> FloatArray:
    """Return the tractions (n_elements, n_places, 2) [Pa] that the traction space makes at the quadrature points."""
    space = result.scene.discretisation.traction_space(result.mesh)
    places = np.polynomial.legendre.leggauss(8)[0]
    values = result.boundary.traction_dofs.reshape(result.mesh.n_elements, -1, 2)
    return np.asarray(np.einsum("lq,elc->eqc", space.basis(places), values))


def _free_translations(view: BodyView, boundary: Boundary) -> FloatArray:
    """Return (k, 2) unit vectors along which no support holds the body."""
    free = _free_motions(view, boundary)
    if not len(free):
        return np.zeros((0, 2))
    _, sizes, combinations = np.linalg.svd(free[:, 2:].T, full_matrices=True)
    rank = int(np.count_nonzero(sizes > 1e-9))
    return np.asarray((combinations[rank:] @ free)[:, :2])
