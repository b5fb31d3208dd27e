"""Warnings: found, shown in yellow, and kept in JSON and result files."""

from __future__ import annotations

import dataclasses
import io
import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import bemkit as bk
from bemkit.cli.console import print_plan, print_summary
from bemkit.contact.laws import Coulomb, Frictionless
from bemkit.contact.obstacle import Gap, Obstacle, RigidHalfPlane
from bemkit.errors import ResultWarning, first_of_each_kind, without_duplicates
from bemkit.formulas import Expression
from bemkit.geometry.shapes import Rectangle
from bemkit.operators.material import Material
from bemkit.plan.plan import make_plan
from bemkit.results.result_file import read_result, write_result
from bemkit.results.solution import Solution
from bemkit.results.tables import to_json
from bemkit.results.warnings import FEWEST_NODES, find_warnings
from bemkit.runs.adaptive import run_adaptive
from bemkit.runs.run import run
from bemkit.scene.conditions import Clamped, Contact, Part, PrescribedDisplacement, Pressure, Roller, Traction
from bemkit.scene.discretisation import Galerkin, MeshOptions
from bemkit.scene.scene import Scene
from bemkit.scene.toml import load_scene, with_overrides
from bemkit.solvers.active_sets import NodeStatus
from bemkit.solvers.base import Status
from tests.scenes import paper
from tests.slow import slow_only
from tests.solutions import changed as changed_solution

WARNINGS = (
    ResultWarning("first", "part", "The first: do this.", 1.5),
    ResultWarning("second", "", "The second, with \N{GREEK SMALL LETTER NU} = 0.5."),
)


@pytest.fixture(scope="module")
def solution() -> Solution:
    found = run(with_overrides(load_scene("paper-1"), elements=40, discretisation="linear"))
    plan = dataclasses.replace(found.plan, warnings=WARNINGS[:1])
    return dataclasses.replace(found, plan=plan).with_warnings(WARNINGS)


def test_doubts_about_meshes_are_found_when_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def counted(solution: Solution) -> tuple[str, ...]:
        asked.append(solution.n_elements)
        return find_warnings(solution)

    monkeypatch.setattr("bemkit.runs.solution_of.find_warnings", counted)
    first, last = run_adaptive(paper(1, bk.Galerkin(2), MeshOptions(accuracy=3e-3, rising_degrees=True)))
    assert asked == []
    assert first.warnings == find_warnings(first)
    assert last.warnings == find_warnings(last)
    assert asked == [first.n_elements, last.n_elements]


LARGE = "outside the theory of small displacements: check the units"


@pytest.mark.parametrize("word", ["linear", "quadratic", "constant"])
@pytest.mark.parametrize(("stretch", "is_large"), [(0.09, False), (0.11, True)])
def test_large_strains_are_warned_of(word: str, stretch: float, is_large: bool) -> None:
    parts = (
        Part("left", PrescribedDisplacement(x=Expression("0 * y"), y=0.0), sides=("left",)),
        Part("right", PrescribedDisplacement(x=stretch, y=0.0), sides=("right",)),
    )
    scene = Scene(title="t", shape=Rectangle(1.0, 0.2), material=Material(1.0, 0.0), parts=parts)
    warnings = run(with_overrides(scene, elements=48, discretisation=word)).warnings
    assert sum(LARGE in sentence for sentence in map(str, warnings)) == is_large


def test_large_rotations_are_warned_of() -> None:
    turned = PrescribedDisplacement(x=Expression("0.02 * x - 0.2 * y"), y=Expression("0.2 * x"))
    parts = (Part("all", turned, sides=("left", "right")),)
    scene = Scene(title="t", shape=Rectangle(1.0, 1.0), material=Material(1.0, 0.3), parts=parts)
    warnings = run(with_overrides(scene, elements=24)).warnings
    assert any(words.startswith("Strains and rotations exceed 0.2") for words in map(str, warnings))


@pytest.mark.parametrize(
    ("side", "obstacle", "faces_away"),
    [
        ("top", RigidHalfPlane(), True),
        ("bottom", RigidHalfPlane(), False),
        ("bottom", Gap(0.1, direction=(0.0, 1.0)), True),
        ("bottom", Gap(0.1, direction=(0.0, -1.0)), False),
    ],
)
def test_contacts_that_face_away_from_their_obstacle_are_named(side: str, obstacle: Obstacle, faces_away: bool) -> None:
    parts = (
        Part("support", Clamped(), sides=("left",)),
        Part("end", Traction(y=-1e-3), sides=("right",)),
        Part("foot", Contact(obstacle, Frictionless()), sides=(side,)),
    )
    scene = Scene(title="t", shape=Rectangle(1.0, 1.0), material=Material(1.0, 0.3), parts=parts)
    words = [str(w) for w in run(with_overrides(scene, elements=16)).warnings if w.kind == "contact faces away"]
    assert [sentence.split(":")[0] for sentence in words] == ["Contact 'foot' can touch nowhere"] * faces_away


