"""Estimated errors of a Galerkin solution, from the solution itself.

The exact solution has continuous strains along the boundary wherever tractions are continuous, and smooth tractions
between corners and ends of boundary parts. Strains of the computed displacements jump from element to element, and
computed tractions are constant or linear on each. The sizes of these jumps and steps estimate the error of an element.
Where displacements are given, as on clamped sides, all of the error is in the tractions.

The estimate is one of displacements u_h and tractions t_h together, in the norm in which the Galerkin method is stable,
<W (u - u_h), u - u_h> + <V (t - t_h), t - t_h>. If t_h is the exact traction of u_h, that is a(u - u_h, u - u_h), twice
the elastic energy of the difference.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.geometry.local_values import values_on_elements
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import break_nodes, lone_elements
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, dof_points
from bemkit.geometry.symmetry.images import reflected_to_whole
from bemkit.operators.rigid_modes import without_motion
from bemkit.results.contact_table import ContactTable

STRAIN_CALIBRATION = (1.0 / 64.0, 1.0 / 128.0)
"""Factors between jumps of strains and squared errors, for degrees 1 and 2. All factors of linear and quadratic
elements are such that on the scenes of ``python -m checks.calibration`` the estimates lie around the errors."""
TRACTION_CALIBRATION = (1.0 / 100.0, 1.0 / 600.0)
"""The same for steps of constant tractions and bends of linear ones. On a line <V t, t> is E' |t|^2 / (1.1 |k|) at the
wave number k, of saw teeth h^3 |step|^2 / 115 for each element and of parabolas h^3 |bend|^2 / 5000; displacements that
are wrong nearby leave more."""
CONTACT_CALIBRATION = (1.0 / 8.0, 1.0 / 16.0)
"""Factors between second differences of nodal contact tractions and their squared errors."""
PAIR_CALIBRATION = (1.0, 1.75)
"""Further factors between two elastic bodies, where tractions follow the elements of both sides."""
STIFFNESS_CALIBRATION = (1.0, 0.15)
"""Factors between squared relative errors in the energy norm and relative errors of contact tractions, for degree 1 and
for higher ones."""
LARGEST_STIFFNESS_SHARE = 1.0 / 3.0
"""Largest error of contact tractions that errors in the energy norm cause, relative to these."""
MEAN_CALIBRATION = 1.25
"""Factor of the mean error of constant tractions on a half-plane. Without it estimates of cylinders, wedges and punches
on uniform, graded and adaptive meshes are 0.85 to 1.6 times the error."""
LOCAL_CALIBRATION = 1.6
"""Further factor for the errors of single elements, which are up to that much larger."""
STEEPEST = 6.0
"""Largest ratio of successive steps towards a corner, as for tractions like d**-0.5 on equal elements."""


def squared_errors(
    mesh: BoundaryMesh,
    make_space: Callable[[BoundaryMesh], BoundarySpace],
    displacement: FloatArray,
    traction: FloatArray,
    plane_modulus: float,
) -> FloatArray:
    """Estimate the squared error of each element in the energy norm.

    Parameters
    ----------
    mesh : BoundaryMesh
    make_space : callable
        Gives the space of the displacements on a mesh, continuous and of degree 1 or 2; tractions have a degree less.
    displacement : (n_scalar, 2) array [m]
    traction : (n_elements, 2) array [Pa]
        Means of the elements.
    plane_modulus : float [Pa]
        E'.

    Returns
    -------
    (n_elements,) array [J/m]
        With those of the images that a symmetry adds they add up to the estimate of a(u - u_h, u - u_h).
    """
    half, whole = make_space(mesh), make_space(mesh.whole)
    moved = reflected_to_whole(half, whole, displacement)
    loaded = reflected_to_whole(ConstantSpace(mesh), ConstantSpace(mesh.whole), traction)
    errors = element_errors(whole, moved, plane_modulus)
    errors += traction_errors(mesh.whole, loaded, whole.degree - 1, plane_modulus)
    return errors[: mesh.n_elements]


def element_errors(space: BoundarySpace, displacement: FloatArray, plane_modulus: float) -> FloatArray:
    """Estimate the squared error of each element in the energy norm from jumps of strains.

    Parameters
    ----------
    space : BoundarySpace
        Continuous displacements of degree 1 or 2.
    displacement : (n_scalar, 2) array [m]
    plane_modulus : float [Pa]
        E'.

    Returns
    -------
    (n_elements,) array [J/m]

    Notes
    -----
    At a node between elements of lengths a and b whose strains du/ds differ by j the estimate is E' h^2 |j|^2 / 64, on
    quadratic elements / 128, h = 2 a b / (a + b), half of it for either element. Corners and ends of boundary parts
    are excluded: there strains may jump. The rigid motion of the body is removed first, since curved elements only
    interpolate it.
    """
    mesh = space.mesh
    before, after = mesh.node_elements.T
    at_start, at_end = _end_slopes(space, without_motion(mesh, dof_points(space), displacement))
    jump = np.sum((at_start[after] - at_end[before]) ** 2, axis=1)
    jump[break_nodes(mesh)] = 0.0
    at_nodes = 0.5 * STRAIN_CALIBRATION[space.degree - 1] * plane_modulus * _node_lengths(mesh) ** 2 * jump
    errors: FloatArray = at_nodes[mesh.elements].sum(axis=1)
    return errors


def traction_errors(mesh: BoundaryMesh, traction: FloatArray, degree: int, plane_modulus: float) -> FloatArray:
    """Estimate the squared error of each element in the energy norm that shows in the tractions.

    Parameters
    ----------
    mesh : BoundaryMesh
    traction : (n_elements, 2) array [Pa]
        Means of the elements.
    degree : int
        Of the tractions on an element: 0 or 1.
    plane_modulus : float [Pa]
        E'.

    Returns
    -------
    (n_elements,) array [J/m]

    Notes
    -----
    Constant tractions that step by j from an element to the next one have the error h^2 |j|^2 / (100 E'), linear ones
    whose means bend by d, the second difference, h^2 |d|^2 / (600 E'). Towards corners and ends of boundary parts,
    where tractions may be singular, steps and bends are continued as a geometric sequence into the last element.
    """
    if degree == 0:
        steps = _jumps(mesh, traction)
        at_nodes = 0.5 * (_node_lengths(mesh) * np.nan_to_num(steps)) ** 2
        inside, last = at_nodes[mesh.elements].sum(axis=1), _extrapolated_to_ends(mesh, steps, of_nodes=True)
    else:
        bends = _second_differences(mesh, traction)
        inside, last = (mesh.lengths * np.nan_to_num(bends)) ** 2, _extrapolated_to_ends(mesh, bends, of_nodes=False)
    return np.asarray(TRACTION_CALIBRATION[degree] / plane_modulus * (inside + (mesh.lengths * last) ** 2))


def contact_errors(contact: ContactTable, degree: int) -> FloatArray:
    """Estimate the squared L2 error of the contact tractions that linear and quadratic elements find at their nodes.

    Parameters
    ----------
    contact : ContactTable
    degree : int
        Of the displacements: 1 or 2.

    Returns
    -------
    (n_contact,) array [Pa^2 m]
        From the second difference d of the tractions at a node and its two neighbours, which are h apart:
        h |d|^2 / 8 for degree 1, / 16 for degree 2; zero at ends of parts.
    """
    errors = np.zeros(contact.n_contact)
    contact, order = contact.unrolled
    for part in contact.parts:
        rows = np.flatnonzero(contact.rows(part))
        tractions = np.stack([contact.sigma_n[rows], contact.sigma_t[rows]], axis=1)
        steps = np.diff(contact.s[rows])
        means = 0.5 * (steps[1:] + steps[:-1])
        slopes = np.diff(tractions, axis=0) / np.where(steps > 0.0, steps, np.inf)[:, None]  # 0: between two sides
        bends = np.diff(slopes, axis=0) * means[:, None]
        errors[order[rows[1:-1]]] = CONTACT_CALIBRATION[degree - 1] * means * np.sum(bends**2, axis=1)
    return errors


def stiffness_error(energy_error: float, degree: int) -> float:
    """Estimate the relative error of contact tractions that errors in the energy norm anywhere on the bodies cause.

    Bodies that are moved by given amounts are too stiff by the square of the relative error, and so are their
    reactions; under given loads they are right. Large errors are not of that order yet.
    """
    return min(STIFFNESS_CALIBRATION[min(degree, 2) - 1] * energy_error**2, LARGEST_STIFFNESS_SHARE * energy_error)


def nodal_error(contact: ContactTable, degree: int, n_sides: Callable[[str], int], share: FloatArray) -> float | None:
    """Return the squared L2 error [Pa^2 m] of contact tractions by `contact_errors`.

    Parameters
    ----------
    contact : ContactTable
    degree : int
        Of the displacements, the lowest of all bodies.
    n_sides : callable
        Name of a contact -> how many elastic bodies carry its tractions.
    share : (n_contact,) array
        Of the squared error at each node: zero where tractions have no bound.

    Returns
    -------
    float or None
        Fewer than three nodes have no second difference: the whole tractions of such a contact count as their error.
        None if all contacts are such.
    """
    errors, squared, has_estimate = contact_errors(contact, degree), 0.0, False
    errors *= share
    sizes = contact.weight * (contact.sigma_n**2 + contact.sigma_t**2)
    for part in contact.parts:
        rows, sides = contact.rows(part), n_sides(part)
        if np.count_nonzero(rows) < 3:
            squared += sides * float(sizes[rows].sum())
            continue
        has_estimate = True
        factor = PAIR_CALIBRATION[degree - 1] if sides == 2 else 1.0
        squared += sides * factor * float(errors[rows].sum())
    return squared if has_estimate else None


def continuation_error(s: FloatArray, tractions: FloatArray, degree: int) -> float:
    """Estimate the squared L2 error [Pa^2 m] of tractions that go on to a node that a support holds.

    Parameters
    ----------
    s : (n,) array [m]
        Distances of the nodes from that node.
    tractions : (n, 2) array [Pa]
        At these nodes, the nearest first.
    degree : int
        Of the displacements, at least 1.

    Notes
    -----
    Linear elements go on with the traction of their other node, quadratic ones with a line. The next difference, d at
    the held node, is missing: h d^2 / 3 with the distance h of the nearest node. Zero if there are too few nodes.
    Higher degrees count as quadratic.
    """
    degree = min(degree, 2)
    if s.size <= degree:
        return 0.0
    steps = np.diff(s[: degree + 1])
    slopes = np.diff(tractions[: degree + 1], axis=0) / np.where(steps > 0.0, steps, np.inf)[:, None]  # 0 at a corner
    difference = s[0] * slopes[0]
    if degree == 2:
        difference = s[0] * s[1] / (s[2] - s[0]) * (slopes[1] - slopes[0])
    return max(float(s[0]), 0.0) * float(difference @ difference) / 3.0


def mean_traction_errors(mesh: BoundaryMesh, traction: FloatArray) -> FloatArray:
    """Estimate how far constant tractions on the surface of a half-plane are from the exact ones at element centres.

    Parameters
    ----------
    mesh : BoundaryMesh
    traction : (n_elements, 2) array [Pa]

    Returns
    -------
    (n_elements,) array [N/m]
        The size of the error, integrated over each element.

    Notes
    -----
    The error of an element for a traction with the slope t' is a saw tooth of the moment m = h^2 t' / 12 for each
    length. It displaces the surface as the tractions -m' do, which are therefore in the solution: on smooth meshes
    the second order, more where lengths jump. To the jumps of m, half of one for either element, comes the
    difference between the mean of an element and its centre, a 24th of the second difference. Where tractions are
    infinite, at ends of parts, nothing is added.
    """
    lengths, is_break = mesh.lengths, break_nodes(mesh)
    before, after = mesh.node_elements.T
    distance = 0.5 * (lengths[before] + lengths[after])
    slopes = np.where(is_break[:, None], 0.0, (traction[after] - traction[before]) / distance[:, None])
    n_slopes = np.maximum((~is_break)[mesh.elements].sum(axis=1), 1)
    moments = (lengths**2 / 12.0 / n_slopes)[:, None] * slopes[mesh.elements].sum(axis=1)
    jumps = np.where(is_break, 0.0, np.linalg.norm(moments[after] - moments[before], axis=1))
    at_centres = lengths * np.nan_to_num(_second_differences(mesh, traction)) / 24.0
    return np.asarray(MEAN_CALIBRATION * (0.5 * jumps[mesh.elements].sum(axis=1) + at_centres))


def ky_fan_distance(errors: FloatArray, lengths: FloatArray) -> float:
    """Return the smallest number d such that errors exceed d only on the share d of the length.

    Parameters
    ----------
    errors : (n_elements,) array [-]
    lengths : (n_elements,) array [m]

    Notes
    -----
    This is Ky Fan's distance from zero: a large error on a short length counts only by that length.
    """
    order = np.argsort(-errors)
    worse = np.cumsum(np.append(0.0, lengths[order])) / max(float(lengths[errors > 0.0].sum()), 1e-300)
    return float(np.maximum(np.append(errors[order], 0.0), worse).min())


def blind_elements(mesh: BoundaryMesh, degree: int) -> BoolArray:
    """Return which elements have too few neighbours on their piece of the boundary to estimate the error of tractions.

    Parameters
    ----------
    mesh : BoundaryMesh
    degree : int
        Of the tractions on an element: 0 or 1.

    Returns
    -------
    (n_elements,) bool array
        Between corners and ends of parts there must be two elements for a step, three for a bend.
    """
    whole = mesh.whole
    if degree == 0:
        is_blind = lone_elements(whole)
    else:
        ones = 1.0 + _second_differences(whole, np.zeros((whole.n_elements, 2)))
        is_blind = np.isnan(ones) & (_extrapolated_to_ends(whole, ones, of_nodes=False) == 0.0)
    return is_blind[: mesh.n_elements]


def _node_lengths(mesh: BoundaryMesh) -> FloatArray:
    """Return the harmonic mean (n_nodes,) of the lengths of the two elements that meet at each node."""
    before, after = mesh.node_elements.T
    lengths: FloatArray = 2.0 / (1.0 / mesh.lengths[before] + 1.0 / mesh.lengths[after])
    return lengths


def _jumps(mesh: BoundaryMesh, traction: FloatArray) -> FloatArray:
    """Return the sizes (n_nodes,) of the steps from element to element; NaN at corners and ends of parts."""
    before, after = mesh.node_elements.T
    steps = np.linalg.norm(traction[after] - traction[before], axis=1)
    return np.where(break_nodes(mesh), np.nan, steps)


def _second_differences(mesh: BoundaryMesh, traction: FloatArray) -> FloatArray:
    """Return the second differences (n_elements,) at each element; NaN at corners and ends of parts."""
    before, after = mesh.node_elements.T
    distance = 0.5 * (mesh.lengths[before] + mesh.lengths[after])
    slope = (traction[after] - traction[before]) / distance[:, None]
    start, end = mesh.elements.T
    curvature = np.linalg.norm(slope[end] - slope[start], axis=1) / (0.5 * (distance[start] + distance[end]))
    is_break = break_nodes(mesh)
    return np.where(is_break[start] | is_break[end], np.nan, mesh.lengths**2 * curvature)


def _extrapolated_to_ends(mesh: BoundaryMesh, sizes: FloatArray, *, of_nodes: bool) -> FloatArray:
    """Continue sizes of nodes or of elements into the last elements before corners and ends of parts; else zero."""
    squares = np.zeros(mesh.n_elements)
    is_break = break_nodes(mesh)
    for near, far in ((0, 1), (1, 0)):  # pieces begin there, and end there
        last = np.flatnonzero(is_break[mesh.elements[:, near]])
        node = mesh.elements[last, far]
        neighbour = mesh.node_elements[node, far]
        next_node = mesh.elements[neighbour, far]
        places = (node, next_node) if of_nodes else (neighbour, mesh.node_elements[next_node, far])
        squares[last] += _extrapolated(*(sizes[place] for place in places)) ** 2
    return np.sqrt(squares)


def _extrapolated(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the size before two sizes of a geometric sequence; the first again if the second is NaN."""
    divisor = np.fmax(second, first / STEEPEST)
    return np.nan_to_num(np.divide(first**2, divisor, out=np.zeros_like(first), where=divisor > 0.0))


def _end_slopes(space: BoundarySpace, displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return du/ds (n_elements, 2) at the start and at the end of each element."""
    mesh = space.mesh
    ends = np.array([-1.0, 1.0])
    slopes = np.einsum("pq,epc->eqc", _derivative(space, ends), values_on_elements(space, displacement))
    slopes /= mesh.jacobian(np.arange(mesh.n_elements), ends)[:, :, None]
    return slopes[:, 0], slopes[:, 1]


def _derivative(space: BoundarySpace, xi: FloatArray) -> FloatArray:
    """Differentiate the local basis: (n_local, n_points); central differences are exact up to degree 2."""
    return 0.5 * (space.basis(xi + 1.0) - space.basis(xi - 1.0))
