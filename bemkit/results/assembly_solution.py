"""The result of an assembly: the fields of each body, the contacts between them, and how the solve ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, cast

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.certificate import Certificate
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.notebook import ShownInNotebooks
from bemkit.operators.counts import OperationCounts
from bemkit.plan import Plan
from bemkit.results.between_bodies import violations_between_bodies
from bemkit.results.between_nodes import BetweenNodes
from bemkit.results.contact_table import ContactTable, Transition
from bemkit.results.load_history import LoadHistory, at_step, step_rows
from bemkit.results.part_forces import ContactForce
from bemkit.results.rigid_result import RigidResult
from bemkit.results.solved_body import BoundaryFields, SolvedBody
from bemkit.scene.assembly import Assembly
from bemkit.scene.scene import Scene
from bemkit.scene.unit_names import UnitNames
from bemkit.solvers.base import Status, StepRecord


@dataclass(frozen=True, eq=False)
class BodyResult(SolvedBody):
    """One body of a solved assembly; `bemkit.interior_fields` takes it like a solution.

    Parameters
    ----------
    name : str
    scene : Scene
        What was said of the body alone, its mesh in the coordinates of its shape.
    mesh : BoundaryMesh
        In its place.
    boundary : BoundaryFields
    energy : float [J/m]
        Elastic energy of this body.
    """

    name: str
    scene: Scene
    mesh: BoundaryMesh
    boundary: BoundaryFields
    energy: float

    def __repr__(self) -> str:
        """Return one line."""
        return f"BodyResult({self.name!r}: {self.mesh.n_elements} elements)"

    def summary(self) -> dict[str, Any]:
        """Return the result without its fields."""
        return {
            "n_elements": self.mesh.n_elements,
            "energy": self.energy,
            "parts": [force.as_dict() for force in self.part_forces],
        }


@dataclass(frozen=True, eq=False)
class AssemblySolution(ShownInNotebooks):
    """What `bemkit.run` returns of an assembly.

    Parameters
    ----------
    assembly : Assembly
        With all contacts listed, those found by `Assembly.touching` among them; of a load history that of its last
        step.
    bodies : mapping of str to BodyResult
        By name, in the order of the assembly.
    status : Status
    certificate : Certificate
    contact : ContactTable
        One row for each multiplier node; `part` is the name of the contact, displacements are relative ones: those of
        the body with the node less those of its partner.
    contact_directions : (n_contact, 2) array
        Unit vectors of u_n and sigma_n, out of the body with the node.
    friction_bound : (n_contact,) array or None [Pa]
        The largest friction at each contact node; None if there is none anywhere.
    contacts : tuple of ContactForce
        What each contact transmits.
    history : tuple of StepRecord
    linear_solves, outer_steps : int
    transitions : tuple of Transition
    timings : mapping of str to float [s]
    plan : Plan
    work : OperationCounts
        What was computed; equal to ``plan.work``.
    message : str
    memory : mapping of str to int [bytes]
    rigid : mapping of str to RigidResult
        How each rigid body moved and what acts on it, by name.
    warnings : tuple of str
    loading : LoadHistory, optional
        Of a load history the steps up to this one.
    """

    assembly: Assembly
    bodies: Mapping[str, BodyResult]
    status: Status
    certificate: Certificate
    contact: ContactTable
    contact_directions: FloatArray
    friction_bound: FloatArray | None
    contacts: tuple[ContactForce, ...]
    history: tuple[StepRecord, ...]
    linear_solves: int
    outer_steps: int
    transitions: tuple[Transition, ...]
    timings: Mapping[str, float]
    plan: Plan
    work: OperationCounts
    message: str = ""
    memory: Mapping[str, int] = field(default_factory=dict)
    rigid: Mapping[str, RigidResult] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    loading: LoadHistory | None = None

    def __repr__(self) -> str:
        """Return one line; the fields hold thousands of numbers."""
        status = self.status.name.lower().replace("_", " ")
        sizes = f"{len(self.bodies)} bodies, {self.n_elements} elements, {self.contact.n_contact} contact nodes"
        return f"AssemblySolution({self.assembly.title!r}: {status}, {sizes})"

    @property
    def stated(self) -> Assembly:
        """What was asked: the assembly, with all its load steps."""
        return self.assembly if self.loading is None else cast(Assembly, self.loading.asked)

    def at_step(self, number: int) -> AssemblySolution:
        """Return the solution at the end of a finished step of its load history, counted from 1; see `LoadHistory`."""
        return at_step(self, number)

    @property
    def units(self) -> UnitNames | None:
        """Names of units, if the assembly has them."""
        return self.assembly.units

    @property
    def title(self) -> str:
        """The title of the assembly."""
        return self.assembly.title

    def part_length(self, contact: str) -> float:
        """Return the length of boundary that can touch in a contact [m]."""
        own = self.contact.rows(contact)
        return float(self.contact.weight[own].sum()) + max(float(self.contact.s[own][0]), 0.0)

    @property
    def is_converged(self) -> bool:
        """Whether the result is what was asked for: certified, and as accurate as an accuracy demands."""
        return self.status is Status.CONVERGED

    @property
    def is_certified(self) -> bool:
        """Whether contact, friction and equilibrium hold on the meshes, be they fine enough or not."""
        return self.status in (Status.CONVERGED, Status.ACCURACY_NOT_REACHED)

    @property
    def n_elements(self) -> int:
        """Number of elements of all bodies."""
        return sum(body.mesh.n_elements for body in self.bodies.values())

    @property
    def energy(self) -> float:
        """Elastic energy of all bodies [J/m]."""
        return sum(body.energy for body in self.bodies.values())

    @property
    def force_normal(self) -> float:
        """Sum of the pressing forces of all contacts [N/m], positive."""
        return sum(contact.force_normal for contact in self.contacts)

    @property
    def force_tangential(self) -> float:
        """Sum of the friction forces of all contacts along their tangents [N/m]."""
        return sum(contact.force_tangential for contact in self.contacts)

    @cached_property
    def estimated_error(self) -> float | None:
        """Estimated error in the energy norm of all bodies, relative to the solution; None without an estimate."""
        errors = [body.element_errors for body in self.bodies.values()]
        if any(each is None for each in errors) or not self.error_unit > 0.0:
            return None
        return float(np.sqrt(sum(float(each.sum()) for each in errors if each is not None) / self.error_unit))

    @property
    def error_unit(self) -> float:
        """What squared errors in the energy norm are measured by [J/m]; see `SolvedBody.error_unit`."""
        return sum(body.error_unit for body in self.bodies.values())

    @cached_property
    def between_nodes(self) -> BetweenNodes | None:
        """Largest violations of the contact conditions between the nodes, of which the certificate says nothing."""
        return BetweenNodes.largest(self.contacts_between_nodes.values())

    @cached_property
    def contacts_between_nodes(self) -> dict[str, BetweenNodes]:
        """The same of each contact, by name."""
        motion = None if self.loading is None else self.loading.motion
        return violations_between_bodies(self.assembly, self.bodies, self.rigid, self.contact, motion)

    def contact_elements(self, body: str) -> IntArray:
        """Return the elements of a body that may touch other bodies."""
        mesh = self.bodies[body].mesh
        sides = [side.split(".", 1) for pair in self.assembly.contacts for side in pair.elastic_sides]
        parts = dict.fromkeys(part for owner, part in sides if owner == body)
        return np.concatenate([np.zeros(0, np.intp), *(mesh.part(part) for part in parts)])

    def summary(self) -> dict[str, Any]:
        """Return the result without its fields, under the names of the JSON output; see `Solution.summary`."""
        return {
            "title": self.assembly.title,
            "units": None if self.units is None else self.units.as_dict(),
            "status": self.status.name.lower(),
            "message": self.message or self.status.value,
            "converged": self.is_converged,
            "certified": self.is_certified,
            "warnings": list(self.warnings),
            "n_bodies": len(self.bodies),
            "n_elements": self.n_elements,
            "n_contact": self.contact.n_contact,
            **{name: getattr(self, name) for name in ("linear_solves", "outer_steps", "force_normal")},
            **{name: getattr(self, name) for name in ("force_tangential", "energy", "estimated_error")},
            "contacts": [contact.as_dict() for contact in self.contacts],
            "bodies": {name: body.summary() for name, body in self.bodies.items()},
            "rigid": {name: body.as_dict() for name, body in self.rigid.items()},
            "transitions": [transition.as_dict() for transition in self.transitions],
            "certificate": self.certificate.as_dict(),
            "between_nodes": None if self.between_nodes is None else self.between_nodes.as_dict(),
            "timings": dict(self.timings),
            "plan": self.plan.as_dict(),
            "work": self.work.as_dict(),
            "memory": dict(self.memory),
            "steps": step_rows(self.loading),
        }
