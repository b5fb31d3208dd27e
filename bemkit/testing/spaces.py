"""Conformance of curves and of boundary spaces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.curves import Curve
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.vectors import cross, norms
from bemkit.testing.failure import class_name, demand, evaluated


def check_curve(curve: Curve) -> None:
    """Check everything that `Curve` promises; call it on your own curve.

    Raises
    ------
    CheckFailed
        Naming the curve, the promise broken, where, and by how much.
    """
    name = class_name(curve)
    s = np.sort(np.concatenate([[0.0, 1.0], np.random.default_rng(0).uniform(0.0, 1.0, 40)]))
    demand(isinstance(curve.is_straight, bool), f"{name}.is_straight is {curve.is_straight!r}, not a bool")
    demand(isinstance(curve.is_analytic, bool), f"{name}.is_analytic is {curve.is_analytic!r}, not a bool")
    points, derivatives = (_evaluated(method, name, s) for method in (curve.point, curve.derivative))
    demand(
        isinstance(curve.magnitude, float) and curve.magnitude >= 0.5 * float(np.abs(points).max()),
        f"{name}.magnitude is {curve.magnitude!r}, not a number of the size of the largest coordinate",
    )
    speed = norms(derivatives)
    slowest = int(np.argmin(speed))
    demand(speed[slowest] > 0.0, f"{name}.derivative vanishes at s = {s[slowest]:.6g}")
    _check_derivative(curve, name, s[1:-1], derivatives[1:-1])
    if curve.is_straight:
        chord = points[-1] - points[0]
        away = np.abs(cross(points - points[0], np.broadcast_to(chord, points.shape))) / norms(chord)
        worst = int(np.argmax(away))
        # round-off of the coordinates
        tolerance = 1e-13 * (float(np.abs(points).max()) + float(norms(chord)))
        demand(
            away[worst] <= tolerance, f"{name} says it is straight, but strays by {away[worst]:.3g} at s = {s[worst]:g}"
        )


def _evaluated(method: Callable[[FloatArray], FloatArray], name: str, s: FloatArray) -> FloatArray:
    label = f"{name}.{method.__name__}"
    values = evaluated(label, method, s, (s.size, 2))
    one_by_one = np.concatenate([method(s[k : k + 1]) for k in range(s.size)])
    difference = float(np.abs(one_by_one - values).max())
    # vectorised functions may round differently from their scalar form
    demand(
        difference <= 1e-14 * (1e-300 + float(np.abs(values).max())),
        f"{label} at one parameter depends on the others: it differs by {difference:.3g}",
    )
    return values


def _check_derivative(curve: Curve, name: str, s: FloatArray, derivative: FloatArray) -> None:
    step = 1e-4 * np.minimum(1.0, np.minimum(s, 1.0 - s) / 1e-3)  # central differences that stay in [0, 1]
    difference = (curve.point(s + step) - curve.point(s - step)) / (2.0 * step)[:, None]
    error = norms(difference - derivative)
    size = float(norms(derivative).max())
    # relative truncation step^2, and the round-off of coordinates far from the origin over the step
    slack = 1e-5 * size + 1e-15 * float(np.abs(curve.point(s)).max()) / step
    worst = int(np.argmax(error - slack))
    demand(
        error[worst] <= slack[worst],
        f"{name}.derivative is {derivative[worst]} at s = {s[worst]:.6g}, but differences of point give "
        f"{difference[worst]}",
    )


ROUND_OFF = 1e-12
"""Basis functions are polynomials of low degree on [-1, 1]: a few hundred times the precision of a double."""


def check_space(space: BoundarySpace) -> None:
    """Check everything that `BoundarySpace` promises; call it on your own space.

    Parameters
    ----------
    space : BoundarySpace
        On any mesh; one with several loops and corners finds most.

    Raises
    ------
    CheckFailed
        Naming the space, the promise broken, where, and by how much.
    """
    name = class_name(space)
    random = np.random.default_rng(0)
    demand(isinstance(space.mesh, BoundaryMesh), f"{name}.mesh is a {type(space.mesh).__name__}, not a BoundaryMesh")
    demand(isinstance(space.degree, int) and space.degree >= 0, f"{name}.degree is {space.degree!r}, not an int >= 0")
    demand(isinstance(space.is_continuous, bool), f"{name}.is_continuous is {space.is_continuous!r}, not a bool")
    _check_numbering(space, name)
    _check_basis(space, name, random)
    _check_degree(space, name, random)
    _check_shared_dofs(space, name)
    _check_continuity(space, name, random)


def _check_numbering(space: BoundarySpace, name: str) -> None:
    dofs = np.asarray(space.element_dofs)
    demand(dofs.dtype.kind == "i", f"{name}.element_dofs holds {dofs.dtype}, not integers")
    n_elements, n_local = space.mesh.n_elements, np.shape(space.local_nodes)[0]
    demand(
        dofs.shape == (n_elements, n_local),
        f"{name}.element_dofs has the shape {dofs.shape}, not {n_elements, n_local}",
    )
    demand(np.array_equal(dofs, space.element_dofs), f"{name}.element_dofs gives two answers to one question")
    missing = np.setdiff1d(np.arange(space.n_dofs // 2), dofs)
    demand(missing.size == 0, f"{name}.n_dofs is {space.n_dofs}, but no element has the scalar dofs {missing[:5]}")
    demand(
        int(dofs.min()) >= 0 and 2 * int(dofs.max()) + 2 == space.n_dofs,
        f"{name}.n_dofs is {space.n_dofs}, but element_dofs runs from {dofs.min()} to {dofs.max()}: "
        "it must be twice the number of scalar dofs, which count from 0",
    )
    for column in range(n_local):
        values, counts = np.unique(dofs[:, column], return_counts=True)
        demand(counts.max() == 1, f"{name}.element_dofs repeats dof {values[counts.argmax()]} in its column {column}")
    repeated = np.flatnonzero((np.diff(np.sort(dofs, axis=1), axis=1) == 0).any(axis=1))
    demand(repeated.size == 0, f"{name}.element_dofs repeats a dof in element {repeated[:1]}")


def _check_basis(space: BoundarySpace, name: str, random: np.random.Generator) -> None:
    nodes = np.asarray(space.local_nodes)
    demand(nodes.ndim == 1 and bool((np.abs(nodes) <= 1.0).all()), f"{name}.local_nodes leaves [-1, 1]: {nodes}")
    xi = random.uniform(-1.0, 1.0, 7)
    values = evaluated(f"{name}.basis", space.basis, xi, (nodes.size, xi.size))
    one_by_one = np.column_stack([space.basis(xi[k : k + 1])[:, 0] for k in range(xi.size)])
    _small(one_by_one - values, f"{name}.basis at one point depends on the others: it differs")
    _small(space.basis(nodes) - np.eye(nodes.size), f"{name}.basis at local_nodes is not the identity: it misses")
    _small(values.sum(axis=0) - 1.0, f"{name} does not contain constants: its basis functions miss the sum 1")


def _check_degree(space: BoundarySpace, name: str, random: np.random.Generator) -> None:
    n = space.degree + 1
    xi = np.cos((np.arange(n) + 0.5) * np.pi / n)
    coefficients = np.linalg.solve(np.vander(xi, n, increasing=True), space.basis(xi).T)
    other = random.uniform(-1.0, 1.0, 9)
    misfit = np.vander(other, n, increasing=True) @ coefficients - space.basis(other).T
    _small(misfit, f"{name}.basis does not consist of polynomials of degree {space.degree}: it misses them")
    highest = float(np.abs(coefficients[-1]).max())
    demand(highest > ROUND_OFF, f"{name}.degree is {space.degree}, but no basis function reaches it")


def _check_shared_dofs(space: BoundarySpace, name: str) -> None:
    """Check that a dof shared by several elements is the value at one point."""
    mesh = space.mesh
    places = mesh.points(np.arange(mesh.n_elements), space.local_nodes)
    point = np.empty((space.n_dofs // 2, 2))
    point[space.element_dofs] = places
    distance = np.abs(places - point[space.element_dofs]).max(axis=(1, 2))
    worst = int(np.argmax(distance))
    demand(
        distance[worst] <= ROUND_OFF * (float(np.abs(mesh.nodes).max()) + mesh.diameter),
        f"{name}: a dof of element {worst} is shared with an element where it is the value at another point, "
        f"{distance[worst]:.3g} away",
    )


def _check_continuity(space: BoundarySpace, name: str, random: np.random.Generator) -> None:
    dofs = random.normal(size=space.n_dofs // 2)
    at_ends = dofs[space.element_dofs] @ space.basis(np.array([-1.0, 1.0]))
    incoming, outgoing = space.mesh.node_elements[:, 0], space.mesh.node_elements[:, 1]
    # on a symmetry line an element meets its own image
    jumps = np.where(incoming == outgoing, 0.0, np.abs(at_ends[incoming, 1] - at_ends[outgoing, 0]))
    worst = int(np.argmax(jumps))
    if space.is_continuous:
        demand(
            jumps[worst] <= ROUND_OFF, f"{name} says it is continuous, but jumps by {jumps[worst]:.3g} at node {worst}"
        )
    else:
        demand(jumps[worst] > ROUND_OFF, f"{name} says it is not continuous, but none of its functions jumps")


def _small(error: FloatArray, what: str) -> None:
    worst = float(np.abs(error).max())
    demand(worst <= ROUND_OFF, f"{what} by {worst:.3g}")
