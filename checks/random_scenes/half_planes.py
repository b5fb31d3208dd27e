"""Random half-planes, periodic ones too: obstacles above pieces of their surface, loads beside them and far away."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bemkit.contact.laws import FrictionLaw
from bemkit.contact.obstacle import Gap, Obstacle, RigidCircle, RigidHalfPlane
from bemkit.contact.polygon import RigidPolygon
from bemkit.contact.rough_profile import SelfAffineProfile
from bemkit.formulas import Expression
from bemkit.geometry.meshing.discretise import Algebraic, Geometric, Grading, Uniform
from bemkit.geometry.shapes import ElasticHalfPlane, PeriodicHalfPlane, Shape
from bemkit.operators.material import Material
from bemkit.scene.conditions import (
    Clamped,
    Condition,
    Contact,
    Part,
    PrescribedDisplacement,
    Pressure,
    Roller,
    Traction,
)
from bemkit.scene.discretisation import MeshOptions
from bemkit.scene.load_history import with_scaled_loads
from bemkit.scene.plane_motion import FarField
from bemkit.scene.scene import Scene
from bemkit.scene.steps import Step
from bemkit.solvers.base import ContactSolver
from checks.random_scenes.bodies import Body
from checks.random_scenes.draw import Draw
from checks.random_scenes.parts import random_law


@dataclass(frozen=True)
class _Strip:
    """The surface of a half-plane, and how far it is pressed.

    Parameters
    ----------
    left, length : float [m]
    n_elements : int
    is_periodic : bool
    depth : float [m]
        Of the order of the displacements.
    modulus : float [Pa]
    """

    left: float
    length: float
    n_elements: int
    is_periodic: bool
    depth: float
    modulus: float

    @property
    def shape(self) -> Shape:
        if self.is_periodic:
            return PeriodicHalfPlane(self.length, self.left)
        return ElasticHalfPlane(self.left, self.left + self.length)

    @property
    def force(self) -> float:
        """The force [N/m] that goes with the depth."""
        return self.modulus * self.depth

    def law(self, draw: Draw) -> FrictionLaw:
        """Draw a friction law."""
        centre = np.array([self.left + 0.5 * self.length, 0.0])
        return random_law(draw, Body(self.shape, self.length, centre), self.modulus)


def random_half_plane(draw: Draw, title: str, material: Material, solver: ContactSolver) -> tuple[Scene, ...]:
    """Draw a half-plane in contact; several scenes follow each other in time.

    Raises
    ------
    BemkitError
        If what was drawn is not a scene.
    """
    length = 1.0 if draw.chance(0.4) else draw.decades(-3.0, 3.0)
    left = length * (-0.5 if draw.chance(0.4) else draw.between(-3.0, 3.0))
    low, high = draw.one_by_weight({(3, 9): 0.08, (10, 40): 0.6, (41, 120): 0.32})
    depth = length * draw.decades(-7.0, -2.0)
    strip = _Strip(left, length, int(draw.integers(low, high)), draw.chance(0.4), depth, material.youngs_modulus)
    scene = Scene(
        title=title,
        shape=strip.shape,
        material=material,
        parts=_parts(draw, strip),
        law=strip.law(draw),
        far=_far(draw, strip),
        mesh=_mesh(draw, strip),
        solver=solver,
    )
    return _history(draw, strip, scene)


def _mesh(draw: Draw, strip: _Strip) -> MeshOptions:
    if strip.is_periodic:
        return MeshOptions(strip.n_elements)
    if draw.chance(0.06):
        return MeshOptions(accuracy=draw.decades(-2.0, -0.7), most_elements=int(draw.integers(40, 100)))
    gradings: dict[Grading, float] = {
        Uniform(): 6.0,
        Algebraic(draw.between(1.2, 3.0)): 3.0,
        Geometric(draw.between(0.2, 0.6), int(draw.integers(1, 6))): 1.0,
    }
    return MeshOptions(strip.n_elements, draw.one_by_weight(gradings))


def _parts(draw: Draw, strip: _Strip) -> tuple[Part, ...]:
    """Draw contact on the whole strip, or on one piece of some; the others are touched, loaded, held or free."""
    if draw.chance(0.4):
        return (Part("contact", Contact(_obstacle(draw, strip, 0.0, 1.0))),)
    # of a periodic surface pieces end where equal elements do
    steps = strip.n_elements if strip.is_periodic else 1000
    places = draw.choice(np.arange(1, steps), min(2 * draw.one_of((1, 1, 2, 3)), 2 * ((steps - 1) // 2)), replace=False)
    pieces = np.sort(places).reshape(-1, 2) / steps
    chosen = int(draw.integers(len(pieces)))
    parts = []
    for k, (begin, end) in enumerate(pieces.tolist()):
        where = Expression(f"x > {strip.left + begin * strip.length!r} and x < {strip.left + end * strip.length!r}")
        condition = _condition(draw, strip, begin, end) if k != chosen else Contact(_obstacle(draw, strip, begin, end))
        if isinstance(condition, Contact) and draw.chance(0.3):
            condition = replace(condition, law=strip.law(draw))
        if condition is not None:
            parts.append(Part("contact" if k == chosen else f"piece {k}", condition, where=where))
    return tuple(parts)


def _condition(draw: Draw, strip: _Strip, begin: float, end: float) -> Condition | None:
    stress = strip.force / strip.length * draw.decades(-2.0, 1.0)
    middle = strip.left + 0.5 * (begin + end) * strip.length
    supports = {} if strip.is_periodic else {"held": 1.0}
    match draw.one_by_weight(
        {"touched": 3.0, "traction": 1.5, "pressure": 1.0, "varying": 1.0, "free": 1.0, **supports}
    ):
        case "touched":
            return Contact(_obstacle(draw, strip, begin, end))
        case "traction":
            return Traction(stress * draw.between(-1.0, 1.0), stress * draw.between(-1.0, 0.3))
        case "pressure":
            return Pressure(stress * draw.one_of((1.0, 1.0, -0.3)), stress * draw.one_of((0.0, 0.3)))
        case "varying":
            return Traction(0.0, Expression(f"{stress!r} * (x - {middle!r}) / {strip.length!r}"))
        case "held":
            motion = strip.depth * draw.between(-1.0, 1.0)
            moved = (PrescribedDisplacement(0.0, motion), PrescribedDisplacement(y=motion))
            supports_of_nodes: tuple[Condition, ...] = (Clamped(), Roller(), *moved)
            return draw.one_of(supports_of_nodes)
    return None


def _obstacle(draw: Draw, strip: _Strip, begin: float, end: float) -> Obstacle:
    """Draw an obstacle above a piece of the surface, nearest somewhere about its middle."""
    width = (end - begin) * strip.length
    x = strip.left + begin * strip.length + width * (0.5 if draw.chance(0.5) else draw.between(0.1, 0.9))
    height = strip.depth * draw.decades(-1.0, 1.5)
    gap = draw.one_by_weight(
        {0.0: 0.5, strip.depth * draw.decades(-2.0, 1.0): 0.3, -strip.depth * draw.between(0.0, 2.0): 0.2}
    )
    kinds = {"parabola": 3.0, "wedge": 1.0, "flat": 1.5, "wave": 1.5, "directed": 0.5, "plane": 1.0, "tilted": 1.0}
    rough = {"rough": 2.0} if strip.is_periodic else {}
    match draw.one_by_weight({**kinds, **rough, "circle": 1.0, "polygon": 1.0}):
        case "parabola":
            return Gap(Expression(f"{gap!r} + {height / width**2!r} * (x - {x!r})**2"))
        case "wedge":
            return Gap(Expression(f"{gap!r} + {height / width!r} * abs(x - {x!r})"))
        case "wave":
            waves = 2.0 * float(np.pi) * int(draw.integers(1, 5)) / strip.length
            return Gap(Expression(f"{gap!r} + {height!r} * (1 - cos({waves!r} * (x - {x!r})))"))
        case "directed":
            slope = draw.between(-0.5, 0.5)
            return Gap(abs(gap), direction=(slope, 1.0))
        case "plane":
            return RigidHalfPlane((x, gap), (0.0, -1.0))
        case "tilted":
            return RigidHalfPlane((x, gap), (draw.one_of((-1.0, 1.0)) * height / width, -1.0))
        case "circle":
            radius = width**2 / height if draw.chance(0.7) else width * draw.decades(-0.5, 1.0)
            return RigidCircle((x, gap + radius), radius)
        case "polygon":
            top, half = gap + width, 0.5 * width * draw.between(0.1, 1.0)
            wedge = ((x, gap), (x + half, top), (x - half, top))
            block = ((x - half, gap), (x + half, gap), (x + half, top), (x - half, top))
            return RigidPolygon(draw.one_of((wedge, block)))
        case "rough":
            period, seed = strip.length, int(draw.integers(1000))
            cut_off = period / draw.one_of((8, 16))
            return SelfAffineProfile(
                period=period, rms_height=height, roll_off=0.5 * period, cut_off=cut_off, seed=seed, distance=gap
            )
    return Gap(gap)


def _far(draw: Draw, strip: _Strip) -> FarField | None:
    """Draw motions or loads far away that mostly press the surface upward."""
    if draw.chance(0.05):
        return None
    press, push, turn = strip.force * draw.decades(-1.0, 0.5), draw.decades(-2.0, 0.0), draw.between(-1.0, 1.0)
    side = draw.one_of((-1.0, 1.0))
    given: dict[str, Any] = {}
    given |= {"force_y": press} if draw.chance(0.65) else {"y": strip.depth * draw.between(-0.3, 2.0)}
    match draw.one_by_weight({"rest": 2.0, "moved": 1.5, "pushed": 3.0}):
        case "moved":
            given["x"] = side * strip.depth * push
        case "pushed":
            given["force_x"] = side * press * push
    if not strip.is_periodic:
        match draw.one_by_weight({"rest": 4.0, "turned": 1.0, "driven": 1.0}):
            case "turned":
                given["turn"] = turn * strip.depth / strip.length
            case "driven":
                given["moment"] = 0.2 * turn * press * strip.length
        below = 0.0 if draw.chance(0.5) else draw.between(-3.0, 1.0)
        given["centre"] = (strip.left + (0.5 + (turn if below else 0.0)) * strip.length, below * strip.length)
    return FarField(**given)


def _history(draw: Draw, strip: _Strip, scene: Scene) -> tuple[Scene, ...]:
    """Return the scene, sometimes with loads that change: by factors, sheared to and fro, or as another scene."""
    if scene.mesh.accuracy is not None or scene.far is None:
        return (scene,)
    match draw.one_by_weight({"once": 6.0, "factors": 1.0, "sheared": 2.0, "another": 1.0}):
        case "factors":
            factors = draw.one_of(((0.5, 1.0), (0.3, 0.6, 1.0), (1.0, 0.5), (1.0, 0.0), (2.0,)))
            return (replace(scene, load_factors=factors),)
        case "sheared":
            return (replace(scene, steps=_sheared(draw, strip, scene.far)),)
        case "another":
            other = with_scaled_loads(scene, draw.one_of((0.5, 1.5, 0.0)))
            return (scene, replace(scene, far=other.far) if draw.chance(0.5) else other)
    return (scene,)


def _sheared(draw: Draw, strip: _Strip, far: FarField) -> tuple[Step, ...]:
    """Draw steps that press, shear to one side and to the other, and unload in part or as a whole."""
    is_pushed = far.force_x is not None
    key, size = ("far.force_x", abs(far.force_x or 0.0)) if is_pushed else ("far.x", strip.depth)
    shear, increments = size * draw.decades(-1.0, 0.2), int(draw.integers(1, 4))
    left = draw.one_of((0.0, 0.3, 0.7))
    return (
        Step(1.0, {key: 0.0}, load_factor="t", increments=int(draw.integers(1, 4))),
        Step(2.0, {key: f"{shear!r} * (t - 1)"}, load_factor=1.0, increments=increments),
        Step(4.0, {key: f"{shear!r} * (3 - t)"}, increments=2 * increments),
        Step(5.0, {key: -shear}, load_factor=f"1 + (t - 4) * ({left!r} - 1)", increments=increments),
    )
