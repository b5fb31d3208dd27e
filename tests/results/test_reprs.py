"""What a session shows of results: one line each, whatever they hold."""

from __future__ import annotations

import dataclasses

import pytest

import bemkit as bk


def test_results_show_themselves_in_a_line() -> None:
    mesh = bk.MeshOptions(elements=40)
    solution = bk.run(dataclasses.replace(bk.load_scene("paper-1"), mesh=mesh))
    shown = "Solution('Square on a rigid foundation, paper Example 1': converged, 40 elements, 10 contact nodes)"
    assert repr(solution) == shown
    assert repr(solution.mesh) == "BoundaryMesh(40 elements, foundation (10), wall (10), top-load (5), left-load (5))"
    assert repr(solution.boundary) == "BoundaryFields(40 points, 40 elements)"
    counts = {word: solution.contact.status_words().count(word) for word in ("separated", "slip", "stick")}
    assert repr(solution.contact) == f"ContactTable(10 nodes: {', '.join(f'{n} {w}' for w, n in counts.items())})"


def test_a_table_shows_its_size_and_prints_its_rows() -> None:
    solution = bk.run(dataclasses.replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=40)))
    assert repr(solution.forces) == "Table(4 rows: name, force_x, force_y, moment)"
    assert str(solution.forces).splitlines()[2].startswith("| foundation | 0.0")


def test_a_plan_prints_its_items() -> None:
    plan = bk.make_plan(bk.load_scene("paper-1"))
    assert repr(plan).startswith("Plan(320 elements, ")
    assert "symmetry: skipped, not asked for" in str(plan).splitlines()
    assert len(str(plan).splitlines()) == 1 + len(plan.items)


def test_contacts_are_found_by_name() -> None:
    solution = bk.run(dataclasses.replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=40)))
    assert solution.contacts["foundation"] is solution.contacts[0]
    assert solution.contacts[:1] == solution.contacts
    with pytest.raises(bk.BemkitError, match="no contact 'fundation': there are foundation; did you mean 'foundation'"):
        solution.contacts["fundation"]


def test_without_contact_nothing_is_said_of_it() -> None:
    solution = bk.run(dataclasses.replace(bk.load_scene("bending"), mesh=bk.MeshOptions(elements=20)))
    assert "contact nodes" not in repr(solution)
    assert repr(solution.contact) == "ContactTable(0 nodes)"
    assert repr(bk.discretise(bk.Disk(1.0).outline(), n_elements=8)) == "BoundaryMesh(8 elements)"


def test_load_steps_show_themselves_in_a_line_and_are_a_tuple() -> None:
    scene = dataclasses.replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=40), load_factors=(0.5, 1.0))
    steps = bk.run([scene])
    title = "Square on a rigid foundation, paper Example 1"
    assert repr(steps) == f"SolvedSteps('{title}': 2 steps, the last one converged)"
    assert isinstance(steps, tuple)
    assert steps == tuple(steps)
    assert len(repr(steps[-1].loading)) < 80
    assert len(repr(steps[-1].loading.steps[0])) < 500
