"""Random assemblies: bodies, contacts, law, driver, units, place and load history."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bemkit.operators.linear_solvers import Automatic, DenseCholesky, LinearSolverChoice
from bemkit.scene.body import Body
from bemkit.scene.conditions import Part, Pressure, Traction
from bemkit.scene.discretisation import MeshOptions
from bemkit.scene.scene import Scene
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import ContactSolver
from bemkit.solvers.fallbacks import Fallbacks
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.ssn import SemismoothNewton
from bemkit.studies.stability.similarity import Similarity
from checks.random_assemblies import blocks, corners, round_bodies
from checks.random_assemblies.members import Layout, Members
from checks.random_scenes.draw import Draw, RandomCase
from checks.random_scenes.histories import shear_of, sheared_steps

_STREAM, _HISTORIES = 2, 4
"""Keep the draws of assemblies and of their load histories apart from those of scenes with the same numbers."""


_LINEAR_SOLVERS: tuple[LinearSolverChoice, ...] = (Automatic(), Automatic(), DenseCholesky(), Automatic())


def random_assembly(seed: int, index: int) -> RandomCase:
    """Draw assembly number `index` of a seed; the same numbers always give the same assembly.

    Raises
    ------
    BemkitError
        If what was drawn is not an assembly; the message says why.
    """
    draw = Draw(np.random.PCG64([seed, index, _STREAM]))
    members = Members.drawn(draw)
    layout = random_layout(draw, members)
    discretisation = members.discretisation()
    spaces = [discretisation if body.discretisation is None else body.discretisation for body in layout.bodies]
    assembly = Scene(
        title=f"random assembly {index} of seed {seed}",
        bodies=layout.bodies,
        contacts=layout.contacts,
        touching=layout.touching,
        law=members.law(),
        discretisation=discretisation,
        linear_solver=draw.one_of(_LINEAR_SOLVERS),
        solver=_solver(draw),
    )
    if all(space.estimates_error for space in spaces) and draw.chance(0.05):
        bodies = tuple(replace(body, mesh=None) for body in assembly.bodies)
        mesh = MeshOptions(accuracy=draw.decades(-2.0, -0.7), most_elements=int(draw.integers(40, 80)))
        assembly = replace(assembly, bodies=bodies, mesh=mesh)
    elsewhere = _similarity(draw).apply(assembly)
    sheared = _sheared(Draw(np.random.PCG64([seed, index, _HISTORIES])), elsewhere)
    return RandomCase(seed, index, _history(draw, elsewhere) if sheared is None else (sheared,))


def _similarity(draw: Draw) -> Similarity:
    """Draw units, a direction and a place: mostly steel and millimetres to metres, sometimes far from the origin."""
    length = 1.0 if draw.chance(0.4) else draw.decades(-6.0, 6.0)
    stress = 1.0 if draw.chance(0.3) else draw.decades(-6.0, 12.0)
    turn = draw.one_of((0.0, 0.0, 0.0, 90.0, draw.between(-180.0, 180.0)))
    far = draw.one_of((0.0, 0.0, 0.0, 1.0, draw.decades(0.0, 5.0)))
    x, y = (length * far * draw.direction()).tolist()
    return Similarity(length, stress, stress, turn, (x, y))


def _solver(draw: Draw) -> ContactSolver:
    drivers: dict[ContactSolver, float] = {
        Fallbacks(): 8.0,
        Fallbacks((SemismoothNewton(rho=draw.decades(-3.0, 3.0)), *Fallbacks().drivers[1:])): 1.0,
        AugmentedLagrangian(max_steps=60): 1.0,
        FixedPoint(max_steps=60): 1.0,
    }
    return draw.one_by_weight(drivers)


def _sheared(draw: Draw, assembly: Scene) -> Scene | None:
    """Return the assembly now and then with steps: the loads come, a part is sheared to and fro, the loads go."""
    places = [
        (f'bodies."{body.name}".{found[0]}', found[1])
        for body in assembly.bodies
        for part in body.parts
        if (found := shear_of(part))
    ]
    if assembly.mesh.accuracy is not None or not places or not draw.chance(0.15):
        return None
    return replace(assembly, steps=sheared_steps(draw, *draw.one_of(tuple(places))))


def _history(draw: Draw, assembly: Scene) -> tuple[Scene, ...]:
    """Return the assembly, sometimes followed by one whose loads have changed."""
    if assembly.mesh.accuracy is not None or not draw.chance(0.15):
        return (assembly,)
    factors = [draw.one_of((0.5, 1.0, 1.5, 0.0)) for _ in assembly.bodies]
    bodies = tuple(_loaded(body, factor) for body, factor in zip(assembly.bodies, factors, strict=True))
    return assembly, replace(assembly, bodies=bodies)


def _loaded(body: Body, factor: float) -> Body:
    """Return a body whose tractions and pressures are multiplied."""

    def changed(part: Part) -> Part:
        match part.condition:
            case Traction(float(x), float(y)):
                return replace(part, condition=Traction(factor * x, factor * y))
            case Pressure(float(pressure), float(shear)):
                return replace(part, condition=Pressure(factor * pressure, factor * shear))
        return part

    return replace(body, parts=tuple(changed(part) for part in body.parts))


def random_layout(draw: Draw, members: Members) -> Layout:
    """Draw an arrangement."""
    kinds: dict[Callable[[Draw, Members], Layout], float] = {
        blocks.stack: 4.0,
        round_bodies.discs: 2.0,
        round_bodies.pin: 2.0,
        corners.wedge: 1.5,
        blocks.wall: 2.0,
        blocks.crossing: 1.5,
        round_bodies.rings: 1.5,
        corners.notch: 2.0,
        corners.split: 1.5,
        round_bodies.tunnel: 1.0,
        blocks.arch: 0.7,
    }
    return draw.one_by_weight(kinds)(draw, members)
