"""Discs dropped into a box of three rigid half-planes, as an assembly."""

from __future__ import annotations

from itertools import chain

import numpy as np

import bemkit as bk
from bemkit.arrays import FloatArray

RADII = (0.6, 0.7, 0.8, 0.9, 1.0)
_NEAR = 0.02
"""Distance of discs that count as neighbours [m]."""
_CAP = 0.8
"""Where the part of a disc that may touch a wall begins, in radii from its centre."""


def dropped(n: int, width: float, seed: int = 0) -> FloatArray:
    """Return (n, 3): x, y and radius of discs, each at the lowest place that others and the box leave."""
    placed = np.zeros((0, 3))
    for radius in np.random.default_rng(seed).choice(RADII, n):
        places = np.concatenate([_on_two(placed, radius), _at_wall(placed, radius, width)])
        inside = (places[:, 0] >= radius - 1e-12) & (places[:, 0] <= width - radius + 1e-12)
        places = places[inside & (places[:, 1] >= radius - 1e-12)]
        gaps = np.hypot(*(places[:, None] - placed[None, :, :2]).transpose(2, 0, 1)) - placed[:, 2] - radius
        places = places[np.all(gaps > -1e-9, axis=1)]
        placed = np.vstack([placed, [*places[np.argmin(places[:, 1])], radius]])
    return placed


def _at_wall(placed: FloatArray, radius: float, width: float) -> FloatArray:
    """Return places (k, 2) on the floor or at a wall, in a corner or beside one other disc."""
    reach = placed[:, 2] + radius
    places = [np.array([[radius, radius], [width - radius, radius]])]
    with np.errstate(invalid="ignore"):
        beside = np.sqrt(reach**2 - (radius - placed[:, 1]) ** 2)
        places += [np.stack([placed[:, 0] + sign * beside, np.full(len(placed), radius)], axis=1) for sign in (-1, 1)]
        for x in (radius, width - radius):
            above = np.sqrt(reach**2 - (x - placed[:, 0]) ** 2)
            places.append(np.stack([np.full(len(placed), x), placed[:, 1] + above], axis=1))
    found = np.concatenate(places)
    return found[np.isfinite(found).all(axis=1)]


def _on_two(placed: FloatArray, radius: float) -> FloatArray:
    """Return places (k, 2) that touch two discs."""
    one, two = np.triu_indices(len(placed), 1)
    way = placed[two, :2] - placed[one, :2]
    distance = np.hypot(*way.T)
    reach, other = placed[one, 2] + radius, placed[two, 2] + radius
    along = (reach**2 - other**2 + distance**2) / (2.0 * distance)
    is_near = (distance < reach + other) & (np.abs(along) < reach)
    one, way, along, reach = one[is_near], way[is_near] / distance[is_near, None], along[is_near], reach[is_near]
    across = np.sqrt(reach**2 - along**2)[:, None] * np.stack([-way[:, 1], way[:, 0]], axis=1)
    foot = placed[one, :2] + along[:, None] * way
    return np.concatenate([foot + across, foot - across])


def packing(n: int, width: float, *, seed: int = 0, elements: int = 48) -> bk.Scene:
    """Return discs of weight 1 for each square metre; those away from floor and walls are copies of five.

    Each contact reaches as far as a tenth of a metre, so that no point faces two discs.
    """
    discs = dropped(n, width, seed)
    common = {
        "material": bk.Material(1e3, 0.3),
        "body_forces": (bk.Gravity(1.0, (0.0, -1.0)),),
        "mesh": bk.MeshOptions(elements=elements),
    }
    bodies = []
    for radius in RADII:
        cap, free = _CAP * radius, []
        for x, y, _ in discs[discs[:, 2] == radius].tolist():
            walls = {
                "floor": (y < radius + _NEAR, bk.RigidHalfPlane(), f"y < {-cap}", f"y >= {-cap}"),
                "left": (x < radius + _NEAR, bk.RigidHalfPlane((0.0, 0.0), (1.0, 0.0)), f"x < {-cap}", f"x >= {-cap}"),
                "right": (
                    x > width - radius - _NEAR,
                    bk.RigidHalfPlane((width, 0.0), (-1.0, 0.0)),
                    f"x > {cap}",
                    f"x <= {cap}",
                ),
            }
            touched = {name: wall for name, wall in walls.items() if wall[0]}
            if not touched:
                free.append(bk.Placement((x, y)))
                continue
            rest = " and ".join(wall[3] for wall in touched.values())
            parts = chain(
                (bk.Part(name, bk.Contact(wall[1]), where=bk.Expression(wall[2])) for name, wall in touched.items()),
                [bk.Part("rim", bk.Free(), where=bk.Expression(rest))],
            )
            name = f"at wall {len(bodies)}"
            place = bk.Placement((x, y))
            bodies.append(bk.Body(name=name, shape=bk.Disk(radius), parts=tuple(parts), placement=place, **common))
        if free:
            copies = bk.ListedCopies(tuple(free))
            rim = (bk.Part("rim", bk.Free()),)
            bodies.append(
                bk.Body(name=f"disc {10 * radius:g}", shape=bk.Disk(radius), parts=rim, copies=copies, **common)
            )
    return bk.Scene(
        title=f"A packing of {n} discs",
        bodies=tuple(bodies),
        touching=bk.Touching(_NEAR, reach=0.1),
        law=bk.Coulomb(0.4),
    )