@pytest.mark.slow
def test_large_strains_of_one_body_of_several_are_warned_of() -> None:
    solution = run(with_overrides(load_scene("two-cylinders"), elements=40))
    assert isinstance(solution, Solution)
    assert not any(LARGE in words for words in map(str, find_warnings(solution)))
    name, body = next(iter(solution.bodies.items()))
    moved = dataclasses.replace(body.boundary, displacement=1e3 * body.boundary.displacement)
    bodies = {**solution.bodies, name: dataclasses.replace(body, boundary=moved)}
    doubts = [
        words for words in map(str, find_warnings(dataclasses.replace(solution, bodies=bodies))) if LARGE in words
    ]
    assert [words.split(":")[0] for words in doubts] == [f"Body '{name}'"]


@pytest.mark.parametrize(
    ("elements", "approach", "is_unseen"),
    slow_only([(8, 2e-4, True), (8, -2e-4, False), (96, 2e-2, False)], (96, 2e-2, False)),
)
def test_contact_that_falls_between_coarse_nodes_ends_by_name(elements: int, approach: float, is_unseen: bool) -> None:
    scene = with_overrides(load_scene("two-cylinders"), elements=elements, discretisation="linear")
    assert isinstance(scene, bk.Scene)
    upper, lower = scene.bodies
    pushed, tip = upper.parts
    pushed = dataclasses.replace(pushed, condition=PrescribedDisplacement(x=0.0, y=-approach))
    solution = run(dataclasses.replace(scene, bodies=(dataclasses.replace(upper, parts=(pushed, tip)), lower)))
    is_open = (solution.contact.status == NodeStatus.SEPARATED).all()
    assert is_open == (is_unseen or approach < 0.0)
    assert solution.status is (Status.MISSED_CONTACT if is_unseen else Status.CONVERGED)
    assert ("overlaps by 0.0002 at (" in solution.message) == is_unseen
    assert not any(str(words).startswith("Contact '") for words in solution.warnings)


def test_a_file_keeps_warnings(tmp_path: Path, solution: Solution) -> None:
    write_result(tmp_path / "r.h5", solution)
    again = read_result(tmp_path / "r.h5")
    assert (again.warnings, again.plan.warnings) == (WARNINGS, WARNINGS[:1])


def test_json_lists_warnings(solution: Solution) -> None:
    summary = json.loads(to_json(solution))
    assert summary["warnings"] == [
        {"kind": "first", "subject": "part", "text": "The first: do this.", "number": 1.5, "step": None},
        WARNINGS[1].as_dict(),
    ]
    assert summary["plan"]["warnings"] == [WARNINGS[0].as_dict()]


def test_the_summary_shows_warnings_in_yellow(solution: Solution) -> None:
    stream = io.StringIO()
    print_summary(solution, Console(file=stream, force_terminal=True, color_system="standard", width=200))
    lines = stream.getvalue().splitlines()
    # 33 is yellow in ISO 6429
    assert [line for line in lines if "warning" in line] == [f"\x1b[33mwarning: {words}\x1b[0m" for words in WARNINGS]


def test_the_plan_shows_warnings(capsys: pytest.CaptureFixture[str], solution: Solution) -> None:
    print_plan("title", solution.plan)
    assert f"warning: {WARNINGS[0]}" in capsys.readouterr().out


def test_a_plan_without_doubts_has_no_warnings() -> None:
    scene = load_scene("paper-1")
    assert make_plan(scene, scene.build_mesh()).warnings == ()


def bowl(approach: float = 1e-4, **changes: object) -> Scene:
    """A block pressed onto a parabola, with friction; at 24 linear elements three nodes are in contact."""
    parts = (
        Part("foot", Contact(Gap(Expression("0.02 * x**2"))), ("bottom",)),
        Part("top", PrescribedDisplacement(x=0.0, y=-approach), ("top",)),
    )
    scene = Scene(
        title="bowl", shape=Rectangle(2.0, 1.0, corner=(-1.0, 0.0)), material=Material(1.0, 0.3), parts=parts,
        law=Coulomb(0.1), discretisation=Galerkin(1), mesh=MeshOptions(elements=24),
    )  # fmt: skip
    return dataclasses.replace(scene, **changes)  # type: ignore[arg-type]


