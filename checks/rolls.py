"""Round bodies that approach an obstacle or a block by a known distance: whether they touch is known beforehand.

    python -m checks.rolls 200 --seed 7 [--first N] [--jobs N]

The exit code is 1 if a result is called converged without contact where the bodies meet, or with contact where they
stay apart, or if an error has no name.
"""

from __future__ import annotations

import argparse
import sys
import traceback
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from os import cpu_count

import numpy as np

from bemkit.cli.progress import compute_with_progress
from bemkit.contact.laws import Coulomb, Frictionless
from bemkit.contact.obstacle import RigidCircle, RigidHalfPlane
from bemkit.errors import BemkitError
from bemkit.formulas import Expression
from bemkit.geometry.shapes import Rectangle, Sector
from bemkit.operators.material import Material
from bemkit.runs.run import run
from bemkit.scene.body import Body
from bemkit.scene.conditions import Clamped, Contact, Part, PrescribedDisplacement
from bemkit.scene.contacts import ContactPair
from bemkit.scene.discretisation import ConstantCollocation, Galerkin, MeshOptions
from bemkit.scene.scene import Scene
from bemkit.studies.engine import Task
from checks.random_scenes.draw import Draw
from checks.trials import Outcome, Trial

DISCRETISATIONS = {
    "constant": ConstantCollocation(),
    **{f"degree {degree}": Galerkin(degree) for degree in (1, 2, 5)},
    "hp": Galerkin(2),
}


@dataclass(frozen=True)
class Roll:
    """A body or two, and by how much they overlap if nothing gives way; negative where they stay apart."""

    scene: Scene
    approach: float
    words: str


def drawn_roll(seed: int, index: int) -> Roll:
    """Draw half a disc that is moved to an obstacle or to a block, anywhere between the nodes of its arc."""
    draw = Draw(np.random.PCG64([seed, index]))
    name = draw.one_of(list(DISCRETISATIONS))
    radius, modulus = draw.decades(-2.0, 2.0), draw.decades(-3.0, 6.0)
    approach = radius * draw.decades(-9.0, -1.0) * draw.one_by_weight({1.0: 0.8, -1.0: 0.2})
    has_accuracy = name == "hp" or (name != "constant" and draw.chance(0.3))
    accuracy = draw.one_of((0.05, 0.01)) if has_accuracy else None
    elements = None if has_accuracy else int(draw.integers(20, 80))
    mesh = MeshOptions(elements=elements, accuracy=accuracy, rising_degrees=name == "hp")
    material = Material(modulus, draw.between(0.0, 0.45))
    law = draw.one_of((Frictionless(), Coulomb(0.3)))
    make = _at_block if draw.chance(0.4) else _at_obstacle
    scene = make(draw, radius, approach, material, DISCRETISATIONS[name], mesh, law)
    n_bodies = len(scene.placed_bodies)
    return Roll(scene, approach, f"{n_bodies} bodies, {name}, {accuracy or elements}, approach {approach / radius:.2e}")


def _at_obstacle(draw, radius, approach, material, discretisation, mesh, law) -> Scene:
    angle = np.radians(draw.between(-30.0, 30.0))
    normal = np.array([-np.sin(angle), np.cos(angle)])
    lowest = -radius * normal
    shift = (-approach * normal).tolist()
    obstacle = RigidHalfPlane(tuple(lowest.tolist()), tuple(normal.tolist()))
    if draw.chance(0.3):
        size = radius * draw.decades(-0.5, 1.0)
        obstacle = RigidCircle(tuple((lowest - size * normal).tolist()), size)
    left, right = (radius * draw.between(0.05, 0.4) for _ in range(2))
    where = Expression(f"x > {lowest[0] - left:.17g} and x < {lowest[0] + right:.17g}")
    parts = (
        Part("load", PrescribedDisplacement(*shift), ("start", "end")),
        Part("tip", Contact(obstacle), ("arc",), where),
    )
    return Scene(
        title="roll", shape=Sector(radius, 180.0, 360.0), material=material, parts=parts, law=law,
        discretisation=discretisation, mesh=mesh,
    )  # fmt: skip


def _at_block(draw, radius, approach, material, discretisation, mesh, law) -> Scene:
    centre = (radius * draw.between(-0.5, 0.5), radius)
    own = {} if mesh.accuracy is not None else {"mesh": mesh}
    block = Body(
        name="block",
        shape=Rectangle(2.0 * radius, radius, (-radius, -radius)),
        material=material,
        parts=(Part("base", Clamped(), ("bottom",)),),
        **own,
    )
    disc = Body(
        name="disc",
        shape=Sector(radius, 180.0, 360.0, centre=centre),
        material=material,
        parts=(Part("load", PrescribedDisplacement(0.0, -approach), ("start", "end")),),
        **own,
    )
    sides = draw.one_of((("disc.arc", "block.top"), ("block.top", "disc.arc")))
    options = {"mesh": mesh} if mesh.accuracy is not None else {}
    return Scene(
        title="roll", bodies=(block, disc), contacts=(ContactPair(sides),), law=law, discretisation=discretisation,
        **options,
    )  # fmt: skip


def try_roll(seed: int, index: int) -> Trial:
    """Solve a roll, and compare whether there is a contact force with whether there must be one."""
    roll = drawn_roll(seed, index)
    try:
        solution = run(roll.scene)
    except BemkitError as error:
        return Trial(seed, index, Outcome.NAMED, type(error).__name__, f"{roll.words}: {error}")
    except Exception as error:
        return Trial(seed, index, Outcome.TRACEBACK, type(error).__name__, f"{roll.words}: {traceback.format_exc()}")
    has_force = bool(solution.contact.sigma_n.any())
    if not solution.is_converged:
        return Trial(seed, index, Outcome.NAMED, solution.status.name.lower(), f"{roll.words}: {solution.message}")
    if has_force != (roll.approach > 0.0):
        reason = "contact where bodies stay apart" if has_force else "inside without contact"
        return Trial(seed, index, Outcome.WRONG, reason, f"{roll.words}: force {solution.force_normal:.3g}")
    return Trial(seed, index, Outcome.WARNED if solution.warnings else Outcome.SUCCESS, "", roll.words)


def main(arguments: Sequence[str] | None = None) -> int:
    """Solve and judge rolls."""
    parser = argparse.ArgumentParser(prog="python -m checks.rolls", description=__doc__.split("\n")[0])
    parser.add_argument("count", type=int, help="number of rolls")
    parser.add_argument("--seed", type=int, default=0, help="equal seeds make equal rolls (0)")
    parser.add_argument("--first", type=int, default=0, help="index of the first roll (0)")
    parser.add_argument("--jobs", type=int, default=cpu_count() or 1, help="number of processes")
    asked = parser.parse_args(arguments)
    indices = range(asked.first, asked.first + asked.count)
    tasks = [Task((asked.seed, index), f"roll {index}", partial(try_roll, asked.seed, index)) for index in indices]
    found = compute_with_progress(tasks, "rolls", is_live=False, processes=min(asked.jobs, asked.count))
    trials = sorted(found, key=lambda trial: trial.index)
    for (outcome, reason), count in Counter((trial.outcome.value, trial.reason) for trial in trials).items():
        print(f"{count:5}  {outcome} {reason.replace('_', ' ')}".rstrip())
    for trial in trials:
        if trial.is_failure:
            print(f"roll {trial.index}: {trial.message}")
    return int(any(trial.is_failure for trial in trials))


if __name__ == "__main__":
    sys.exit(main())
