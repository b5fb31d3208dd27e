"""Bodies that overlap before anything is solved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.obstacle import Obstacle, RigidCircle
from bemkit.contact.polygon import RigidPolygon
from bemkit.errors import format_point
from bemkit.geometry.proximity.overlap import ROUND_OFF, Polyline, deepest_overlap, near_pairs
from bemkit.model.contacts import OverlapError
from bemkit.model.placed import PlacedBody
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.scene import Scene


def check_apart(scene: Scene, bodies: Sequence[PlacedBody]) -> None:
    """Check that no two bodies overlap by more than the interference of the contacts between them.

    Elastic bodies but for half-planes are compared with each other, with rigid bodies and, beside the parts that touch
    them, with fixed obstacles of any body, both of finite size.

    Raises
    ------
    OverlapError
        With the names of both, the depth and the place.
    """
    finite = [body for body in bodies if body.mesh.surface is None]
    outlines = [Polyline.of(body.mesh) for body in finite]
    for k, m in near_pairs(outlines):
        names = finite[k].name, finite[m].name
        size = min(finite[k].mesh.diameter, finite[m].mesh.diameter)
        least = outlines[k].tolerance + outlines[m].tolerance + ROUND_OFF * size
        depth, place = deepest_overlap(outlines[k], outlines[m], least + _interference(scene, names))
        if depth > 0.0:
            raise _overlap(names, depth, place, size)
    for rigid in scene.rigid:
        if is_finite(rigid.obstacle):
            for body, outline in zip(finite, outlines, strict=True):
                points = outline.points.reshape(-1, 2)
                gap = rigid.obstacle.gap(points, points)
                k, names = int(gap.argmin()), (body.name, rigid.name)
                if -gap[k] > ROUND_OFF * body.mesh.diameter + _interference(scene, names):
                    raise _overlap(names, -float(gap[k]), points[k], body.mesh.diameter)
    for obstacle, touching in finite_obstacles({body.name: body.scene for body in finite}):
        for body, outline in zip(finite, outlines, strict=True):
            _check_obstacle(obstacle, touching, body, outline)


def _check_obstacle(
    obstacle: Obstacle, touching: Mapping[str, Sequence[str]], body: PlacedBody, line: Polyline
) -> None:
    """Check that a fixed obstacle overlaps a body nowhere deeper than on the parts that touch it."""
    points, parts = line.points.reshape(-1, 2), touching.get(body.name, [])
    gap = obstacle.gap(points, points)
    if gap.min() >= -ROUND_OFF * body.mesh.diameter:
        return  # as almost everywhere
    elements = np.concatenate([np.zeros(0, np.intp), *(body.mesh.part(part) for part in parts)])
    touches = np.repeat(np.isin(line.elements, elements), line.points.shape[1])
    beside = np.where(touches, np.inf, gap)
    depth, stated = -float(beside.min()), -float(gap[touches].min(initial=0.0))
    if depth > stated + ROUND_OFF * body.mesh.diameter:
        owner, (first, *_) = next(iter(touching.items()))
        place = format_point(points[int(beside.argmin())], body.mesh.diameter, digits=6)
        whose, where = f"{first!r} of body {owner!r}", f"body {body.name!r} by {depth:.4g}"
        remedy = "let a part of it touch it, too"
        if parts:
            whose, where = f"{parts[0]!r}", f"the body by {depth:.4g} beside this part"
            remedy = "let the part include all that may touch it"
        raise OverlapError(f"the obstacle of part {whose} overlaps {where}, at {place}: move it away, or {remedy}")


def is_finite(obstacle: Obstacle) -> bool:
    """Whether an obstacle is of finite size, and its distance is known on all sides of it."""
    return isinstance(obstacle, RigidCircle | RigidPolygon)


def finite_obstacles(scenes: Mapping[str, BodyScene]) -> list[tuple[Obstacle, dict[str, list[str]]]]:
    """Return the different fixed obstacles of finite size of bodies, each with the parts that may touch it, by body."""
    found: list[tuple[Obstacle, dict[str, list[str]]]] = []
    for name, scene in scenes.items():
        for part, obstacle in scene.obstacles.items():
            if is_finite(obstacle):
                touching = next((known for other, known in found if other == obstacle), None)
                if touching is None:
                    found.append((obstacle, touching := {}))
                touching.setdefault(name, []).append(part)
    return found


def _interference(scene: Scene, names: tuple[str, str]) -> float:
    """Return the largest interference of the contacts between two bodies."""
    bodies = {pair.name: {side.partition(".")[0] for side in pair.sides} for pair in scene.contacts}
    return max((pair.interference for pair in scene.contacts if bodies[pair.name] == set(names)), default=0.0)


def _overlap(names: tuple[str, str], depth: float, place: FloatArray, size: float) -> OverlapError:
    one, two = names
    return OverlapError(
        f"bodies {one!r} and {two!r} overlap by {depth:.4g} at {format_point(place, size, digits=6)}: move them apart, "
        "or state a contact with an interference between them"
    )
