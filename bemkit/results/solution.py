"""The result of a scene: physical fields on the boundary, the summary, the plan and the timings.

Everything is in the user's units and holds physical tractions only. Signs: outward normal n, tangent t along the
anticlockwise boundary, traction = stress @ n; a pressed contact has sigma_n <= 0, and u_n <= gap.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, read_only
from bemkit.contact.certificate import Certificate
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.counts import Work
from bemkit.plan import Plan
from bemkit.results.error_indicators import squared_errors
from bemkit.scene.scene import Scene
from bemkit.solvers.active_sets import NodeStatus
from bemkit.solvers.base import Status, StepRecord

STATUS_WORDS: Mapping[NodeStatus, str] = MappingProxyType(
    {
        NodeStatus.SEPARATED: "separated",
        NodeStatus.STICK: "stick",
        NodeStatus.SLIP_FORWARD: "slip",
        NodeStatus.SLIP_BACKWARD: "slip",
    }
)


@dataclass(frozen=True, eq=False)
class ContactTable:
    """One row per contact node, in order along each contact part.

    Parameters
    ----------
    part : tuple of n_contact str
        Name of the part each node belongs to.
    x, y : (n_contact,) arrays [m]
    s : (n_contact,) array [m]
        Arc length from the start of the part.
    u_n, u_t : (n_contact,) arrays [m]
    sigma_n, sigma_t : (n_contact,) arrays [Pa]
    gap : (n_contact,) array [m]
        Initial distance to the obstacle along the normal; infinite where there is none in sight.
    clearance : (n_contact,) array [m]
        Distance left, ``gap - u_n``.
    status : (n_contact,) array of `NodeStatus` values
    weight : (n_contact,) array [m]
        Length of boundary that the node stands for.

    Raises
    ------
    ValueError
        If the columns differ in length, or a status is not a `NodeStatus`.
    """

    part: tuple[str, ...]
    x: FloatArray
    y: FloatArray
    s: FloatArray
    u_n: FloatArray
    u_t: FloatArray
    sigma_n: FloatArray
    sigma_t: FloatArray
    gap: FloatArray
    clearance: FloatArray
    status: IntArray
    weight: FloatArray

    def __post_init__(self) -> None:
        for name, column in self.columns().items():
            if column.shape != (len(self.part),):
                raise InputError(f"{name} has the shape {column.shape}: give ({len(self.part)},), one entry per node")
            read_only(column)
        wrong = np.flatnonzero(~np.isin(self.status, [int(status) for status in NodeStatus]))
        if wrong.size:
            raise InputError(f"status[{wrong[0]}] is {self.status[wrong[0]]}: give values of NodeStatus")

    @classmethod
    def empty(cls) -> ContactTable:
        """Return the table of a scene without contact."""
        none = np.zeros(0)
        return cls((), *(none,) * 9, np.zeros(0, np.intp), none)

    @property
    def n_contact(self) -> int:
        """Number of contact nodes."""
        return len(self.part)

    @property
    def parts(self) -> tuple[str, ...]:
        """The names of the contact parts, in their order."""
        return tuple(dict.fromkeys(self.part))

    def rows(self, part: str) -> BoolArray:
        """Return (n_contact,) bool: the nodes of one part."""
        return np.array([name == part for name in self.part], bool)

    def columns(self) -> dict[str, FloatArray | IntArray]:
        """Return the numerical columns by name."""
        names = ("x", "y", "s", "u_n", "u_t", "sigma_n", "sigma_t", "gap", "clearance", "status", "weight")
        return {name: getattr(self, name) for name in names}

    def status_words(self) -> list[str]:
        """Return ``"separated"``, ``"slip"`` or ``"stick"`` for each node."""
        return [STATUS_WORDS[NodeStatus(value)] for value in self.status.tolist()]


@dataclass(frozen=True, eq=False)
class BoundaryFields:
    """Displacement and traction on the whole boundary.

    Parameters
    ----------
    points : (n_points, 2) array [m]
        Where the displacement is known: the nodes of the displacement space of the scene's discretisation.
    displacement : (n_points, 2) array [m]
    centres : (n_elements, 2) array [m]
    traction : (n_elements, 2) array [Pa]
        Mean of each element.
    traction_dofs : (n_elements, n_local, 2) array [Pa], optional
        Values at the local nodes of the traction space, element by element, because loads may jump anywhere: constant
        tractions by default.

    Raises
    ------
    ValueError
        If the shapes do not fit together.
    """

    points: FloatArray
    displacement: FloatArray
    centres: FloatArray
    traction: FloatArray
    traction_dofs: FloatArray = field(default_factory=lambda: np.zeros((0, 1, 2)))

    def __post_init__(self) -> None:
        dofs = self.traction_dofs if self.traction_dofs.size else self.traction[:, None].copy()
        object.__setattr__(self, "traction_dofs", dofs)
        for place, value in (("points", "displacement"), ("centres", "traction")):
            shape = (len(getattr(self, place)), 2)
            for name in (place, value):
                array = getattr(self, name)
                if array.shape != shape:
                    raise InputError(f"{name} has the shape {array.shape}: give {shape} to match {place}")
                read_only(array)
        if dofs.ndim != 3 or dofs.shape[::2] != self.traction.shape:
            raise InputError(
                f"traction_dofs has the shape {dofs.shape}: give ({len(self.traction)}, n_local, 2) to match traction"
            )
        read_only(dofs)


@dataclass(frozen=True)
class Transition:
    """A point of a contact part where the contact status changes.

    Parameters
    ----------
    part : str
    x, y : float [m]
    s : float [m]
        Arc length from the start of the part.
    from_status, to_status : str
        ``"separated"``, ``"slip"`` or ``"stick"``, in the direction of growing s.
    """

    part: str
    x: float
    y: float
    s: float
    from_status: str
    to_status: str

    def as_dict(self) -> dict[str, str | float]:
        """Return the entries under the names of the results file."""
        return {
            "part": self.part,
            "x": self.x,
            "y": self.y,
            "s": self.s,
            "from": self.from_status,
            "to": self.to_status,
        }


_FIT = (2, 4, 6, 12)
"""Nodes from a transition on that tell its place (the first two) and the power of the distance (the last two). The
values at the nodes before them are the least accurate."""
_CLOSE = 0.1
"""Distance, relative to the size of the zone, up to which that power holds closely."""
_POWERS = (1.3, 1.7)
"""The powers that sliding friction may make of 3/2."""
_LEAST_ZONE = 0.5
"""Least length of a zone, relative to its length if it ends halfway between its nodes and its neighbours'."""


