"""Warnings of bodies and obstacles that overlap in their displaced positions, beside the contacts between them."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import permutations
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.obstacle import Obstacle
from bemkit.errors import ResultWarning
from bemkit.geometry.proximity.overlap import ROUND_OFF, Polyline, deepest_overlap, near_pairs
from bemkit.geometry.vectors import norms
from bemkit.model.overlaps import finite_obstacles, is_finite
from bemkit.results.points_between import Interpolation
from bemkit.results.solved_body import SolvedBody
from bemkit.results.solved_scene import place_in
from bemkit.scene.unit_names import amount

if TYPE_CHECKING:
    from bemkit.results.solution import Solution
    from bemkit.scene.contacts import ContactPair

LEAST_OVERLAP = 0.1
"""Depth that may be the error of small displacements beside a contact zone, relative to the largest displacement of
both bodies."""


def overlap_warnings(solution: Solution) -> Iterator[ResultWarning]:
    """Warn of two bodies, or of a body and an obstacle of finite size, that overlap beside the contacts between them.

    Points of sides in contact are measured by `BetweenNodes`, others here: at the displaced points of the boundaries.
    """
    bodies = {name: body for name, body in solution.bodies.items() if body.mesh.surface is None}
    outlines = {name: _displaced(body) for name, body in bodies.items()}
    yield from _of_bodies(solution, outlines)
    yield from _of_fixed_obstacles(solution, outlines)
    for name, outline in outlines.items():
        yield from _of_rigid_bodies(solution, name, outline)


def _of_bodies(solution: Solution, outlines: dict[str, Polyline]) -> Iterator[ResultWarning]:
    names, lines = list(outlines), list(outlines.values())
    parts, listed = _parts_in_contact(solution), _contacts_of_bodies(solution)
    for k, m in near_pairs(lines):
        one, two = names[k], names[m]
        beside = [
            _is_beside(solution, own, parts.get((own, other), ()))[outline.elements]
            for own, other, outline in ((one, two, lines[k]), (two, one, lines[m]))
        ]
        pairs = listed.get(frozenset((one, two)), ())
        least = lines[k].tolerance + lines[m].tolerance + _least_overlap(solution, (one, two), pairs)
        depth, place = deepest_overlap(lines[k], lines[m], least, beside)
        if depth > 0.0:
            yield _between(solution, f"Bodies {one!r} and {two!r}", f"{one} / {two}", depth, place)


def _of_fixed_obstacles(solution: Solution, outlines: dict[str, Polyline]) -> Iterator[ResultWarning]:
    for obstacle, touching in finite_obstacles({name: solution.bodies[name].scene for name in outlines}):
        owner, (part, *_) = next(iter(touching.items()))
        for name, outline in outlines.items():
            parts = touching.get(name, [])
            points = _points_beside(solution, name, parts, outline)
            depth, place = _deepest(obstacle, points, points)
            if depth > outline.tolerance + _least_overlap(solution, (name,)):
                whose, where = f"{part!r} of body {owner!r}", f"body {name!r}"
                at, remedy = _depth_at(solution, depth, place), "let a part of it touch it, too"
                if parts:
                    whose, where = f"{parts[0]!r}", where if name else "the body"
                    at, remedy = f"{at}, beside this part", "let the part include all that may touch it"
                text = f"The obstacle of part {whose} overlaps {where} by {at}: {remedy}."
                yield ResultWarning("overlap beside contacts", f"{name} {(parts or [part])[0]}".strip(), text, depth)


def _of_rigid_bodies(solution: Solution, name: str, outline: Polyline) -> Iterator[ResultWarning]:
    for rigid in solution.scene.rigid:
        if not is_finite(rigid.obstacle):
            continue
        pairs = [pair for pair in solution.scene.contacts if pair.rigid_body == rigid.name]
        parts = [part for pair in pairs for body, part in pair.elastic_parts if body == name]
        points, motion = _points_beside(solution, name, parts, outline), solution.rigid[rigid.name]
        moved = rigid.motions_at(points) @ np.array([motion.x, motion.y, motion.turn])
        depth, place = _deepest(rigid.obstacle, points - moved, points)
        if depth > outline.tolerance + _least_overlap(solution, (name,), pairs):
            pair = f"Body {name!r} and rigid body {rigid.name!r}"
            yield _between(solution, pair, f"{name} / {rigid.name}", depth, place)


def _between(solution: Solution, pair: str, subject: str, depth: float, place: FloatArray) -> ResultWarning:
    text = f"{pair} overlap by {_depth_at(solution, depth, place)}, beside the contacts between them: "
    remedy = "state a contact there, or move them apart."
    return ResultWarning("overlap beside contacts", subject, text + remedy, depth)


def _depth_at(solution: Solution, depth: float, place: FloatArray) -> str:
    return f"{amount(depth, 'length', solution.units, 2)} at {place_in(solution, place)}"


def _deepest(obstacle: Obstacle, points: FloatArray, places: FloatArray) -> tuple[float, FloatArray]:
    """Return the largest depth [m] of points (n, 2) in an obstacle, at most zero outside, and the place (2,) of it."""
    if not len(points):
        return 0.0, np.full(2, np.nan)
    gap = obstacle.gap(points, points)
    return -float(gap.min()), places[int(gap.argmin())]


def _least_overlap(solution: Solution, names: Collection[str], pairs: Collection[ContactPair] = ()) -> float:
    """Return the depth [m] that may be round-off, the error of small displacements, or a gap that contacts add."""
    bodies, table = [solution.bodies[name] for name in names], solution.contact
    moved = max(float(norms(body.boundary.displacement).max()) for body in bodies)
    gaps = (pair.gap_at(table.points[table.rows(pair.name)]).max(initial=0.0) for pair in pairs)
    added = max(map(float, gaps), default=0.0)
    return ROUND_OFF * min(body.mesh.diameter for body in bodies) + LEAST_OVERLAP * moved + added


def _displaced(body: SolvedBody) -> Polyline:
    """Return the polyline of a body in its displaced position."""
    mesh, xi = body.mesh, Polyline.places()
    elements = np.arange(mesh.n_elements)
    at = np.broadcast_to(xi, (elements.size, xi.size))
    return Polyline.of(mesh, Interpolation.at(body, elements, at).displacement(body))


def _points_beside(solution: Solution, name: str, parts: Collection[str], outline: Polyline) -> FloatArray:
    """Return the points (n, 2) [m] of the polyline of a body beside some parts."""
    return outline.points[_is_beside(solution, name, parts)[outline.elements]].reshape(-1, 2)


def _is_beside(solution: Solution, name: str, parts: Collection[str]) -> BoolArray:
    """Return (n_elements,) bool: the elements of a body that are in none of some parts."""
    mesh = solution.bodies[name].mesh
    is_beside = np.ones(mesh.n_elements, bool)
    for part in parts:
        is_beside[mesh.part(part)] = False
    return is_beside


def _parts_in_contact(solution: Solution) -> dict[tuple[str, str], set[str]]:
    """Return the parts of a body that are in contact with another elastic body, by the names of both."""
    parts: dict[tuple[str, str], set[str]] = {}
    for sides in solution.contact_sides.values():
        for own, other in permutations(sides, 2):
            parts.setdefault((own.body, other.body), set()).add(own.part)
    return parts


def _contacts_of_bodies(solution: Solution) -> dict[frozenset[str], list[ContactPair]]:
    """Return the contacts between two elastic bodies, by the names of both."""
    pairs: dict[frozenset[str], list[ContactPair]] = {}
    for pair in solution.scene.elastic_contacts:
        pairs.setdefault(frozenset(body for body, _ in pair.elastic_parts), []).append(pair)
    return pairs
