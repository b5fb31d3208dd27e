"""Random scenes that were once solved or judged wrongly, kept as scene files whatever the generator draws today."""

from __future__ import annotations

from pathlib import Path

import pytest

import bemkit as bk
from checks.random_scenes import RandomCase
from checks.trials import Outcome, judge, solved_steps

SCENES = Path(__file__).parent / "scenes"
RIGHT = (Outcome.SUCCESS, Outcome.WARNED)
SLOW = pytest.mark.slow


def outcome_of(name: str) -> tuple[Outcome, str]:
    paths = sorted(SCENES.glob(f"{name}-step-*.toml")) or [SCENES / f"{name}.toml"]
    try:
        case = RandomCase(0, 0, tuple(bk.load_scene(path) for path in paths))
        outcome, reason, message = judge(solved_steps(case))
    except bk.BemkitError as error:
        return Outcome.NAMED, str(error)
    return outcome, f"{reason}: {message}"


@pytest.mark.parametrize(
    ("name", "outcomes"),
    [
        ("unloaded-without-strain", [Outcome.NAMED]),  # a corner of the obstacle lies between two nodes
        ("tip-of-a-wedge", [Outcome.NAMED]),  # a half-plane slides along the slopes of a wedge
        pytest.param("no-shear", RIGHT, marks=SLOW),
        pytest.param("carried-along", RIGHT, marks=SLOW),
        # whether a node touches at all is decided by round-off; its overlap between nodes is warned of or named
        pytest.param("contact-between-nodes", [Outcome.WARNED, Outcome.NAMED], marks=SLOW),
        # along a circle, by a fifth of the size of the plate
        pytest.param("far-fall-far-away", [Outcome.NAMED], marks=SLOW),
        # a half-plane 161 wide, whose gaps are zero but for -4e-15, after a motion of 1e-4 without contact
        pytest.param("back-at-rest", RIGHT, marks=SLOW),
        # its overlap ended within 1e-9 of the way, which was 2e-6 of the deformation
        pytest.param("pushed-aside", RIGHT, marks=SLOW),
        pytest.param("wedge", [Outcome.NAMED], marks=SLOW),  # two nodes on each flank, which overlaps between them
        pytest.param("blocks-of-degree-4", RIGHT, marks=SLOW),
        pytest.param("stiff-pairs", RIGHT, marks=SLOW),
        # a disc between two nodes of the block above it
        pytest.param("discs-let-go", [Outcome.NAMED], marks=SLOW),
        # contacts slide farther than small displacements describe
        pytest.param("heavy-disc", [Outcome.NAMED], marks=SLOW),
        pytest.param("one-node-that-carries-all", [Outcome.NAMED], marks=SLOW),
        # three nodes carry a block, which overlaps between them
        pytest.param("history-of-collocation", [Outcome.NAMED], marks=SLOW),
        pytest.param("history-of-increments", [Outcome.NAMED], marks=SLOW),
        pytest.param(
            "touches-between-nodes", [Outcome.WARNED, Outcome.NAMED], marks=SLOW
        ),  # a disc of constant elements, likewise
        pytest.param("ends-that-differ-by-round-off", [Outcome.WARNED], marks=SLOW),
        ("nothing-holds", [Outcome.NAMED]),  # a block that touches nothing, and two without support
        pytest.param("wedge-let-go", [Outcome.WARNED], marks=SLOW),  # round-off of the load before
        pytest.param("pin-that-spins", [Outcome.WARNED], marks=SLOW),  # of quadratic elements that turn by 90 degrees
        pytest.param(
            "pushed-between-nodes", [Outcome.NAMED], marks=SLOW
        ),  # a disc whose nodes do not meet the block that moves into it
        pytest.param("lining-held-by-its-mesh", [Outcome.NAMED], marks=SLOW),
        ("missed-contact-fixed-mesh", [Outcome.NAMED]),  # half a disc between two nodes of its arc
        pytest.param("missed-contact-hp", RIGHT, marks=SLOW),
        # the contact is found; the tractions stay at 1.7e-3 where 1e-3 is asked for
        pytest.param("missed-contact-tilted-plane", [*RIGHT, Outcome.NAMED], marks=SLOW),
        ("punch-drawn-inside", [Outcome.WARNED]),  # polygon edges had no distance
        ("overlapping-blocks", [Outcome.NAMED]),  # beside the contact between them
        ("part-without-rows", [Outcome.WARNED]),  # without any load
        # a node with the length of an element whose other end belongs to a second contact
        ("held-corner-beside-a-contact", [Outcome.WARNED]),
        # normals and gaps have the round-off of coordinates
        ("roller-far-away", [Outcome.WARNED]),
        pytest.param("let-go-far-away", RIGHT, marks=SLOW),
        pytest.param("pierced-by-a-corner", [Outcome.NAMED], marks=SLOW),  # of an obstacle, by 1e-5 of an element
        pytest.param("grazes-a-cavity", [Outcome.NAMED], marks=SLOW),  # at the end of an element that faces away
        pytest.param("ring-that-spins", [Outcome.NAMED], marks=SLOW),  # by more than its size: finite sliding
    ],
)
def test_scenes_that_once_failed_are_judged_right(name, outcomes) -> None:
    outcome, message = outcome_of(name)
    assert outcome in outcomes, message