def test_a_contact_zone_of_few_nodes_is_doubted_once() -> None:
    solution = run(bowl())
    n_closed = solution.contact.n_contact - solution.contact.status_words().count("separated")
    assert 0 < n_closed < FEWEST_NODES
    narrow = [words for words in map(str, solution.warnings) if " zone of part 'foot' at s = " in words]
    assert len(narrow) == 1
    assert narrow[0].startswith("A contact zone")
    assert f"has only {n_closed} node" in narrow[0]


def test_a_separated_zone_between_contact_zones_is_doubted() -> None:
    fine = run(bowl(1e-2, mesh=MeshOptions(elements=120, density={"bottom": 4.0})))
    table = fine.contact
    status, clearance, pressure = table.status.copy(), table.clearance.copy(), table.sigma_n.copy()
    hole = np.flatnonzero(status != NodeStatus.SEPARATED)[5:7]
    status[hole], clearance[hole], pressure[hole] = NodeStatus.SEPARATED, 1e-3, 0.0
    changed = dataclasses.replace(table, status=status, clearance=clearance, sigma_n=pressure)
    (words,) = [
        words
        for words in map(str, find_warnings(dataclasses.replace(fine, contact=changed)))
        if words.startswith("A separated zone")
    ]
    assert f"of part 'foot' at s = {table.s[hole].mean():.4g} has only 2 nodes" in words
    assert not [words for words in map(str, fine.warnings) if words.startswith("A separated zone")]


def test_a_gap_between_nodes_that_press_is_doubted() -> None:
    """A notch as long as an element, between two nodes of a flat floor."""
    solution = run(bowl(mesh=MeshOptions(elements=24)))
    (between,) = solution.contacts_between_nodes.values()
    apart = dataclasses.replace(between, penetration=0.0, complementarity=0.3)
    changed = dataclasses.replace(solution)
    changed.__dict__["contacts_between_nodes"] = {"foot": apart}
    words = "Contact 'foot': the sides are apart between nodes that press each other (30 % of the displacement that"
    assert any(text.startswith(words) for text in map(str, find_warnings(changed)))


def test_a_state_without_contact_has_no_zones_and_one_without_load_is_doubted() -> None:
    idle = run(bowl(0.0))
    assert idle.is_converged
    assert [warning.kind for warning in idle.warnings] == ["no load"]
    assert str(idle.warnings[0]) == "Nothing loads or moves the bodies: give a load or a displacement."


def test_a_stick_zone_of_few_nodes_is_doubted_unless_there_is_no_friction() -> None:
    fine = run(bowl(1e-2, mesh=MeshOptions(elements=120, density={"bottom": 4.0})))
    assert not [words for words in map(str, fine.warnings) if words.startswith("A contact zone")]
    table = fine.contact
    status = np.where(table.status == NodeStatus.SEPARATED, table.status, NodeStatus.SLIP_FORWARD)
    closed = np.flatnonzero(status != NodeStatus.SEPARATED)
    status[closed[4:6]] = NodeStatus.STICK
    changed = dataclasses.replace(fine, contact=dataclasses.replace(table, status=status))
    (words,) = [words for words in map(str, find_warnings(changed)) if " zone of part " in words]
    place = table.s[closed[4:6]].mean()
    assert words.startswith(f"A stick zone of part 'foot' at s = {place:.4g} has only 2 nodes: use more")
    status = status.copy()
    status[closed[8]] = NodeStatus.STICK
    twice = dataclasses.replace(fine, contact=dataclasses.replace(table, status=status))
    assert any("2 nodes, and 1 more zone like it" in words for words in map(str, find_warnings(twice)))
    smooth = changed_solution(changed, scene=dataclasses.replace(fine.scene, law=Frictionless()))
    assert not [words for words in map(str, find_warnings(smooth)) if " zone of part " in words]


def test_a_large_estimated_error_is_doubted(solution: Solution) -> None:
    assert solution.estimated_error is not None
    energy = solution.energy * (solution.estimated_error / 0.06) ** 2
    words = "The estimated error is 6 %: use more elements, or give an accuracy."
    assert words in map(str, find_warnings(changed_solution(solution, energy=energy)))
    fine = changed_solution(solution, energy=4.0 * energy)
    assert not [words for words in map(str, find_warnings(fine)) if "estimated error" in words]


def test_an_accuracy_is_advised_only_where_meshes_can_follow_it() -> None:
    paper = with_overrides(load_scene("paper-1"), elements=24, discretisation="linear")
    for scene, is_possible in (
        (paper, True),
        (with_overrides(paper, discretisation="constant"), False),
        (with_overrides(load_scene("rough-surface"), elements=16), False),
    ):
        (words,) = {words.split(": ")[-1] for words in map(str, run(scene).warnings) if " zone of part " in words}
        assert words == f"use more elements there{', or give an accuracy' if is_possible else ''}."