def find_transitions(contact: ContactTable, slip: FloatArray | None = None) -> tuple[Transition, ...]:
    """Find where the status changes along each contact part.

    Parameters
    ----------
    contact : ContactTable
    slip : (n_contact,) array [m], optional
        Under the incremental law ``u_t`` less its value at the end of the step before; ``u_t`` itself by default.

    Returns
    -------
    tuple of Transition
        In order along each part. A change of the direction of slip alone is not a transition.

    Notes
    -----
    Near the end of a smooth contact zone at distance d the clearance grows like d^(3/2), and so does the slip near the
    end of a stick zone. Its power 2/3, extrapolated from the last two open (or slipping) nodes, therefore crosses zero
    at the transition; on the paper's examples this is within a quarter of the node distance. Sliding friction changes
    the power somewhat (to 1.56 at the separation point of Example 1): on meshes that are fine there it is fitted too,
    and the two nodes next to the transition, where the computed solution is least true, are passed over. Where that
    says nothing, as at the edge of an obstacle, or where two of them would swallow a narrow zone between them, the
    transition is put halfway between the two nodes that differ.
    """
    words = contact.status_words()
    slip = contact.u_t if slip is None else slip
    changes = [i for i in range(contact.n_contact - 1) if words[i] != words[i + 1] and are_neighbours(contact, i)]
    places = np.array([_transition_place(contact, slip, words, i) for i in changes])
    found = []
    for i, s in zip(changes, _kept_apart(contact, changes, places).tolist(), strict=True):
        rows = contact.rows(contact.part[i])
        x, y = (float(np.interp(s, contact.s[rows], column[rows])) for column in (contact.x, contact.y))
        found.append(Transition(contact.part[i], x, y, s, words[i], words[i + 1]))
    return tuple(found)


