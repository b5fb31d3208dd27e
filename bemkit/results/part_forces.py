"""Resultants of a part or a contact: forces, moment, contact length, peak pressure, largest slip."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import SupportsIndex, overload

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import UnknownPartError
from bemkit.formulas import choices
from bemkit.geometry.local_values import summed_at_dofs
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.operators.steklov_poincare.nodal_conditions import integrate_traction
from bemkit.results.contact_table import ContactTable
from bemkit.results.transitions import Transition, unrolled
from bemkit.scene.conditions import Load


@dataclass(frozen=True)
class PartForce:
    """Resultant of the contacts, reactions or loads on a part of the boundary.

    Parameters
    ----------
    name : str
    force_x, force_y : float [N/m]
        On the body.
    moment : float [N m/m]
        About the origin, anticlockwise.
    """

    name: str
    force_x: float
    force_y: float
    moment: float

    def __add__(self, other: PartForce) -> PartForce:
        """Return the resultant of both, under the name of the first."""
        sums = (getattr(self, key) + getattr(other, key) for key in ("force_x", "force_y", "moment"))
        return PartForce(self.name, *sums)

    def as_dict(self) -> dict[str, float | str]:
        """Return the entries by name."""
        return asdict(self)


@dataclass(frozen=True)
class RigidResult(PartForce):
    """A rigid body of a solution.

    Parameters
    ----------
    name : str
    force_x, force_y : float [N/m]
        What acts on it besides its contacts: its given load, or the reaction to its given motion. Contacts
        exert the opposite.
    moment : float [N m/m]
        The same about its centre, anticlockwise.
    x, y : float [m]
        How its centre moved.
    turn : float [rad]
        Anticlockwise.
    """

    x: float
    y: float
    turn: float


@dataclass(frozen=True)
class ContactForce(PartForce):
    """Forces and sizes of a contact; forces and moment act on the body of the first elastic side in its name.

    Parameters
    ----------
    force_normal : float [N/m]
        Total pressing force, positive: minus the integral of sigma_n.
    force_tangential : float [N/m]
        Integral of sigma_t.
    contact_length : float [m]
        Length of boundary in contact, between the places where the status changes.
    peak_pressure : float [Pa]
    largest_slip : float [m]
        Largest tangential displacement of nodes in contact, relative to the partner and since the first load step.
    """

    force_normal: float
    force_tangential: float
    contact_length: float
    peak_pressure: float
    largest_slip: float


class ContactForces(tuple[ContactForce, ...]):
    """Forces and sizes of each contact, by index or by name."""

    __slots__ = ()

    @overload
    def __getitem__(self, key: SupportsIndex | str) -> ContactForce: ...

    @overload
    def __getitem__(self, key: slice) -> tuple[ContactForce, ...]: ...

    def __getitem__(self, key: SupportsIndex | str | slice) -> ContactForce | tuple[ContactForce, ...]:
        """Return a contact by its index or name, or some by a slice; UnknownPartError if there is no such name."""
        if not isinstance(key, str):
            return super().__getitem__(key)
        for contact in self:
            if contact.name == key:
                return contact
        names = [contact.name for contact in self]
        raise UnknownPartError(f"there is no contact {key!r}: there are {choices(key, names)}")


def part_force(name: str, mesh: BoundaryMesh, space: BoundarySpace, load: FloatArray, elements: IntArray) -> PartForce:
    """Integrate loads per length over some elements.

    Parameters
    ----------
    name : str
    mesh : BoundaryMesh
        In physical units.
    space : BoundarySpace
        Of the tractions.
    load : (n_elements, n_local, 2) array [N/m]
        Tractions times the thickness.
    elements : (m,) int array
    """
    xi, weights = gauss_legendre(space.degree + 4)
    values = np.einsum("lq,elc->eqc", space.basis(xi), load[elements])
    measured = values * (mesh.jacobian(elements, xi) * weights)[:, :, None]
    x, y = np.moveaxis(mesh.points(elements, xi), 2, 0)
    force = measured.sum(axis=(0, 1))
    moment = float(np.sum(x * measured[:, :, 1] - y * measured[:, :, 0]))
    return PartForce(name, float(force[0]), float(force[1]), moment)


def load_force(name: str, moved: BoundarySpace, elements: IntArray, load: Load, depth: float) -> PartForce:
    """Sum up the nodal forces of a load on some elements, on the space of displacements and a thickness [m]."""
    forces = integrate_traction(moved, elements, load.at)
    return nodal_resultant(name, depth * forces, dof_points(moved))


def support_forces(
    supports: Sequence[str],
    moved: BoundarySpace,
    loaded: BoundarySpace,
    load: FloatArray,
    points: FloatArray,
    reaction: FloatArray,
) -> dict[str, PartForce]:
    """Sum up the reactions of supports at the nodes of each part.

    Supports that share a node share its reaction in proportion to their tractions, and the remainder equally.

    Parameters
    ----------
    supports : sequence of str
        Parts of the mesh.
    moved, loaded : BoundarySpace
        Of displacements and tractions.
    load : (n_elements, n_local, 2) array [N/m]
        Tractions times the thickness.
    points : (n_points, 2) array [m]
        Of the displacements.
    reaction : (n_points, 2) array [N/m]
        There, of all supports.
    """
    mesh, shares, counts = moved.mesh, {}, np.zeros(len(reaction), int)
    xi, weights = gauss_legendre(moved.degree + loaded.degree + 4)
    for name in supports:
        elements = mesh.part(name)
        values = np.einsum("lq,elc->eqc", loaded.basis(xi), load[elements])
        measured = values * (mesh.jacobian(elements, xi) * weights)[:, :, None]
        shares[name] = summed_at_dofs(moved, np.einsum("pq,eqc->epc", moved.basis(xi), measured), elements)
        counts[np.unique(moved.element_dofs[elements])] += 1
    left = reaction - sum(shares.values(), np.zeros_like(reaction))
    left /= np.maximum(counts, 1)[:, None]
    forces = {}
    for name, share in shares.items():
        nodes = np.unique(moved.element_dofs[mesh.part(name)])
        forces[name] = nodal_resultant(name, (share + left)[nodes], points[nodes])
    return forces


def nodal_resultant(name: str, forces: FloatArray, acting_at: FloatArray) -> PartForce:
    """Sum up nodal forces (n, 2) [N/m] that act at points (n, 2) [m].

    These sums are in equilibrium to round-off; the moment of the tractions differs by the error of the mesh.
    """
    moment = float(acting_at[:, 0] @ forces[:, 1] - acting_at[:, 1] @ forces[:, 0])
    return PartForce(name, float(forces[:, 0].sum()), float(forces[:, 1].sum()), moment)


def contact_forces(
    table: ContactTable,
    depth: float,
    resultants: Sequence[PartForce],
    lengths: Sequence[float],
    transitions: Sequence[Transition],
    at_held_nodes: Mapping[str, FloatArray],
) -> ContactForces:
    """Return the forces and sizes of each contact.

    Parameters
    ----------
    table : ContactTable
    depth : float [m]
        Thickness that forces act on.
    resultants : sequence of PartForce
        Of each contact part of the table.
    lengths : sequence of float [m]
        Of the same parts; weights of a corner node may include a share of the next part.
    transitions : sequence of Transition
        Of the same table.
    at_held_nodes : mapping of str to (3,) array [N/m], [N/m], [m]
        Normal and tangential force, and closed length, at nodes of a contact that supports hold.
    """
    zones, forces = unrolled(table, transitions), []
    for resultant, length in zip(resultants, lengths, strict=True):
        further = at_held_nodes.get(resultant.name, np.zeros(3))
        closed = min(length, _contact_length(*zones, resultant.name) + float(further[2]))
        entries = vars(resultant) | _sizes(table, depth, resultant.name, further)
        forces.append(ContactForce(**entries, contact_length=closed))
    return ContactForces(forces)


def forces_on_parts(on_sides: Iterable[tuple[tuple[str, str], PartForce]]) -> dict[str, dict[str, PartForce]]:
    """Sum the forces of contacts on sides of bodies, by the names of body and part."""
    forces: dict[str, dict[str, PartForce]] = {}
    for (body, part), force in on_sides:
        own = forces.setdefault(body, {})
        own[part] = own[part] + force if part in own else replace(force, name=part)
    return forces


def _sizes(table: ContactTable, depth: float, part: str, further: FloatArray) -> dict[str, float]:
    """Return the entries of `ContactForce` besides the resultant and the contact length."""
    nodes = table.rows(part)
    closed = nodes & table.is_closed
    return {
        "force_normal": -depth * float(table.weight[nodes] @ table.sigma_n[nodes] + further[0]),
        "force_tangential": depth * float(table.weight[nodes] @ table.sigma_t[nodes] + further[1]),
        "peak_pressure": max(0.0, float(np.max(-table.sigma_n[nodes], initial=0.0))),  # not -0
        "largest_slip": float(np.abs(table.u_t[closed]).max(initial=0.0)),
    }


def _contact_length(table: ContactTable, transitions: Sequence[Transition], part: str) -> float:
    """Return the length of the pieces of a part, between its ends and transitions, whose nodes are closed.

    Nodes without a partner end a piece.
    """
    return sum(_closed_length(table, piece, part, transitions) for piece in table.runs(table.rows(part)))


def _closed_length(table: ContactTable, nodes: IntArray, part: str, transitions: Sequence[Transition]) -> float:
    """Return the closed length of neighbouring nodes."""
    weights, s = table.weight[nodes], table.s[nodes]
    total, length = float(weights.sum()), 0.0
    # elements reach beyond the outer nodes, if these do not lie at their ends
    beyond = max(total - float(s[-1] - s[0]), 0.0) * float(weights[0] / (weights[0] + weights[-1]))
    last = begin = max(float(s[0]) - beyond, 0.0)
    is_inside = bool(table.is_closed[nodes[0]])
    for transition in transitions:
        if transition.part != part or not s[0] - weights[0] <= transition.s <= s[-1] + weights[-1]:
            continue
        if "separated" in (transition.from_status, transition.to_status):
            if is_inside:
                length += transition.s - last
            is_inside, last = transition.to_status != "separated", transition.s
    if is_inside:
        length += begin + total - last
    return min(length, total)
