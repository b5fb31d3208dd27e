"""The bodies and contacts of a solved scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from bemkit.arrays import FloatArray
from bemkit.contact.body import SlipHistory
from bemkit.contact.laws import FrictionLaw
from bemkit.errors import InputError, format_point
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.results.contact_table import ContactTable
from bemkit.results.part_forces import ContactForces, PartForce, RigidResult
from bemkit.results.solved_body import BoundaryFields, SideName, SolvedBody
from bemkit.results.transitions import Transition
from bemkit.scene.conditions import name_at_obstacle
from bemkit.scene.scene import Scene
from bemkit.scene.unit_names import UnitNames

if TYPE_CHECKING:
    from bemkit.operators.somigliana.potentials import PotentialFields
    from bemkit.results.load_history import LoadHistory
    from bemkit.results.side_stress import LargestStress
    from bemkit.table import Table


@dataclass(frozen=True, eq=False, kw_only=True)
class SolvedScene:
    """Fields of bodies, and what contacts transmit.

    The contact table has a row for each contact node; between bodies `part` is the name of the contact, and
    displacements are those of the body with the node less those of its partner.

    Parameters
    ----------
    scene : Scene
        With all contacts listed, those found by `Touching` among them; of a load history that of its last step.
    bodies : mapping of str to SolvedBody
        By name, in the order of the scene; the name of the only body of a scene that names none is empty.
    contact_sides : mapping of str to tuple of SideName
        The sides of elastic bodies in each contact of the table and of the scene, first the one with the nodes.
    contact_directions : (n_contact, 2) array
        Unit vectors of u_n and sigma_n, out of the body with the node.
    friction_bound : (n_contact,) array or None [Pa]
        The largest friction at each contact node; None if there is none anywhere.
    contacts : tuple of ContactForce
        What each contact transmits, with contact length, peak pressure and largest slip; by index or by name.
    rigid : mapping of str to RigidResult
        How each rigid body moved and what acts on it, by name.
    contact : ContactTable
    transitions : tuple of Transition
    loading : LoadHistory, optional
        The steps up to this one; None without a load history.
    """

    scene: Scene
    bodies: Mapping[str, SolvedBody]
    contact_sides: Mapping[str, tuple[SideName, ...]]
    contact_directions: FloatArray
    friction_bound: FloatArray | None
    contacts: ContactForces
    rigid: Mapping[str, RigidResult] = field(default_factory=dict)
    contact: ContactTable
    transitions: tuple[Transition, ...]
    loading: LoadHistory | None = None

    @property
    def body(self) -> SolvedBody:
        """The only body.

        Raises
        ------
        InputError
            If there are several.
        """
        if len(self.bodies) > 1:
            raise InputError(f"there are {len(self.bodies)} bodies: take one of `bodies`: {', '.join(self.bodies)}")
        return next(iter(self.bodies.values()))

    @property
    def mesh(self) -> BoundaryMesh:
        """The mesh of the only body."""
        return self.body.mesh

    @property
    def boundary(self) -> BoundaryFields:
        """The fields on the boundary of the only body."""
        return self.body.boundary

    @property
    def part_forces(self) -> tuple[PartForce, ...]:
        """The resultants on each part of the only body; see `SolvedBody.part_forces`."""
        return self.body.part_forces

    def stress(self, points: npt.ArrayLike, part: str | None = None) -> FloatArray:
        """Evaluate the stress (n, 2, 2) [Pa] inside the only body and on its boundary; see `SolvedBody.stress`."""
        return self.body.stress(points, part)

    def displacement(self, points: npt.ArrayLike) -> FloatArray:
        """Evaluate the displacement (n, 2) [m] inside the only body and on its boundary, at points (n, 2) [m]."""
        return self.body.displacement(points)

    def side_stress(self, part: str) -> Table:
        """Return the stress along a part of the only body; see `SolvedBody.side_stress`."""
        return self.body.side_stress(part)

    def largest_stress(self, measure: str = "von-mises", part: str | None = None) -> LargestStress:
        """Return the stress of largest size on the only boundary; see `SolvedBody.largest_stress`."""
        return self.body.largest_stress(measure, part)

    def stress_concentration(self, nominal: float, measure: str = "hoop", part: str | None = None) -> float:
        """Return the largest stress on the only boundary over a nominal one [Pa]; see `largest_stress`."""
        return self.body.stress_concentration(nominal, measure, part)

    @property
    def stated(self) -> Scene:
        """The scene that was solved, with all its load steps."""
        return self.scene if self.loading is None else self.loading.asked

    @property
    def motion(self) -> SlipHistory | None:
        """Slip of the contact nodes in a load history; None without one."""
        return None if self.loading is None else self.loading.motion

    @property
    def energy(self) -> float:
        """Elastic energy of all bodies [J/m]."""
        return sum(body.energy for body in self.bodies.values())

    @property
    def error_unit(self) -> float:
        """Energy [J/m] to which squared errors in the energy norm are relative; see `SolvedBody.error_unit`."""
        return sum(body.error_unit for body in self.bodies.values())

    @property
    def energy_of_round_off(self) -> float:
        """Elastic energy [J/m] that may be round-off of rigid motions."""
        return sum(body.energy_of_round_off for body in self.bodies.values())

    @property
    def force_normal(self) -> float:
        """Sum of the pressing forces of all contacts [N/m], positive."""
        return sum((contact.force_normal for contact in self.contacts), 0.0)

    @property
    def force_tangential(self) -> float:
        """Sum of the friction forces of all contacts along their tangents [N/m]."""
        return sum((contact.force_tangential for contact in self.contacts), 0.0)

    @property
    def units(self) -> UnitNames | None:
        """Names of units, if the scene has them."""
        return self.scene.result_units

    @property
    def title(self) -> str:
        """The title of the scene."""
        return self.scene.title

    @property
    def n_elements(self) -> int:
        """Number of elements of all bodies."""
        return sum(body.mesh.n_elements for body in self.bodies.values())

    @property
    def laws(self) -> dict[str, FrictionLaw]:
        """The friction law of each contact, by name."""
        at_obstacles = {
            name_at_obstacle(body.name, part): law
            for body in self.bodies.values()
            for part, law in body.scene.laws.items()
        }
        return at_obstacles | {pair.name: self.scene.law_of(pair) for pair in self.scene.contacts}

    def n_sides(self, contact: str) -> int:
        """Return how many elastic bodies carry the tractions of a contact."""
        return len(self.contact_sides[contact])

    def part_length(self, contact: str) -> float:
        """Return the length of boundary that can touch in a contact [m]."""
        side, weights = self.contact_sides[contact][0], self.contact.weight[self.contact.rows(contact)]
        mesh = self.bodies[side.body].mesh
        # weights of a corner node may include a share of the next part
        return float(min(weights.sum(), mesh.lengths[mesh.part(side.part)].sum()))

    @property
    def contact_traction_size(self) -> float:
        """L2 norm of the contact tractions of all bodies [Pa m^(1/2)]; those between two bodies count for both."""
        table = self.contact
        squared = table.weight * (table.sigma_n**2 + table.sigma_t**2)
        return float(np.sqrt(sum(self.n_sides(name) * squared[table.rows(name)].sum() for name in table.parts)))


def interior_fields(solution: SolvedScene | SolvedBody) -> PotentialFields:
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
    body = solution.body if isinstance(solution, SolvedScene) else solution
    return body.boundary_stress.interior


def contact_facts(solution: SolvedScene) -> list[dict[str, Any]]:
    """Return the numbers of each contact by name.

    Those of `ContactForce`, and ``contact_fraction`` [-], the share of the contact that touches, ``peak_x`` and
    ``peak_y`` [m], the node of the peak pressure.
    """
    return [
        contact.as_dict()
        | {"contact_fraction": contact.contact_length / solution.part_length(contact.name)}
        | _peak(solution.contact, contact.name)
        for contact in solution.contacts
    ]


def place_in(solution: SolvedScene, point: FloatArray | tuple[float, float], digits: int = 4) -> str:
    """Write a point (2,) [m] of a solution for a message."""
    return format_point(point, max(body.mesh.diameter for body in solution.bodies.values()), digits)


def _peak(table: ContactTable, part: str) -> dict[str, float]:
    rows = np.flatnonzero(table.rows(part))
    node = rows[np.argmin(table.sigma_n[rows])]
    return {"peak_x": float(table.x[node]), "peak_y": float(table.y[node])}


def part_facts(solution: SolvedScene) -> list[dict[str, Any]]:
    """Return the resultants on each part, with the name of the ``body`` if it has one."""
    return [
        ({"body": name} if name else {}) | force.as_dict()
        for name, body in solution.bodies.items()
        for force in body.part_forces
    ]
