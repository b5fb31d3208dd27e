"""Times and memory of many bodies: ``python -m benchmarks.masonry [steps | packing] [numbers]``.

``[courses] [blocks a course]`` alone: the contact system of a wall, one sticking response, the programme that finds
unsolvable loads, and a whole solve under weight and a push on the uppermost course of a tenth of what friction holds.
``steps [courses] [blocks a course]``: such a wall as an assembly, weight alone and then the push.
``packing [discs] [width] [seed]``: a random packing of discs in a box. Times are those of the processor and, in
brackets, of the clock; those of stages are of the clock.
"""

import resource
import sys
import time
from dataclasses import replace

import numpy as np

import bemkit as bk
from bemkit.contact.body import stick
from bemkit.contact.laws import Coulomb
from bemkit.contact.problem import ContactProblem
from bemkit.contact.solvability import find_unsolvable_load
from bemkit.solvers.base import StepRecord, solve
from bemkit.solvers.fallbacks import Fallbacks
from tests.contact.joined.blocks import wall
from tests.runs.masonry import wall as wall_assembly
from tests.runs.packing import packing

FRICTION = 0.6


def main(courses: int = 20, per_course: int = 50) -> None:
    """Print a line for each stage."""
    laps = [(time.process_time(), time.perf_counter())]

    def lap(words: str) -> None:
        laps.append((time.process_time(), time.perf_counter()))
        processor, clock = np.subtract(laps[-1], laps[-2])
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        print(f"{processor:8.2f} s  ({clock:7.2f} s)  {memory:6.2f} GB  {words}", flush=True)

    body = wall(courses, per_course, 8, gravity=(0.0, -1e-4), push=0.1 * FRICTION * 2 * per_course * 1e-4)
    problem = ContactProblem(body, np.zeros(body.n_contact), Coulomb(FRICTION))
    lap(f"{len(body.members)} blocks with {body.n_contact} contact pairs made")
    body.respond(stick(problem.gap, problem.gap))
    lap("one response, all tied")
    lap(f"programme of unsolvable loads: {find_unsolvable_load(problem)}")

    def shown(record: StepRecord) -> None:
        words = f"{record.n_separated} open, {record.n_slip} slip, certificate {record.certificate.worst:.0e}"
        lap(f"step {record.step}: {words} {record.message}")

    found = solve(problem, Fallbacks(), throw=False, callback=shown)
    lap(f"{found.status.name} after {found.linear_solves} responses")


def assembled(assembly: bk.Scene) -> None:
    """Print steps, stages and memory of an assembly."""
    begin = time.perf_counter()

    def shown(record: StepRecord) -> None:
        words = f"{record.n_separated} open, {record.n_slip} slip, certificate {record.certificate.worst:.0e}"
        now = f"{time.process_time():8.1f} s  ({time.perf_counter() - begin:7.1f} s)"
        print(f"{now}  step {record.step}: {words} {record.message}", flush=True)

    for solution in bk.run([assembly], callback=shown):
        stages = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in solution.timings.items())
        print(f"{solution!r}\n  {solution.linear_solves} responses: {stages}")
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"{time.perf_counter() - begin:.1f} s, {time.process_time():.1f} s of the processor, {memory:.2f} GB")


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    if "steps" in sys.argv:
        n_courses, per_course = numbers or (20, 50)
        push = 0.1 * FRICTION * 2 * per_course
        assembled(replace(wall_assembly(n_courses, per_course, push=True), load_factors=(0.0, push)))
    elif "packing" in sys.argv:
        discs, width, *seed = numbers or (200, 20)
        assembled(packing(discs, width, seed=sum(seed)))
    else:
        main(*numbers)