def _kept_apart(contact: ContactTable, changes: list[int], places: FloatArray) -> FloatArray:
    """Put transitions halfway between their nodes where they leave next to nothing of a zone, which has nodes."""
    kept = places.copy()
    halfway = np.array([(contact.s[i] + contact.s[i + 1]) / 2.0 for i in changes])
    for part in dict.fromkeys(contact.part[i] for i in changes):
        own = [k for k, i in enumerate(changes) if contact.part[i] == part]
        ends = contact.s[contact.rows(part)][[0, -1]]
        least = _LEAST_ZONE * np.diff(halfway[own], prepend=ends[0], append=ends[1])
        for _ in own:  # what moves back may meet the next transition
            is_lost = np.diff(kept[own], prepend=ends[0], append=ends[1]) < least
            kept[own] = np.where(is_lost[:-1] | is_lost[1:], halfway[own], kept[own])
    return kept


def are_neighbours(contact: ContactTable, i: int) -> bool:
    """Tell whether the nodes i and i + 1 follow each other on one piece of one part."""
    distance = np.hypot(contact.x[i + 1] - contact.x[i], contact.y[i + 1] - contact.y[i])
    # the lengths two neighbours stand for add up to at least their distance, however graded the mesh is
    reach = (1.0 + 1e-9) * (contact.weight[i] + contact.weight[i + 1])
    return contact.part[i] == contact.part[i + 1] and bool(distance <= reach)


def _transition_place(contact: ContactTable, slip: FloatArray, words: list[str], i: int) -> float:
    """Return the arc length of the transition between the nodes i and i + 1; see `find_transitions`."""
    looser = ("separated", "slip", "stick")
    is_forward = looser.index(words[i]) < looser.index(words[i + 1])
    last, tighter, step = (i, i + 1, -1) if is_forward else (i + 1, i, 1)
    middle = float(contact.s[i] + contact.s[i + 1]) / 2.0
    zone = [last]
    while 0 <= (k := zone[-1] + step) < contact.n_contact and (words[k], contact.part[k]) == (
        words[last],
        contact.part[last],
    ):
        zone.append(k)
    if len(zone) < 2:
        return middle
    field = contact.clearance if words[last] == "separated" else np.abs(slip)
    distance = _distance_to_zero(np.abs(contact.s[zone] - contact.s[last]), field[zone])
    if distance is None:
        return middle
    gap = contact.s[tighter] - contact.s[last]
    return float(contact.s[last] + np.clip(distance / abs(gap), 0.0, 2.0) * gap)


def _distance_to_zero(s: FloatArray, field: FloatArray) -> float | None:
    """Extrapolate powers of the distance from a zone's nodes at s = 0, s[1], ...; None if they do not fall to zero."""
    is_fine = len(s) > _FIT[-1] and s[_FIT[-1]] < _CLOSE * s[-1]
    near, far, *outer = _FIT if is_fine else (0, 1)
    power, distance = 1.5, 0.0
    values = field[[near, far, *outer]]
    if not (np.isfinite(values).all() and np.all(np.diff(values) > 0.0) and values[0] >= 0.0):
        return None
    for _ in range(4 if is_fine else 1):
        share = (field[near] / field[far]) ** (1.0 / power)
        distance = float((s[far] * share - s[near]) / (1.0 - share))
        if is_fine:
            inner, outermost = (max(s[k] + distance, s[1]) for k in outer)
            ratio = np.log(field[outer[1]] / field[outer[0]]) / np.log(outermost / inner)
            power = float(np.clip(ratio, *_POWERS))
    return distance


