"""Warnings about a certified solution."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.laws import FrictionLaw, LawOfCoefficients
from bemkit.contact.obstacle import Gap, RigidHalfPlane
from bemkit.errors import ResultWarning, counted, first_of_each_kind, format_point
from bemkit.formulas import has_fields
from bemkit.geometry.local_values import values_on_elements
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import lone_elements
from bemkit.geometry.vectors import norms
from bemkit.model.contacts import may_overlap
from bemkit.operators.linear_solvers import Tag
from bemkit.operators.rigid_modes import without_motion
from bemkit.results.between_nodes import BetweenNodes
from bemkit.results.contact_table import ContactTable, facing_away, free_contacts
from bemkit.results.solution import Solution
from bemkit.results.solved_body import SolvedBody
from bemkit.results.solved_scene import place_in
from bemkit.scene.conditions import Clamped, DistributedLoad, PrescribedDisplacement, Roller
from bemkit.scene.unit_names import UnitNames, amount

LARGEST_ERROR = 0.05
"""Estimated relative error above which a solution carries a warning."""
LARGEST_TRACTION_ERROR = 0.2
"""The same for contact tractions, of which single elements in a zone may be wrong by more."""
LARGEST_SHARE_ALONE = 0.2
"""Share of the boundary without an estimate above which the estimate of the whole is unreliable."""
LARGEST_TURN = 50.0
"""Degrees by which the boundary may turn on one element. A ring of quadratic elements of 90 degrees is 35 % off while
the estimate is 3 %; of 45 degrees it is reliable."""
LARGEST_STRAIN = 0.1
"""Strain or rotation [rad] of a share of the boundary above which displacements are not small."""
STRAINED_SHARE = 0.05
"""That share. In theory strains at corners and ends of parts have no bound, but on short lengths only."""
LARGEST_PENETRATION = 0.2
"""Largest penetration between the nodes without a warning, as `BetweenNodes` measures it: that of a cylinder on six
constant elements."""
LARGEST_FREE_PENETRATION = 5e-3
"""The same for a contact without force: the missing force would be about this share of the forces on its bodies."""
LARGEST_DISTANCE_OFF = 0.2
"""Largest difference between distances from an obstacle after the displacement and the solved clearances without a
warning, relative to the displacement by the contact force."""
FEWEST_NODES = 4
"""Least number of contact nodes that resolve a zone, its size and its largest traction."""
_CLOSED = 1e-9
"""Clearance, relative to the largest one, up to which a node counts as closed: round-off of zero."""


def find_warnings(solution: Solution) -> tuple[ResultWarning, ...]:
    """Return the warnings about a solution, first those of its plan; at most three of a kind, then their number."""
    if not solution.is_certified:
        return solution.plan.warnings
    remedy = _remedy(solution)
    laws = solution.laws
    of_all = [_error(solution, remedy)]
    if may_overlap(solution.scene, [body.scene for body in solution.bodies.values()]):
        from bemkit.results.overlaps import overlap_warnings

        of_all.append(overlap_warnings(solution))
    smooth = {name for name, law in laws.items() if law.is_frictionless}
    of_bodies = [_in_body(name, found) for name, body in solution.bodies.items() for found in _of_body(solution, body)]
    found = [
        *of_all,
        _large_of_tractions(solution.estimated_traction_error, remedy),
        *of_bodies,
        _unbounded_tractions(solution),
        _law_jumps(solution.contact, laws),
        _gap_jumps(solution),
        _no_load(solution),
        () if solution.loading is None else solution.loading.warnings(),
        facing_away(solution.contact),
        _narrow_zones(solution.contact, smooth, remedy),
        _hidden_overlaps(solution.contacts_between_nodes, solution.contact, solution.units, remedy),
    ]
    return (*solution.plan.warnings, *first_of_each_kind(chain.from_iterable(found)))


def _of_body(solution: Solution, body: SolvedBody) -> tuple[Iterator[ResultWarning], ...]:
    """Return the kinds of warnings about one body."""
    return (
        _without_estimate(body),
        _turned(body),
        _coarse_curves(body.mesh),
        _large_strains(body),
        _moved_contacts(body, solution.units),
        _load_jumps(body),
    )


def _in_body(name: str, warnings: Iterable[ResultWarning]) -> Iterator[ResultWarning]:
    """Name the body in warnings about it; the single body of a scene has no name."""
    for warning in warnings:
        subject = f"{name} {warning.subject}".strip()
        yield replace(warning, subject=subject, text=f"Body {name!r}: {warning.text}") if name else warning


def _remedy(solution: Solution) -> str:
    """Return the remedy in words; an accuracy needs an error estimate and meshes that may be graded."""
    if solution.stated.mesh.accuracy is not None:
        return "give a smaller accuracy" if solution.is_converged else "allow more elements"
    for body in solution.bodies.values():
        is_periodic = body.mesh.surface is not None and body.mesh.surface.is_periodic
        if is_periodic or not body.scene.discretisation.estimates_error:
            return "use more elements"
    return "use more elements, or give an accuracy"


def _unbounded_tractions(solution: Solution) -> Iterator[ResultWarning]:
    """Warn of singular contact tractions at corners, which the estimated error excludes; once for two bodies."""
    corners: dict[tuple[float, float, tuple[str, ...]], tuple[float, float]] = {}
    for name, body in solution.bodies.items():
        if not body.scene.discretisation.estimates_error:
            continue
        for corner in solution.places.corners[name]:
            key = (corner.x, corner.y, tuple(sorted(filter(None, (name, corner.partner)))))
            length = float(body.mesh.lengths[list(corner.elements)].sum())
            corners[key] = (corner.exponent - 1.0, length + corners.get(key, (0.0, 0.0))[1])
    for (x, y, names), (power, length) in corners.items():
        bodies = " and ".join(map(repr, names))
        is_excluded = (solution.places.singular_points[0] == (x, y)).all(axis=1).any()
        excluded = f"The estimated error of tractions excludes {amount(length, 'length', solution.units, 2)} there."
        prefix = f"{'Bodies' if len(names) > 1 else 'Body'} {bodies}: " if names else ""
        yield ResultWarning(
            "singular contact traction",
            f"{' '.join(names)} ({x:.12g}, {y:.12g})".strip(),
            f"{prefix}Contact tractions are singular at {place_in(solution, (x, y))} (r^{power:.2g}). Use forces "
            f"instead of peak values, or round the corner. {excluded if is_excluded else 'Use more elements.'}",
            power,
        )


def _no_load(solution: Solution) -> Iterator[ResultWarning]:
    """Warn of a single load that moves nothing."""
    bodies = solution.bodies.values()
    if solution.loading is None and not any(body.boundary.displacement.any() for body in bodies):
        yield ResultWarning("no load", "", "Nothing loads or moves the bodies: give a load or a displacement.")


def _large(error: float | None, remedy: str) -> Iterator[ResultWarning]:
    if error is not None and error > LARGEST_ERROR:
        text = f"The estimated error is {100.0 * error:.2g} %: {remedy}."
        yield ResultWarning("large estimated error", "", text, error)


def _large_of_tractions(error: float | None, remedy: str) -> Iterator[ResultWarning]:
    if error is not None and error > LARGEST_TRACTION_ERROR:
        text = f"The estimated error of contact tractions is {100.0 * error:.2g} %: {remedy}."
        yield ResultWarning("large estimated error of tractions", "", text, error)


def _error(solution: Solution, remedy: str) -> Iterator[ResultWarning]:
    """Warn of a large estimated error, and of an error that could not be estimated."""
    if not all(body.scene.discretisation.estimates_error for body in solution.bodies.values()):
        return
    error = solution.estimated_error
    if error is None:
        energy = f"the elastic energy, {amount(solution.energy, 'energy', solution.units, 2)}, is not positive"
        text = f"No error could be estimated, because {energy}: use more elements, or bring body and obstacle together."
        yield ResultWarning("no estimated error", "", text, solution.energy)
    yield from _large(error, remedy)


def _without_estimate(body: SolvedBody) -> Iterator[ResultWarning]:
    """Warn of linear and quadratic elements that have no estimate, because they have no neighbour on their part."""
    discretisation = body.scene.discretisation
    if not discretisation.estimates_error or body.coefficient_errors is not None:
        return  # elements of high degree are judged by themselves
    whole = body.mesh.whole
    is_alone = lone_elements(whole)
    if (share := whole.lengths[is_alone].sum() / whole.lengths.sum()) > LARGEST_SHARE_ALONE:
        yield ResultWarning(
            "single elements",
            "",
            f"{100.0 * share:.0f} % of the boundary consists of pieces with one element, where no error can be "
            "estimated: use more elements.",
            float(share),
        )
    from bemkit.results.error_indicators import blind_elements

    is_blind = blind_elements(body.mesh, discretisation.traction_space(body.mesh).degree)
    for part in body.scene.parts:
        elements = body.mesh.part(part.name)
        if isinstance(part.condition, Clamped | Roller | PrescribedDisplacement) and is_blind[elements].any():
            yield ResultWarning(
                "held part with few elements",
                part.name,
                f"Part {part.name!r} has {counted(elements.size, 'element')}, too few to estimate the error of its "
                "reactions: use more elements there.",
                elements.size,
            )


def _turned(body: SolvedBody) -> Iterator[ResultWarning]:
    """Warn of a rotation that exceeds the strain of constant elements, whose steps confuse both."""
    if Tag.KILLS_TRANSLATIONS not in body.map_tags:
        return
    mesh = body.mesh
    points, displacement = body.boundary.points, body.boundary.displacement
    strained = without_motion(mesh, points, displacement)
    motion = displacement - strained
    turn = np.hypot(*(motion - motion.mean(axis=0)).T).max() / np.hypot(*(points - points.mean(axis=0)).T).max()
    if turn * mesh.lengths.max() > np.abs(strained).max():
        yield ResultWarning(
            "rotation taken for strain",
            "",
            f"The body rotates by {turn:.2g}, which moves the ends of constant elements without slopes by more than "
            "the strain, and would be mistaken for strain: use slopes, or linear elements.",
            float(turn),
        )


def _large_strains(body: SolvedBody) -> Iterator[ResultWarning]:
    """Warn of strains or rotations that are not small."""
    gradients, lengths = boundary_gradients(body)
    largest_first = np.argsort(gradients)[::-1]
    share = np.cumsum(lengths[largest_first]) / lengths.sum()
    strain = gradients[largest_first[np.searchsorted(share, STRAINED_SHARE)]]
    if strain > LARGEST_STRAIN:
        yield ResultWarning(
            "large strain",
            "",
            f"Strains and rotations exceed {strain:.2g} on {100.0 * STRAINED_SHARE:.0f} % of the boundary, outside "
            "the theory of small displacements: check the units of loads "
            "and of Young's modulus, or load less.",
            float(strain),
        )


def _moved_contacts(body: SolvedBody, units: UnitNames | None) -> Iterator[ResultWarning]:
    """Warn of bodies that move so far along obstacles that their gaps change."""
    if all(isinstance(obstacle, RigidHalfPlane) for obstacle in body.scene.obstacles.values()):
        return  # the distance from a plane is linear in the displacement
    from bemkit.results.moved_contacts import distances_off

    for name, (off, length) in distances_off(body).items():
        if off > LARGEST_DISTANCE_OFF * length:
            distance = amount(off, "length", units, 2)
            share = f"{100.0 * off / length:.0f} % of" if off < length else "more than"
            yield ResultWarning(
                "moved contact",
                name,
                f"Part {name!r} moves so far that its contact ends {distance} off the obstacle, {share} the "
                "displacement by its contact force: gaps and normals are those of the undeformed body. "
                "Model the body in its final position.",
                off,
            )


def boundary_gradients(body: SolvedBody) -> tuple[FloatArray, FloatArray]:
    """Return sizes (n,) of the derivative of the displacement along the boundary, and lengths (n,) [m] of its pieces.

    They are means over elements, of constant elements differences between neighbours; strain and rotation are their
    components.
    """
    mesh, displacement = body.mesh, body.boundary.displacement
    space = body.scene.discretisation.displacement_space(mesh)
    if space.degree > 0:
        at_ends = np.einsum("pq,epc->eqc", space.basis(np.array([-1.0, 1.0])), values_on_elements(space, displacement))
        return norms(at_ends[:, 1] - at_ends[:, 0]) / mesh.lengths, mesh.lengths
    before, after = mesh.node_elements[(mesh.node_elements >= 0).all(axis=1)].T
    lengths = 0.5 * (mesh.lengths[before] + mesh.lengths[after])
    return norms(displacement[after] - displacement[before]) / lengths, lengths


def _coarse_curves(mesh: BoundaryMesh) -> Iterator[ResultWarning]:
    """Warn of elements that go around a large part of a circle: their error is not yet that of short elements."""
    curved = np.flatnonzero(~mesh.is_straight)
    if not curved.size:
        return
    before, middle, after = np.moveaxis(mesh.normals_at(curved, np.array([-1.0, 0.0, 1.0])), 1, 0)
    cosines = np.stack([np.sum(before * middle, axis=1), np.sum(middle * after, axis=1)])
    turn = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))).sum(axis=0)
    if turn.max() > LARGEST_TURN:
        place = format_point(mesh.centres[curved[turn.argmax()]], mesh.diameter, digits=4)
        text = (
            f"The boundary turns by {turn.max():.0f} degrees on one element, near {place}; no error estimate holds "
            "there: use more elements."
        )
        yield ResultWarning("coarse curve", "", text, float(turn.max()))


def _narrow_zones(contact: ContactTable, smooth: Collection[str], remedy: str) -> Iterator[ResultWarning]:
    """Warn of zones of contact or separation, with friction also of stick or slip, that have few nodes.

    A contact-free state has no zones, only round-off.
    """
    if not (contact.sigma_n.any() or contact.sigma_t.any()):
        return
    wrapped, (contact, _) = contact.wrapped, contact.unrolled
    words = np.array(contact.status_words(), dtype=object)
    # friction that acts across a gap sticks or slips without contact
    clearance = np.where(np.isfinite(contact.clearance), contact.clearance, 0.0)
    is_apart = (contact.sigma_n >= 0.0) & (clearance > _CLOSED * np.abs(clearance).max(initial=0.0))
    is_closed = (words != "separated") & ~is_apart
    is_word = {word: words == word for word in ("stick", "slip")}
    for part in contact.parts:
        is_of_part = contact.rows(part)
        kinds = {"contact": is_of_part & is_closed, "separated": _enclosed(contact, is_of_part & ~is_closed)}
        if part not in smooth:
            kinds |= {word: is_of_part & chosen for word, chosen in is_word.items()}
        reported = np.zeros(is_of_part.size, bool)
        for kind, chosen in kinds.items():
            narrow = [zone for zone in contact.runs(chosen) if zone.size < FEWEST_NODES]
            narrow = [zone for zone in narrow if not reported[zone].all()]
            if narrow:
                reported[np.concatenate(narrow)] = True
                middle = wrapped(part, float(contact.s[narrow[0]].mean()))
                yield _narrow(part, kind, middle, [zone.size for zone in narrow], remedy)


def _hidden_overlaps(
    contacts: Mapping[str, BetweenNodes], table: ContactTable, units: UnitNames | None, remedy: str
) -> Iterator[ResultWarning]:
    """Warn of contacts whose sides overlap between the nodes, relative to the displacement by contact forces."""
    is_pressed = bool(table.sigma_n.any() or table.sigma_t.any())
    length = (
        "the displacement that contact forces cause" if is_pressed else "how far bodies move, without contact forces"
    )
    free = free_contacts(table)
    for name, between in contacts.items():
        if between.penetration > (LARGEST_FREE_PENETRATION if name in free else LARGEST_PENETRATION):
            depth = amount(between.penetration_depth, "length", units, 2)
            share = f"{100.0 * between.penetration:.2g} % of" if between.penetration < 1.0 else "more than"
            yield ResultWarning(
                "overlap between nodes",
                name,
                f"Contact {name!r}: the sides overlap by {depth} between the nodes ({share} {length}): "
                f"{_there(remedy)}.",
                between.penetration_depth,
            )
        elif between.complementarity > LARGEST_PENETRATION:
            yield ResultWarning(
                "gap between nodes",
                name,
                f"Contact {name!r}: the sides are apart between nodes that press each other "
                f"({100.0 * between.complementarity:.0f} % of {length}): {_there(remedy)}.",
                between.complementarity,
            )


def _enclosed(contact: ContactTable, chosen: BoolArray) -> BoolArray:
    """Return the chosen nodes (n_contact,) in runs that have other nodes on both sides."""
    joined = np.concatenate([[False], contact.is_joined, [False]])
    is_enclosed = np.zeros(chosen.size, bool)
    for zone in contact.runs(chosen):
        is_enclosed[zone] = joined[zone[0]] and joined[zone[-1] + 1]
    return is_enclosed


def _narrow(part: str, kind: str, middle: float, sizes: Sequence[int], remedy: str) -> ResultWarning:
    more = f", and {counted(len(sizes) - 1, 'more zone')} like it" if len(sizes) > 1 else ""
    nodes = counted(sizes[0], "node")
    text = f"A {kind} zone of part {part!r} at s = {middle:.4g} has only {nodes}{more}: {_there(remedy)}."
    return ResultWarning(f"narrow {kind} zone", part, text, sizes[0])


def _there(remedy: str) -> str:
    return remedy.replace("more elements", "more elements there")


def _law_jumps(contact: ContactTable, laws: Mapping[str, FrictionLaw]) -> Iterator[ResultWarning]:
    """Warn of jumps of friction bounds that vary in space; with a history or numbers at nodes they are not examined."""
    if not (varying := {name: law for name, law in laws.items() if _varies(law)}):
        return
    from bemkit.results.jumps import law_jumps

    yield from law_jumps(contact, varying)


def _load_jumps(body: SolvedBody) -> Iterator[ResultWarning]:
    """Warn of jumps of loads, given displacements and gaps that are formulas or functions."""
    given = (*body.scene.obstacles.values(), *(part.condition for part in body.scene.parts))
    if any(has_fields(each) for each in given if isinstance(each, Gap | DistributedLoad | PrescribedDisplacement)):
        from bemkit.results.jumps import load_jumps

        yield from load_jumps(body)


def _gap_jumps(solution: Solution) -> Iterator[ResultWarning]:
    if any(callable(pair.gap) for pair in solution.scene.contacts):
        from bemkit.results.jumps import gap_jumps

        yield from gap_jumps(solution)


def _varies(law: FrictionLaw) -> bool:
    """Whether a law has formulas or functions of the coordinates, and otherwise only numbers."""
    if not isinstance(law, LawOfCoefficients) or law.needs_history:
        return False
    values = law.coefficients.values()
    return any(map(callable, values)) and not any(isinstance(value, np.ndarray) for value in values)