def test_a_smaller_accuracy_is_advised_where_one_was_reached(solution: Solution) -> None:
    energy = solution.energy * (solution.estimated_error / 0.06) ** 2  # type: ignore[operator]
    for status, words in (
        (Status.CONVERGED, "give a smaller accuracy"),
        (Status.ACCURACY_NOT_REACHED, "allow more elements"),
    ):
        scene = dataclasses.replace(solution.scene, mesh=MeshOptions(accuracy=0.1))
        found = changed_solution(dataclasses.replace(solution, status=status, scene=scene), energy=energy)
        assert f"The estimated error is 6 %: {words}." in map(str, find_warnings(found))


def test_a_pressure_that_strains_nothing_has_no_error() -> None:
    """All around an incompressible body: displacements and energy are round-off, of either sign."""
    confined = Scene(
        title="Confined block",
        shape=Rectangle(1.0, 1.0),
        material=Material(1.0, 0.5),
        parts=(
            Part("floor", Contact(RigidHalfPlane()), sides=("bottom",)),
            Part("walls", Roller(), sides=("left", "right")),
            Part("top", Pressure(0.01), sides=("top",)),
        ),
        discretisation=Galerkin(1),
        mesh=MeshOptions(elements=40),
    )
    found = run(confined)
    assert found.estimated_error == 0.0
    assert not found.warnings


def test_an_estimate_that_cannot_be_made_is_doubted(solution: Solution) -> None:
    lost = changed_solution(solution, energy=-1e-9)
    assert lost.estimated_error is None
    assert lost.summary()["estimated_error"] is None
    assert any(
        "No error could be estimated, because the elastic energy, -1e-09" in w for w in map(str, find_warnings(lost))
    )
    collocation = run(with_overrides(load_scene("paper-1"), elements=40, discretisation="constant"))
    assert not [
        words for words in map(str, find_warnings(changed_solution(collocation, energy=-1.0))) if "estimate" in words
    ]


def test_a_held_side_of_one_element_is_doubted() -> None:
    block = Scene(
        title="block", shape=Rectangle(8.0, 1.0), material=Material(1.0, 0.3), discretisation=Galerkin(1),
        parts=(Part("wall", Clamped(), ("left",)), Part("load", Traction(x=1.0), ("right",))),
        mesh=MeshOptions(elements=18),
    )  # fmt: skip
    words = "Part 'wall' has 1 element, too few to estimate the error of its reactions: use more elements there."
    assert words in map(str, run(block).warnings)
    assert not [
        w for w in map(str, run(dataclasses.replace(block, mesh=MeshOptions(elements=72))).warnings) if "Part" in w
    ]


def test_a_failed_solve_has_the_warnings_of_its_plan_alone(solution: Solution) -> None:
    failed = changed_solution(solution, status=Status.STALLED, energy=-1.0)
    assert find_warnings(failed) == solution.plan.warnings


def test_a_load_history_keeps_the_warnings_of_all_its_steps() -> None:
    scene = bowl(load_factors=(1.0, 30.0))
    steps = run([scene])
    assert steps[0].warnings
    # warnings that differ in numbers alone are said once, as of the last step
    assert set(run(scene).warnings) == set(without_duplicates((*steps[1].warnings, *steps[0].warnings)))


@pytest.mark.parametrize(("elements", "degrees"), [(8, 90), (16, None)])
def test_elements_that_go_around_a_quarter_of_a_circle_are_doubted(elements: int, degrees: int | None) -> None:
    squeeze = bk.Part("squeeze", bk.Pressure(bk.Expression("x**2")), sides=tuple(f"outer-{k}" for k in range(1, 5)))
    scene = bk.Scene(
        title="ring",
        shape=bk.Ring(0.9, 1.0),
        material=bk.Material(1.0, 0.3),
        parts=(squeeze,),
        symmetry=bk.Symmetry(x=0.0, y=0.0),
        mesh=bk.MeshOptions(elements=elements),
    )
    found = [warning for warning in map(str, bk.run(scene).warnings) if "turns by" in warning]
    assert [f"turns by {degrees} degrees on one element" in warning for warning in found] == [True] * bool(degrees)


