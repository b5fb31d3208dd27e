"""Several bodies with friction: energy that is lost in cycles, limits of friction, edges that stick."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import cast

import numpy as np

from bemkit.contact.laws import Coulomb
from bemkit.contact.obstacle import RigidHalfPlane
from bemkit.formulas import ScalarField
from bemkit.geometry.placement import Placement
from bemkit.geometry.shapes import Polygon, Rectangle, Sector
from bemkit.operators.material import Material, Plane
from bemkit.reference import CompleteContact, arch_friction_limit, cantilevers_loss
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.runs.steps import UnsolvableSceneError
from bemkit.scene.body import Body
from bemkit.scene.body_forces import Gravity
from bemkit.scene.conditions import Clamped, Contact, Part, PrescribedDisplacement, Pressure, Traction
from bemkit.scene.contacts import ContactPair, Touching
from bemkit.scene.copies import CircleCopies
from bemkit.scene.discretisation import Galerkin, MeshOptions
from bemkit.scene.scene import Scene
from bemkit.scene.steps import Step
from bemkit.scene.toml import with_overrides
from bemkit.studies.verification.case import Case, Quantity
from bemkit.studies.verification.measures import largest_error, lost_in_last_cycle


def to_and_fro(scene: Scene, loads: Mapping[str, float], n_quarter: int) -> Scene:
    """Return a scene whose loads, at their keys, grow and go to and fro once after a first step without them."""

    def changes(shape: str) -> dict[str, str]:
        return {key: f"{largest!r} * ({shape})" for key, largest in loads.items()}

    times = ((2.0, "t - 1", n_quarter), (4.0, "3 - t", 2 * n_quarter), (6.0, "t - 5", 2 * n_quarter))
    steps = (Step(time, changes(shape), increments=n) for time, shape, n in times)
    return replace(scene, steps=(Step(1.0), *steps))


def stacked_cantilevers() -> Case:
    """Bend beams of height 1 and length 20 to and fro by twice the force at which they begin to slip."""
    friction, pressure, force, length = 0.3, 1e-4, 8e-5, 20.0
    material = Material(1.0, 0.3, Plane.STRESS)

    def beam(name: str, face: str, height: float) -> Body:
        parts = (
            Part("wall", Clamped(), ("left",)),
            Part("face", Pressure(pressure), (face,)),
            Part("tip", Traction(), ("right",)),
        )
        place = Placement((0.0, height))
        return Body(name=name, shape=Rectangle(length, 1.0), material=material, parts=parts, placement=place)

    scene = Scene(
        title="two cantilevers pressed together, bent to and fro",
        bodies=(beam("lower", "bottom", 0.0), beam("upper", "top", 1.0)),
        contacts=(ContactPair(("upper.bottom", "lower.top")),),
        law=Coulomb(friction),
        discretisation=Galerkin(2),
    )
    loads = {f"bodies.{name}.parts.tip.condition.y": force / 2.0 for name in ("lower", "upper")}
    expected = cantilevers_loss(friction, pressure, force, length, 1.0)
    lost = Quantity("energy lost in a cycle", lost_in_last_cycle, (3e-3, 2e-3), expected)
    validity = "slender beams: a thousandth at length 20"
    return Case(to_and_fro(scene, loads, 2), "SpringfieldJoshi1989", validity, (60, 120), (lost,), n_quick=1)


def friction_limit_of_an_arch() -> Case:
    """Halve the range of the coefficient; the blocks are equal, and the ground bears two of them."""
    turn = 180.0 / 21
    corners = (
        (0.75, 0.0),
        (1.25, 0.0),
        *((r * np.cos(np.radians(turn)), r * np.sin(np.radians(turn))) for r in (1.25, 0.75)),
    )
    shape = Polygon(corners, ("before", "back", "after", "front"))
    stone = Body(
        name="block",
        shape=shape,
        material=Material(1e5, 0.2),
        body_forces=(Gravity(density=1.0, acceleration=(0.0, -1.0)),),
    )

    def springing(side: str) -> tuple[Part]:
        return (Part("springing", Contact(RigidHalfPlane()), (side,)),)

    scene = Scene(
        title="least friction of a semicircular arch of 21 blocks",
        bodies=(
            replace(stone, name="first", parts=springing("before")),
            replace(stone, placement=Placement(turn=turn), copies=CircleCopies(19, turn)),
            replace(stone, name="last", parts=springing("after"), placement=Placement(turn=20.0 * turn)),
        ),
        touching=Touching(within=1e-3),
    )

    def friction(solution: Solution) -> float:
        law = solution.scene.law
        return cast(float, law.friction_coefficient) if isinstance(law, Coulomb) else np.nan

    limit = Quantity("friction coefficient", friction, (1e-4, 1e-4), arch_friction_limit(21))
    validity = "stiff blocks; thickness half the mean radius, so that no hinges form"
    return Case(scene, "FerrisTinLoi2001", validity, (16, 24), (limit,), _least_friction, n_quick=1)


def _least_friction(scene: Scene, n: float) -> Solution:
    """Halve a range of the coefficient until the arch falls just below the one of the solution that is returned."""
    known: Solution | None = None
    least, most = 0.3, 0.33
    while most - least > 3e-5 or known is None:
        friction = 0.5 * (least + most)
        try:
            known = run(replace(with_overrides(scene, elements=int(n)), law=Coulomb(friction)))
            most = friction
        except UnsolvableSceneError:
            least = friction
    return known


def complete_contact(degrees: int) -> Case:
    """Press a sector on a half disc with the tractions and displacements of the leading field on their arcs."""
    material = Material(1e3, 0.3)
    exact = CompleteContact(float(np.radians(degrees)), material)

    def moved(axis: int) -> ScalarField:
        return lambda x, y: exact.displacement(np.column_stack([x, y]))[:, axis]

    def traction(axis: int) -> ScalarField:
        """Return a component on the arc, where points are normals."""
        return lambda x, y: np.sum(exact.stress(np.column_stack([x, y]))[:, axis] * np.column_stack([x, y]), axis=1)

    held = Part("rim", PrescribedDisplacement(moved(0), moved(1)), ("arc",))
    loaded = Part("rim", Traction(traction(0), traction(1)), ("arc",))
    scene = Scene(
        title=f"edge of {degrees} degrees on a half-plane of its material",
        bodies=(
            Body(name="block", shape=Sector(1.0, 180.0, 360.0), material=material, parts=(held,)),
            Body(name="punch", shape=Sector(1.0, 0.0, float(degrees)), material=material, parts=(loaded,)),
        ),
        contacts=(ContactPair(("punch.start", "block.end")),),
        law=Coulomb(1.5 * exact.friction_limit),
        discretisation=Galerkin(2),
        mesh=MeshOptions(accuracy=1e-2, rising_degrees=True),
    )

    def ratio(solution: Solution) -> float:
        """Return the mean ratio of shear to pressure away from the edge and the arcs."""
        inner = (solution.contact.x > 0.05) & (solution.contact.x < 0.95)
        return float(np.mean(solution.contact.sigma_t[inner] / solution.contact.sigma_n[inner]))

    def error(solution: Solution) -> float:
        x, inner = solution.contact.x, solution.contact.x > 0.05
        return largest_error(-solution.contact.sigma_n[inner], x[inner] ** (exact.exponent - 1.0))

    quantities = (
        Quantity("shear over pressure", lambda found: abs(ratio(found)), (5e-5, 1e-7), exact.friction_limit),
        Quantity("pressure, largest error", error, (1.2e-2, 2e-4)),
    )
    validity = "equal materials; sticks from a friction coefficient equal to the ratio on, here 1.5 times that"
    return Case(scene, "Williams1952", validity, (1e-2, 1e-4), quantities)
