"""Times and memory of a wall of many blocks: ``python -m tests.benchmarks.masonry [courses] [blocks a course]``.

One sticking response, the programme that finds unsolvable loads, and a whole solve under weight and a push on the
uppermost course of a tenth of what friction holds. Times are those of the processor and, in brackets, of the clock.
"""

import resource
import sys
import time

import numpy as np

from bemkit.contact.conditions import stick
from bemkit.contact.laws import Coulomb
from bemkit.contact.problem import ContactProblem
from bemkit.contact.solvability import find_unsolvable_load
from bemkit.solvers.base import StepRecord, solve
from bemkit.solvers.ssn import SemismoothNewton
from tests.contact.joined.blocks import wall

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

    found = solve(problem, SemismoothNewton(), throw=False, callback=shown)
    lap(f"{found.status.name} after {found.linear_solves} responses")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
