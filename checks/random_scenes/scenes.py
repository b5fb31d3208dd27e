"""Random scenes: body, contact, supports, loads, material, mesh, driver and load history; some are symmetric."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from bemkit.contact.obstacle import Gap, Obstacle, RigidCavity, RigidCircle, RigidHalfPlane
from bemkit.formulas import Expression
from bemkit.geometry.meshing.discretise import Algebraic, Geometric, Grading, Uniform
from bemkit.geometry.shapes import Disk, PlateWithHole, Rectangle, Ring, Shape
from bemkit.geometry.symmetry.lines import Symmetry
from bemkit.operators.linear_solvers import Automatic, DenseCholesky, LinearSolverChoice
from bemkit.operators.material import Material, Plane
from bemkit.scene.conditions import Condition, Contact, Part, PrescribedDisplacement, Pressure, Roller, Traction
from bemkit.scene.discretisation import ConstantCollocation, Discretisation, Galerkin, MeshOptions
from bemkit.scene.load_history import with_scaled_loads
from bemkit.scene.scene import Scene
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import ContactSolver
from bemkit.solvers.fallbacks import Fallbacks
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.lemke import LemkePivoting
from bemkit.solvers.ssn import SemismoothNewton
from checks.random_scenes.bodies import Body, random_body
from checks.random_scenes.draw import Draw, RandomCase
from checks.random_scenes.half_planes import random_half_plane
from checks.random_scenes.histories import pressed_and_sheared
from checks.random_scenes.inside import random_body_forces
from checks.random_scenes.parts import random_actions, random_contact, random_law

HALF_PLANES = 0.12
"""Share of half-planes among the scenes."""
_NEARLY_INCOMPRESSIBLE = (0.45, 0.49, 0.4995, 0.499995, 0.49999995, 0.5, 0.5)


def random_case(seed: int, index: int) -> RandomCase:
    """Draw scene number `index` of a seed; the same numbers always give the same scene.

    Raises
    ------
    BemkitError
        If what was drawn is not a scene; the message says why.
    """
    title = f"random scene {index} of seed {seed}"
    draw = Draw(np.random.PCG64([seed, index, 3]))  # of its own, so that all other scenes are drawn as without
    if draw.chance(HALF_PLANES):
        material, solver = _material(draw, draw.decades(-6.0, 12.0)), _solver(draw)
        return RandomCase(seed, index, random_half_plane(draw, title, material, solver))
    draw = Draw(np.random.PCG64([seed, index]))
    modulus = draw.decades(-6.0, 12.0)
    if draw.chance(0.1):
        layout = _mirrored(draw, modulus)
    else:
        body = random_body(draw)
        contact, down, law = random_contact(draw, body, modulus)
        taken = [side for part in contact for side in part.sides]
        parts = (*contact, *random_actions(draw, body, taken, down, modulus))
        layout = {"shape": body.shape, "parts": parts, "law": law}
    layout |= _inside(index, seed, layout, modulus)
    scene = _scene(draw, title, modulus, layout)
    return RandomCase(seed, index, pressed_and_sheared(seed, index, scene) or _history(draw, scene))


def _inside(index: int, seed: int, layout: dict[str, Any], modulus: float) -> dict[str, Any]:
    """Draw what acts inside a body now and then, by numbers of its own, so that all else is drawn as without."""
    draw = Draw(np.random.PCG64([seed, index, 1]))
    if layout["shape"].outline().is_exterior or not draw.chance(0.3):
        return {}
    return {"body_forces": random_body_forces(draw, layout["shape"], modulus, layout.get("symmetry"))}


def _scene(draw: Draw, title: str, modulus: float, layout: dict[str, Any]) -> Scene:
    constant = ConstantCollocation(slopes=not draw.chance(0.2))
    discretisation: Discretisation = draw.one_of((Galerkin(1), Galerkin(2), constant))
    material = _material(draw, modulus)
    if draw.chance(0.15):
        discretisation = Galerkin(int(draw.integers(3, 9)))
    mesh = _mesh(draw, layout["shape"], discretisation)
    if mesh.accuracy is not None and draw.chance(0.3):
        discretisation, mesh = Galerkin(2), replace(mesh, rising_degrees=True)
    factors: tuple[float, ...] = (1.0,)
    if draw.chance(0.12):
        factors = draw.one_of(((0.5, 1.0), (0.3, 0.6, 1.0), (1.0, 0.5), (1.0, -0.3, 0.7), (1.0, 0.0), (2.0,)))
    if mesh.accuracy is not None:
        factors = (1.0,)
    solver, linear_solver = _solver(draw), _linear_solver(draw)
    if not any(part for part in layout["parts"] if "contact" in part.name or part.name == "shaft"):
        layout = {name: value for name, value in layout.items() if name != "law"}
        solver = Fallbacks()
    return Scene(
        title=title,
        material=material,
        discretisation=discretisation,
        mesh=mesh,
        solver=solver,
        linear_solver=linear_solver,
        load_factors=factors,
        **layout,
    )


def _material(draw: Draw, modulus: float) -> Material:
    match draw.one_by_weight({"usual": 5.0, "incompressible": 3.0, "any": 2.0}):
        case "usual":
            ratio = draw.one_of((0.0, 0.2, 0.3, 0.3, 0.4))
        case "incompressible":
            ratio = draw.one_of(_NEARLY_INCOMPRESSIBLE)
        case _:
            ratio = draw.between(-0.9, 0.5)
    return Material(modulus, ratio, Plane.STRESS if draw.chance(0.2) else Plane.STRAIN)


def _mesh(draw: Draw, shape: Any, discretisation: Discretisation) -> MeshOptions:
    if discretisation.estimates_error and draw.chance(0.04):
        return MeshOptions(accuracy=draw.decades(-2.0, -0.7), most_elements=int(draw.integers(40, 100)))
    low, high = draw.one_by_weight({(3, 9): 0.08, (10, 40): 0.67, (41, 80): 0.2, (81, 160): 0.05})
    if isinstance(discretisation, Galerkin) and discretisation.largest_degree > 2:
        low, high = 3, 30  # of many nodes each
    gradings: dict[Grading, float] = {
        Uniform(): 6.0,
        Algebraic(draw.between(1.2, 3.0)): 3.0,
        Geometric(draw.between(0.2, 0.6), int(draw.integers(1, 6))): 1.0,
    }
    density = {}
    if draw.chance(0.2):
        sides = [side.name for loop in shape.outline().loops for side in loop]
        density = {draw.one_of(sides): draw.one_of((0.25, 2.0, 4.0, 10.0))}
    return MeshOptions(int(draw.integers(low, high + 1)), draw.one_by_weight(gradings), density)


def _solver(draw: Draw) -> ContactSolver:
    drivers: dict[ContactSolver, float] = {
        Fallbacks(): 8.0,
        Fallbacks((SemismoothNewton(rho=draw.decades(-3.0, 3.0)), *Fallbacks().drivers[1:])): 1.0,
        AugmentedLagrangian(max_steps=60): 1.5,
        FixedPoint(max_steps=60): 1.5,
        LemkePivoting(): 1.5,
    }
    return draw.one_by_weight(drivers)


def _linear_solver(draw: Draw) -> LinearSolverChoice:
    weights: dict[LinearSolverChoice, float] = {Automatic(): 7.0, DenseCholesky(): 3.0}
    return draw.one_by_weight(weights)


def _history(draw: Draw, scene: Scene) -> tuple[Scene, ...]:
    """Return the scene, sometimes followed by a second one whose loads have changed, each in its own way."""
    if scene.mesh.accuracy is not None or len(scene.load_factors) > 1 or not draw.chance(0.08):
        return (scene,)
    factors = [draw.one_of((0.5, 1.0, 1.5, 0.0, -0.5)) for _ in scene.parts]
    parts = tuple(with_scaled_loads(scene, factor).parts[k] for k, factor in enumerate(factors))
    return scene, replace(scene, parts=parts)


_Layout: TypeAlias = tuple[Shape, tuple[Part, ...], Symmetry]


def _mirrored(draw: Draw, modulus: float) -> dict[str, Any]:
    """Draw shape, parts, law and symmetry lines of a scene about the origin."""
    size = draw.decades(-2.0, 2.0)
    stress = modulus * draw.decades(-7.0, -2.0)
    make = draw.one_of((_block, _round, _shrunk))
    shape, parts, symmetry = make(draw, size, stress, stress / modulus * size)
    law = random_law(draw, Body(shape, size, np.array([0.0, 0.0])), modulus)
    # coefficients that vary with x are symmetric about no line
    varying = [name for name, value in vars(law).items() if isinstance(value, Expression)]
    law = type(law)(**{**vars(law), **dict.fromkeys(varying, 0.3)})
    return {"shape": shape, "parts": parts, "symmetry": symmetry, "law": law}


def _block(draw: Draw, size: float, stress: float, motion: float) -> _Layout:
    """Draw a block or a plate on a floor or between floors, pressed from above or from the sides."""
    width, height = size, size * draw.between(0.4, 2.0)
    corner = (-0.5 * width, -0.5 * height)
    shape: Shape = Rectangle(width, height, corner)
    if draw.chance(0.3):
        shape = PlateWithHole(width, height, 0.5 * min(width, height) * draw.between(0.2, 0.8), corner)
    gap = draw.one_of((0.0, 0.0, size * draw.decades(-6.0, -2.0), -size * draw.decades(-6.0, -3.0)))
    curve = draw.decades(-3.0, 0.0) / size
    obstacles: tuple[Obstacle, ...] = (
        RigidHalfPlane((0.0, -0.5 * height - gap)),
        Gap(gap),
        Gap(Expression(f"{gap!r} + {curve!r} * x**2")),
    )
    floor = Part("contact", Contact(draw.one_of(obstacles)), sides=("bottom",))
    conditions: tuple[Condition | None, ...] = (None, Roller(), Pressure(0.3 * stress))
    wall = draw.one_of(conditions)
    walls = () if wall is None else (Part("walls", wall, sides=("left", "right")),)
    actions: tuple[Condition, ...] = (Traction(y=-stress), Pressure(stress), PrescribedDisplacement(y=-motion))
    return shape, (floor, *walls, Part("top", draw.one_of(actions), sides=("top",))), Symmetry(x=0.0)


def _round(draw: Draw, size: float, stress: float, motion: float) -> _Layout:
    """Draw a disc or a ring on a floor or in a cavity, pressed from above."""
    radius = 0.5 * size
    shape: Shape = Disk(radius)
    name = "arc"
    if draw.chance(0.5):
        shape, name = Ring(radius * draw.between(0.2, 0.9), radius), "outer"
    gap = draw.one_of((0.0, 0.0, size * draw.decades(-6.0, -2.0)))
    large = radius * (1.0 + draw.decades(-3.0, 0.0))
    obstacles: tuple[Obstacle, ...] = (
        RigidHalfPlane((0.0, -radius - gap)),
        RigidCavity((0.0, large - radius - gap), large),
    )
    floor = Part("contact", Contact(draw.one_of(obstacles)), sides=(f"{name}-3", f"{name}-4"))
    actions: tuple[Condition, ...] = (Traction(y=-stress), PrescribedDisplacement(y=-motion))
    return shape, (floor, Part("top", draw.one_of(actions), sides=(f"{name}-1", f"{name}-2"))), Symmetry(x=0.0)


def _shrunk(draw: Draw, size: float, stress: float, motion: float) -> _Layout:
    """Draw a ring shrunk on a shaft, with pressure from outside."""
    shape = Ring(0.5 * size * draw.between(0.2, 0.9), 0.5 * size)
    inner = tuple(f"inner-{k}" for k in range(1, 5))
    obstacles: tuple[Obstacle, ...] = (Gap(-motion), RigidCircle((0.0, 0.0), shape.inner_radius + motion))
    shaft = Part("contact", Contact(draw.one_of(obstacles)), sides=inner)
    outer = Part("outer", Pressure(stress), sides=tuple(f"outer-{k}" for k in range(1, 5)))
    return shape, (shaft, outer) if draw.chance(0.5) else (shaft,), Symmetry(x=0.0, y=0.0)
