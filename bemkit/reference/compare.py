"""A solution at the places of a reference, and a fine solution as a reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.laws import FrictionLaw
from bemkit.errors import InputError
from bemkit.geometry.grading import Algebraic
from bemkit.geometry.meshing.order import along_boundary
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.reference.values import Answer, Places, Reference, Zone, errors_of
from bemkit.results.solution import Solution
from bemkit.scene.conditions import Contact
from bemkit.scene.discretisation import QuadraticGalerkin
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.scene import Scene

FINEST = 1e-12
"""An accuracy that no mesh reaches, so that the number of elements alone ends the search."""
COLUMNS = ("u_n", "u_t", "sigma_n", "sigma_t")
CORNERS = Algebraic(3.0)
"""Grading where meshes cannot follow the solution."""


class OverResolutionError(InputError):
    """A scene for which two fine solutions could not be made."""


def answer_of(solution: Solution, places: Sequence[Places]) -> Answer:
    """Evaluate a solution as its elements represent it.

    Parameters
    ----------
    solution : Solution
    places : sequence of Places

    Returns
    -------
    Answer
        Of a frictionless scene every node in contact counts as slipping.
    """
    u_n, u_t, sigma_n, sigma_t = np.concatenate([_along(solution, each) for each in places], axis=1)
    is_frictionless = all(law.is_frictionless for law in _laws(solution.scene))
    zones = []
    for item in solution.transitions:
        words = (item.from_status, item.to_status)
        before, after = ("slip" if is_frictionless and word == "stick" else word for word in words)
        if before != after:
            zones.append(Zone(item.part, item.s, before, after))
    return Answer(
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

    Parameters
    ----------
    scene : Scene
    most_elements : int

    Returns
    -------
    Reference
        Of quadratic elements on the last of a sequence of adaptive meshes (of a load history, on a mesh graded towards
        corners and ends of parts). Its own errors are those of the mesh before, and so on the safe side.

    Raises
    ------
    OverResolutionError
        If there are no two converged solutions.
    """
    scene = replace(scene, discretisation=QuadraticGalerkin())
    solutions = _fine_solutions(scene, most_elements)
    solutions = sorted((s for s in solutions if s.is_certified), key=lambda s: s.mesh.n_elements)
    if len(solutions) < 2:
        raise OverResolutionError(
            f"no two converged solutions with up to {most_elements} quadratic elements: give more, or another scene"
        )
    before, finest = solutions[-2:]
    places = tuple(_gauss_places(finest, part.name) for part in scene.contact_parts)
    source = f"{finest.mesh.n_elements} quadratic elements, estimated error {finest.estimated_error or 0.0:.1e}"
    reference = Reference(f"over-resolved: {source}", places, answer_of(finest, places))
    return replace(reference, own_errors=errors_of(answer_of(before, places), reference))


def _fine_solutions(scene: Scene, most_elements: int) -> list[Solution]:
    from bemkit.runs.adaptive import run_adaptive
    from bemkit.runs.run import run

    if len(scene.load_factors) == 1:
        return list(run_adaptive(replace(scene, mesh=MeshOptions(accuracy=FINEST, most_elements=most_elements))))
    counts = (most_elements // 2, most_elements)
    return [run(replace(scene, mesh=MeshOptions(elements=n, grading=CORNERS))) for n in counts]


def _laws(scene: Scene) -> list[FrictionLaw]:
    own = [part.condition.law for part in scene.contact_parts if isinstance(part.condition, Contact)]
    return [scene.law if law is None else law for law in own]


def _along(solution: Solution, places: Places) -> FloatArray:
    """Evaluate u_n, u_t, sigma_n and sigma_t (rows) by the basis of the displacements."""
    mesh, table = solution.mesh, solution.contact
    space = solution.scene.discretisation.displacement_space(mesh)
    elements = along_boundary(mesh, mesh.part(places.part))
    lengths = mesh.lengths[elements]
    ends = np.cumsum(lengths)
    own = np.clip(np.searchsorted(ends, places.s), 0, elements.size - 1)
    basis = space.basis(np.clip(2.0 * (places.s - ends[own]) / lengths[own] + 1.0, -1.0, 1.0))
    at_dofs = (ends - lengths)[:, None] + 0.5 * lengths[:, None] * (space.local_nodes + 1.0)
    rows = table.rows(places.part)
    columns = [np.interp(at_dofs, table.s[rows], getattr(table, name)[rows])[own] for name in COLUMNS]
    return np.asarray(np.einsum("pn,cnp->cn", basis, np.stack(columns)))


def _gauss_places(solution: Solution, part: str) -> Places:
    mesh = solution.mesh
    lengths = mesh.lengths[along_boundary(mesh, mesh.part(part))]
    space = solution.scene.discretisation.displacement_space(mesh)
    xi, weights = gauss_legendre(max(4, space.degree + 1))
    half = 0.5 * lengths[:, None]
    return Places(part, (np.cumsum(lengths)[:, None] + half * (xi - 1.0)).ravel(), (half * weights).ravel())
