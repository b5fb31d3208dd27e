"""Walls of blocks in running bond on rigid ground, as assemblies."""

from __future__ import annotations

from itertools import pairwise

import bemkit as bk

FRICTION = 0.6


def wall(courses: int, per_course: int, *, push: bool, elements: int = 24) -> bk.Scene:
    """Blocks of 2 x 1 of weight 1 for each square metre, halves at the ends of every other course.

    Parameters
    ----------
    courses, per_course : int
        Whole blocks in even courses.
    push : bool
        What grows with load factors: a pressure of one on the left end of the uppermost course, or a body force of one
        to the right, as of ground that leans. The weight is constant.
    elements : int
        Of a whole block.
    """
    weight = bk.Gravity(1.0, (0.0, -1.0), is_constant=True)
    forces = (weight,) if push else (weight, bk.Gravity(1.0, (1.0, 0.0)))
    floor, pushed = (
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), ("bottom",)),
        bk.Part("push", bk.Pressure(1.0), ("left",)),
    )
    whole, half = bk.Rectangle(2.0, 1.0), bk.Rectangle(1.0, 1.0)
    meshes = {2: bk.MeshOptions(elements=elements), 1: bk.MeshOptions(elements=elements * 2 // 3)}
    bodies = []
    for course in range(courses):
        ends = [*range(0, 2 * per_course + 1, 2)]
        if course % 2:
            ends = [0, *range(1, 2 * per_course, 2), 2 * per_course]
        for number, (left, right) in enumerate(pairwise(ends)):
            is_pushed = push and course == courses - 1 and number == 0
            bodies.append(
                bk.Body(
                    name=f"block {course}-{number}",
                    shape=whole if right - left == 2 else half,
                    material=bk.Material(1e4, 0.2),
                    parts=(floor,) * (course == 0) + (pushed,) * is_pushed,
                    body_forces=forces,
                    placement=bk.Placement((float(left), float(course))),
                    mesh=meshes[right - left],
                )
            )
    return bk.Scene(title="A wall", bodies=tuple(bodies), touching=bk.Touching(0.01), law=bk.Coulomb(FRICTION))
