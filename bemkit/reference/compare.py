"""Reference data: fields at points of the contact boundary, resultants, and transition points.

References are exact, from other programs, or fine solutions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from bemkit.arrays import FloatArray, read_only
from bemkit.errors import InputError
from bemkit.geometry.local_values import from_own_nodes
from bemkit.geometry.meshing.discretise import Algebraic
from bemkit.geometry.neighbours import along_boundary, arc_lengths, at_arc_lengths
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import element_nodes
from bemkit.results.solution import Solution
from bemkit.results.transitions import FLICKER
from bemkit.scene.discretisation import Galerkin, MeshOptions
from bemkit.scene.scene import Scene

MEASURES: Mapping[str, str] = MappingProxyType(
    {
        "energy": "energy",
        "sigma_n": "normal traction",
        "sigma_t": "tangential traction",
        "displacement": "displacement",
        "force_normal": "normal force",
        "force_tangential": "friction force",
        "transitions": "transition points",
    }
)
"""The relative errors that `errors_of` measures, by name, with words for tables and figures."""
FINEST = 1e-9
"""Accuracy of fine solutions; far below it round-off would decide the status of nodes beside a transition."""
COLUMNS = ("u_n", "u_t", "sigma_n", "sigma_t")


@dataclass(frozen=True)
class ZoneEnd:
    """The end of a contact zone.

    Parameters
    ----------
    part : str
    s : float [m]
        Arc length from the start of the part.
    before, after : str
        ``"separated"``, ``"slip"`` or ``"stick"``; without friction every node in contact slips.
    """

    part: str
    s: float
    before: str
    after: str


@dataclass(frozen=True, eq=False)
class SamplePoints:
    """Points at which fields are compared along one contact part.

    Parameters
    ----------
    part : str
    s : (n,) array [m]
        Arc lengths from the start of the part.
    weight : (n,) array [m]
        Length of boundary of each point.
    """

    part: str
    s: FloatArray
    weight: FloatArray

    def __post_init__(self) -> None:
        read_only(self.s)
        read_only(self.weight)


@dataclass(frozen=True, eq=False)
class SampledFields:
    """Fields to compare; columns run over all points of all parts.

    Parameters
    ----------
    u_n, u_t : (n,) arrays [m]
    sigma_n, sigma_t : (n,) arrays [Pa]
    energy : float [J/m]
        1/2 a(u, u).
    force_normal, force_tangential : float [N/m]
        As in `bemkit.Solution`.
    zones : tuple of ZoneEnd
    """

    u_n: FloatArray
    u_t: FloatArray
    sigma_n: FloatArray
    sigma_t: FloatArray
    energy: float
    force_normal: float
    force_tangential: float
    zones: tuple[ZoneEnd, ...]

    def __post_init__(self) -> None:
        for name in COLUMNS:
            read_only(getattr(self, name))


@dataclass(frozen=True, eq=False)
class Reference:
    """A reference solution for errors.

    Parameters
    ----------
    source : str
        Its source, in a few words.
    places : tuple of SamplePoints
    answer : SampledFields
    own_errors : mapping of str to float
        Its own errors, by the names of `MEASURES`; by default round-off.
    """

    source: str
    places: tuple[SamplePoints, ...]
    answer: SampledFields
    own_errors: Mapping[str, float] = field(default_factory=dict)


def errors_of(answer: SampledFields, reference: Reference) -> dict[str, float]:
    """Return the relative errors of an answer at the places of a reference.

    Returns
    -------
    dict of str to float
        By the names of `MEASURES`: L2 errors of fields relative to the L2 norm of the exact field, of numbers relative
        to the exact number, of transition points relative to the length of their part. nan where the exact value is
        zero or there is no transition point; infinite if a transition point is missing.
    """
    exact = reference.answer
    weight = np.concatenate([places.weight for places in reference.places])

    def of_fields(*names: str) -> float:
        miss = sum(float(weight @ (getattr(answer, name) - getattr(exact, name)) ** 2) for name in names)
        size = sum(float(weight @ getattr(exact, name) ** 2) for name in names)
        return float(np.sqrt(miss / size)) if size > 0.0 else float("nan")

    def of_number(name: str) -> float:
        value = float(getattr(exact, name))
        return abs(float(getattr(answer, name)) / value - 1.0) if value else float("nan")

    return {
        "energy": of_number("energy"),
        "sigma_n": of_fields("sigma_n"),
        "sigma_t": of_fields("sigma_t"),
        "displacement": of_fields("u_n", "u_t"),
        "force_normal": of_number("force_normal"),
        "force_tangential": of_number("force_tangential"),
        "transitions": _of_zones(answer, reference),
    }


def _of_zones(answer: SampledFields, reference: Reference) -> float:
    """Return the largest distance from an exact end of a zone to the nearest one of the same kind."""
    worst = float("nan")
    lengths = {places.part: float(places.weight.sum()) for places in reference.places}
    for zone in reference.answer.zones:
        kind = (zone.part, zone.before, zone.after)
        found = [abs(other.s - zone.s) for other in answer.zones if (other.part, other.before, other.after) == kind]
        distance = min(found, default=float("inf")) / lengths[zone.part]
        worst = distance if np.isnan(worst) else max(worst, distance)
    return worst


def sampled_fields(solution: Solution, places: Sequence[SamplePoints]) -> SampledFields:
    """Evaluate a solution as its elements represent it.

    Returns
    -------
    SampledFields
        Of a frictionless scene every node in contact counts as slipping.
    """
    u_n, u_t, sigma_n, sigma_t = np.concatenate([_along(solution, each) for each in places], axis=1)
    is_frictionless = all(law.is_frictionless for law in solution.laws.values())
    zones: list[ZoneEnd] = []
    for item in solution.transitions:
        words = (item.from_status, item.to_status)
        before, after = ("slip" if is_frictionless and word == "stick" else word for word in words)
        is_near = zones and zones[-1].part == item.part
        if is_near and item.s - zones[-1].s <= FLICKER * solution.part_length(item.part):
            before = zones.pop().before
        zones.append(ZoneEnd(item.part, item.s, before, after))
    zones = [zone for zone in zones if zone.before != zone.after]
    return SampledFields(
        u_n=u_n,
        u_t=u_t,
        sigma_n=sigma_n,
        sigma_t=sigma_t,
        energy=solution.energy,
        force_normal=solution.force_normal,
        force_tangential=solution.force_tangential,
        zones=tuple(zones),
    )


def over_resolved(scene: Scene, most_elements: int) -> Reference:
    """Solve a scene as finely as a number of elements allows and estimate the error of that.

    Returns
    -------
    Reference
        Of elements of rising degree on the last of a sequence of meshes in layers (of a load history, of quadratic
        elements on a mesh graded towards corners and ends of parts). Its own errors are those of the mesh before, and
        so on the safe side.

    Raises
    ------
    InputError
        If there are no two converged solutions.
    """
    solutions = [each for each in _fine_solutions(scene, most_elements) if each.is_certified]
    solutions.sort(key=lambda solution: len(solution.boundary.points))
    if len(solutions) < 2:
        raise InputError(
            f"no two converged solutions with up to {most_elements} quadratic elements: give more, or another scene"
        )
    before, finest = solutions[-2:]
    places = tuple(_gauss_places(finest, part.name) for part in scene.contact_parts)
    degree = finest.scene.discretisation.displacement_space(finest.mesh).degree
    elements = f"{finest.mesh.n_elements} elements of degree {degree}"
    source = f"{elements}, estimated error {finest.estimated_error or 0.0:.1e}"
    reference = Reference(f"over-resolved: {source}", places, sampled_fields(finest, places))
    return replace(reference, own_errors=errors_of(sampled_fields(before, places), reference))


def _fine_solutions(scene: Scene, most_elements: int) -> list[Solution]:
    from bemkit.runs.adaptive import run_adaptive
    from bemkit.runs.run import run

    if scene.n_steps == 1:
        options = MeshOptions(accuracy=FINEST, most_elements=most_elements, rising_degrees=True)
        return list(run_adaptive(replace(scene, discretisation=Galerkin(2), mesh=options)))
    scene, counts = replace(scene, discretisation=Galerkin(2)), (most_elements // 2, most_elements)
    return [run(replace(scene, mesh=MeshOptions(elements=n, grading=Algebraic(3.0)))) for n in counts]


def _along(solution: Solution, places: SamplePoints) -> FloatArray:
    """Evaluate u_n, u_t, sigma_n and sigma_t (rows) by the basis of the displacements."""
    mesh, table = solution.mesh, solution.contact
    space = solution.scene.discretisation.displacement_space(mesh)
    elements = along_boundary(mesh, mesh.part(places.part))
    element_index, xi = at_arc_lengths(mesh, elements, places.s)
    at_dofs = arc_lengths(mesh, elements, element_nodes(space)[elements])
    rows = table.rows(places.part)
    columns = np.stack([np.interp(at_dofs, table.s[rows], getattr(table, name)[rows]) for name in COLUMNS], axis=2)
    return np.asarray(np.einsum("pn,npc->cn", space.basis(xi), from_own_nodes(space, columns, elements)[element_index]))


def _gauss_places(solution: Solution, part: str) -> SamplePoints:
    mesh = solution.mesh
    elements = along_boundary(mesh, mesh.part(part))
    space = solution.scene.discretisation.displacement_space(mesh)
    xi, weights = gauss_legendre(max(4, space.degree + 1))
    length_shares = 0.5 * mesh.lengths[elements, None] * weights
    return SamplePoints(part, arc_lengths(mesh, elements, xi).ravel(), length_shares.ravel())