@pytest.mark.parametrize(("elements", "is_doubted"), [(4, True), (8, False)])
def test_elements_that_stand_alone_have_no_estimate(elements: int, is_doubted: bool) -> None:
    scene = bk.Scene(
        title="block",
        shape=bk.Rectangle(1.0, 1.0),
        material=bk.Material(1.0, 0.3),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
            bk.Part("load", bk.Traction(y=-1e-3), sides=("top",)),
        ),
        mesh=bk.MeshOptions(elements=elements),
    )
    assert (
        any("100 % of the boundary consists of pieces" in warning for warning in map(str, bk.run(scene).warnings))
        == is_doubted
    )


@pytest.mark.parametrize(("slopes", "turn", "warns"), [(False, 1e-3, True), (False, 1e-5, False), (True, 1e-3, False)])
def test_rotation_that_plain_constant_elements_take_for_strain(*, slopes: bool, turn: float, warns: bool) -> None:
    """A block of E = 1, pulled by 1e-4 while its top turns."""
    motion = PrescribedDisplacement(x=Expression(f"-{turn} * y"), y=Expression(f"{turn} * x"))
    floor, top = Part("floor", Contact(Gap(1e-2)), sides=("bottom",)), Part("top", motion, sides=("top",))
    scene = Scene(
        title="turned",
        shape=Rectangle(1.0, 1.0),
        material=Material(1.0, 0.3),
        parts=(floor, top, Part("pull", Traction(x=1e-4), sides=("right",))),
        law=Frictionless(),
        mesh=MeshOptions(40),
        discretisation=bk.ConstantCollocation(slopes=slopes),
    )
    doubts = [words for words in map(str, find_warnings(run(scene))) if "mistaken for strain" in words]
    assert len(doubts) == warns
    assert not warns or doubts[0].startswith("The body rotates by 0.001")


def test_the_first_warning_of_each_kind_and_subject_is_kept() -> None:
    steps = [
        ResultWarning("narrow slip zone", "side-1", "A slip zone at s = 0.1.", 3),
        ResultWarning("narrow slip zone", "side-1", "A slip zone at s = 0.2.", 1),
        ResultWarning("narrow slip zone", "side-2", "A slip zone at s = 0.2.", 1),
        ResultWarning("narrow stick zone", "side-1", "A stick zone.", 2),
    ]
    assert without_duplicates(steps) == (steps[0], *steps[2:])


def test_two_corners_and_two_parts_keep_a_warning_each_in_a_load_history() -> None:
    """Texts that differ in digits only were once taken for one warning."""
    scene = Scene(
        title="block", shape=Rectangle(8.0, 1.0), material=Material(1.0, 0.3), discretisation=Galerkin(1),
        parts=(
            Part("side-1", Clamped(), ("left",)),
            Part("side-2", PrescribedDisplacement(x=1e-3, y=0.0), ("right",)),
            Part("floor", Contact(Gap(1.0)), ("bottom",)),
        ),
        mesh=MeshOptions(elements=18), load_factors=(0.5, 1.0),
    )  # fmt: skip
    kind = "held part with few elements"
    assert [each.subject for each in run(scene).warnings if each.kind == kind] == ["side-1", "side-2"]


def test_three_warnings_of_a_kind_are_listed_and_the_others_counted() -> None:
    alike = [ResultWarning("large strain", f"body-{number}", "Strains.") for number in range(6)]
    other = ResultWarning("moved contact", "floor", "Moved.")
    (*listed, more, last) = first_of_each_kind([*alike, other])
    assert (listed, last) == (alike[:3], other)
    assert (more.text, more.number) == ("3 more warnings of this kind: large strain.", 3)


def test_warnings_of_an_earlier_step_name_it() -> None:
    """The roll is lifted again: the last state is without contact, and its zones are those of the first step."""
    scene = bk.Scene(
        title="roll",
        shape=bk.Sector(1.0, 180.0, 360.0),
        material=bk.Material(1.0, 0.3),
        law=bk.Coulomb(0.3),
        parts=(
            bk.Part("load", bk.PrescribedDisplacement(x=0.0, y=-1e-2), ("start", "end")),
            bk.Part("tip", bk.Contact(bk.RigidHalfPlane((0, -1))), ("arc",)),
        ),
        steps=(bk.Step(1.0), *(bk.Step(t, {"parts.load.condition.y": 1e-3}) for t in (2.0, 3.0))),
        discretisation=bk.Galerkin(1),
        mesh=bk.MeshOptions(elements=40),
    )
    solution = bk.run(scene)
    assert solution.is_converged
    assert not solution.contact.sigma_n.any()
    zones = [warning for warning in solution.warnings if "contact zone" in str(warning)]
    assert {zone.step for zone in zones} == {1}
    assert all(str(zone).startswith("Load step 1 of 3: A contact zone of part 'tip'") for zone in zones)