@dataclass(frozen=True, eq=False)
class Solution:
    """What `bemkit.run` returns and a result file holds.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh
    status : Status
    certificate : Certificate
    contact : ContactTable
    boundary : BoundaryFields
    history : tuple of StepRecord
    linear_solves, outer_steps : int
    force_normal : float [N/m]
        The total pressing force, positive: minus the integral of sigma_n.
    force_tangential : float [N/m]
        The total friction force on the body along the boundary tangent: the integral of sigma_t.
    energy : float [J/m]
        Elastic energy 1/2 a(u, u).
    transitions : tuple of Transition
    timings : mapping of str to float [s]
        Of each stage of the run, and of all.
    plan : Plan
    work : Work
        What was computed; equal to ``plan.work`` if all load steps converged.
    memory : mapping of str to int [bytes]
        Largest memory of all arrays in each stage of the run; empty unless `tracemalloc` was tracing.
    warnings : tuple of str
        What is doubtful about the result, one sentence each; see `bemkit.results.warnings`.
    """

    scene: Scene
    mesh: BoundaryMesh
    status: Status
    certificate: Certificate
    contact: ContactTable
    boundary: BoundaryFields
    history: tuple[StepRecord, ...]
    linear_solves: int
    outer_steps: int
    force_normal: float
    force_tangential: float
    energy: float
    transitions: tuple[Transition, ...]
    timings: Mapping[str, float]
    plan: Plan
    work: Work
    message: str = ""
    memory: Mapping[str, int] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def is_converged(self) -> bool:
        """Whether the result is what was asked for: certified, and as accurate as an accuracy demands."""
        return self.status is Status.CONVERGED

    @property
    def is_certified(self) -> bool:
        """Whether contact, friction and equilibrium hold on the mesh, be it fine enough for the accuracy or not."""
        return self.status in (Status.CONVERGED, Status.ACCURACY_NOT_REACHED)

    @cached_property
    def element_errors(self) -> FloatArray | None:
        """(n_elements,) array [J/m]: estimated squared errors in the energy norm; None without an estimate."""
        discretisation, modulus = self.scene.discretisation, self.scene.material.plane_modulus
        if not discretisation.estimates_error:
            return None
        make_space = discretisation.displacement_space
        return squared_errors(self.mesh, make_space, self.boundary.displacement, self.boundary.traction, modulus)

    @cached_property
    def estimated_error(self) -> float | None:
        """Estimated error in the energy norm, sqrt(a(u - u_h, u - u_h) / a(u_h, u_h)).

        None without an estimate, and where the energy is not positive, so that an error is measured against nothing;
        zero of a body at rest.
        """
        if self.element_errors is None:
            return None
        error = float(self.element_errors.sum())
        if error == 0.0:
            return 0.0
        return float(np.sqrt(error / (2.0 * self.energy))) if self.energy > 0.0 else None

    def summary(self) -> dict[str, Any]:
        """Return the result without its fields, under the stable names of the JSON output.

        Returns
        -------
        dict
            ``status`` (a word), ``message`` (how the solver ended), ``converged``, ``certified``, ``warnings``,
            ``n_elements``, ``n_contact``, ``linear_solves``, ``outer_steps``, ``force_normal`` and
            ``force_tangential`` [N/m], ``energy`` [J/m], ``estimated_error`` (None without an estimate),
            ``transitions``, ``certificate``, ``timings`` [s], ``plan``, ``work``, ``memory`` [bytes].
        """
        return {
            "title": self.scene.title,
            "status": self.status.name.lower(),
            "message": self.message or self.status.value,
            "converged": self.is_converged,
            "certified": self.is_certified,
            "warnings": list(self.warnings),
            "n_elements": self.mesh.n_elements,
            "n_contact": self.contact.n_contact,
            "linear_solves": self.linear_solves,
            "outer_steps": self.outer_steps,
            "force_normal": self.force_normal,
            "force_tangential": self.force_tangential,
            "energy": self.energy,
            "estimated_error": self.estimated_error,
            "transitions": [transition.as_dict() for transition in self.transitions],
            "certificate": self.certificate.as_dict(),
            "timings": dict(self.timings),
            "plan": self.plan.as_dict(),
            "work": self.work.as_dict(),
            "memory": dict(self.memory),
        }
