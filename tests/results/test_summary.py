"""The numbers of a result: the same, with units, in summary, report, notebook, JSON and tables."""

from __future__ import annotations

import csv
import html
import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from rich.console import Console

import bemkit as bk
from bemkit.cli.console import print_summary
from bemkit.report.page import report
from bemkit.results.summary_rows import DIGITS, summary_rows
from bemkit.results.tables import table_of, to_csv, to_json
from bemkit.scene.toml import load_scene, with_overrides

UNITS = bk.UnitNames("mm", "MPa")


def blocks() -> bk.Scene:
    """Return a block that a force presses on another one, both of a thickness."""
    block = bk.Body(
        name="upper",
        shape=bk.Rectangle(1.0, 1.0),
        material=bk.Material(1e4, 0.3),
        parts=(bk.Part("top", bk.Force(20.0, -400.0, 3.0), ("top",)),),
        placement=bk.Placement(shift=(0.5, 1.0)),
    )
    base = bk.Part("base", bk.Clamped(), ("bottom",))
    lower = replace(block, name="lower", shape=bk.Rectangle(2.0, 1.0), parts=(base,), placement=bk.Placement())
    pair = bk.ContactPair(("upper.bottom", "lower.top"))
    return bk.Scene(
        title="Blocks",
        bodies=(lower, block),
        contacts=(pair,),
        law=bk.Coulomb(0.3),
        mesh=bk.MeshOptions(elements=24),
        thickness=10.0,
    )


def history() -> bk.Scene:
    """A block is pressed down and dragged along its floor in two increments."""
    loop = with_overrides(bk.load_scene("friction-loop"), elements=24)
    press, drag = loop.steps
    return replace(loop, steps=(press, replace(drag, increments=2)))


SCENES: dict[str, Callable[[], bk.Scene]] = {
    "obstacle": lambda: with_overrides(bk.load_scene("paper-1"), elements=40),
    "bodies": blocks,
    "rigid body": lambda: bk.load_scene("wedged-leg"),
    "driven rigid body": lambda: with_overrides(bk.load_scene("tilted-punch"), elements=24),
    "half-plane": lambda: with_overrides(bk.load_scene("cylinder-on-half-plane"), elements=24),
    "history": history,
}


@pytest.fixture(scope="module", params=SCENES)
def solution(request: pytest.FixtureRequest) -> bk.Solution:
    return bk.run(replace(SCENES[request.param](), units=UNITS))


def text_of(page: str) -> str:
    return re.sub(r"\s+", " ", html.unescape(re.sub("<[^>]+>", " ", page)))


def test_all_ways_out_have_the_same_rows(solution: bk.Solution, without: Callable[..., None]) -> None:
    without("matplotlib")  # pictures have no rows and take seconds
    stream = io.StringIO()
    print_summary(solution, Console(file=stream, width=1000, highlight=False))
    printed = re.sub(r"\s+", " ", stream.getvalue())
    page, notebook = text_of(report(solution)), text_of(solution._repr_html_())
    lines = re.sub(r"\s+", " ", str(solution))
    for name, text in summary_rows(solution):
        for line in text.split("\n"):
            shown = re.sub(r"\s+", " ", line)
            assert shown in printed, name
            assert shown in page, name
            assert shown in notebook, name
            assert shown in lines, name


def test_the_numbers_of_the_summary_are_those_of_json(solution: bk.Solution) -> None:
    text, summary = str(solution), json.loads(to_json(solution))
    names = summary["units"]

    def shown(value: float, quantity: str) -> str:
        return f"{value:.{DIGITS}g} {names[quantity]}"

    def pair(x: float, y: float, quantity: str) -> str:
        return f"({x:.{DIGITS}g}, {y:.{DIGITS}g}) {names[quantity]}"

    expected = [shown(summary["energy"], "energy")]
    largest_force = max(abs(part[key]) for part in summary["parts"] for key in ("force_x", "force_y"))

    farthest = max(float(np.hypot(*body.mesh.nodes.T).max()) for body in solution.bodies.values())

    def cleaned(force: float, distance: float = 1.0) -> float:
        return 0.0 if abs(force) <= solution.certificate.round_off * largest_force * distance else force

    expected += [shown(cleaned(summary[key]), "force") for key in ("force_normal", "force_tangential")]
    largest = sorted(summary["contacts"], key=lambda contact: -contact["force_normal"])[:8]
    for contact in largest:
        expected += [shown(cleaned(contact[key]), "force") for key in ("force_normal", "force_tangential")]
        expected += [
            f"{shown(contact['contact_length'], 'length')} ({100.0 * contact['contact_fraction']:.4g} %)",
            f"{shown(contact['peak_pressure'], 'stress')} at {pair(contact['peak_x'], contact['peak_y'], 'length')}",
            shown(contact["largest_slip"], "length"),
        ]
    for body in list(summary["rigid"].values())[:8]:
        expected += [pair(body["x"], body["y"], "length"), f"{body['turn']:.{DIGITS}g} rad"]
        expected += [
            pair(cleaned(body["force_x"]), cleaned(body["force_y"]), "force"),
            f"moment {shown(cleaned(body['moment'], farthest), 'energy')}",
        ]
    for fact in summary["parts"][:8]:
        expected += [
            pair(cleaned(fact["force_x"]), cleaned(fact["force_y"]), "force"),
            f"moment {shown(cleaned(fact['moment'], farthest), 'energy')}",
        ]
    for place in summary["transitions"][:6]:
        expected.append(f"{pair(place['x'], place['y'], 'length')}, s = {shown(place['s'], 'length')}")
    for key in ("external_work", "dissipation") if summary["steps"] else ():
        expected.append(shown(sum(step[key] for step in summary["steps"]), "energy"))
    for number in expected:
        assert number in text


def test_the_tables_are_those_of_json(solution: bk.Solution) -> None:
    summary = json.loads(to_json(solution))
    assert rows_of(to_csv(solution, "forces")) == [texts(part) for part in summary["parts"]]
    if summary["steps"]:
        assert rows_of(to_csv(solution, "steps")) == [texts(step) for step in summary["steps"]]
        last = summary["steps"][-1]
        assert [last[key] for key in ("force_normal", "force_tangential", "elastic_energy")] == [
            summary[key] for key in ("force_normal", "force_tangential", "energy")
        ]
    table = table_of(solution, "contact").as_dicts()
    weights = solution.contact.weight * (summary["thickness"] or 1.0)
    for contact in summary["contacts"]:
        own = [(row, weight) for row, weight in zip(table, weights, strict=True) if row["part"] == contact["name"]]
        assert contact["peak_pressure"] == max(-row["sigma_n"] for row, _ in own)
        # sums in another order differ by round-off
        assert contact["force_normal"] == pytest.approx(-sum(weight * row["sigma_n"] for row, weight in own), rel=1e-12)
    for key in ("force_normal", "force_tangential"):
        assert summary[key] == pytest.approx(sum(contact[key] for contact in summary["contacts"]), rel=1e-12)


def test_a_part_in_contact_carries_what_its_contacts_do(solution: bk.Solution) -> None:
    """With the same digits on the side with the nodes, and the opposite force on its partner."""
    parts = {(part.get("body", ""), part["name"]): part for part in json.loads(to_json(solution))["parts"]}
    contacts = {contact.name: contact for contact in solution.contacts}
    for name, (side, *partners) in solution.contact_sides.items():
        keys = ("force_x", "force_y", "moment")
        found = [[parts[tuple(each)][key] for key in keys] for each in (side, *partners)]
        assert found[0] == [getattr(contacts[name], key) for key in keys]
        for other in found[1:]:
            assert other == pytest.approx([-value for value in found[0]], rel=1e-9, abs=1e-12 * max(map(abs, found[0])))


def test_bodies_are_in_equilibrium_to_round_off(solution: bk.Solution) -> None:
    """Forces and moments of the parts of each body, whose weight is zero here; a half-plane is held far away."""
    for body in solution.bodies.values():
        if body.mesh.surface is None:
            forces = [(part.force_x, part.force_y, part.moment) for part in body.part_forces]
            size = max(abs(value) for force in forces for value in force)
            assert [sum(values) for values in zip(*forces, strict=True)] == pytest.approx([0.0] * 3, abs=1e-9 * size)


def test_the_tables_of_the_report_are_those_of_json(solution: bk.Solution, without: Callable[..., None]) -> None:
    without("matplotlib")
    summary, page = json.loads(to_json(solution)), report(solution)
    for caption, key in (
        ("What each contact transmits", "contacts"),
        ("Resultants on each part", "parts"),
        ("Where the contact status changes", "transitions"),
    ):
        found = re.search(rf"<caption>{caption}</caption>(.*?)</table>", page, re.DOTALL)
        assert (found is None) == (not summary[key])
        if found is None:
            continue
        heads = re.findall(r"<th\b[^>]*>(.*?)</th>", found[1])
        assert heads == [with_unit_of(name, summary["units"]) for name in summary[key][0]]
        cells = [html.unescape(cell) for cell in re.findall(r"<td\b[^>]*>(.*?)</td>", found[1])]
        values = [value for row in summary[key] for value in row.values()]
        assert cells == [f"{value:.6g}" if isinstance(value, float) else str(value) for value in values]


def with_unit_of(name: str, units: dict[str, str]) -> str:
    quantity = {"force": "force", "moment": "energy", "contact_length": "length", "peak_pressure": "stress"} | {
        key: "length" for key in ("peak_x", "peak_y", "largest_slip", "x", "y", "s")
    }
    found = quantity.get(name) or quantity.get(name.split("_")[0])
    return name.replace("_", " ") + (f" [{units[found]}]" if found else "")


@pytest.mark.parametrize("table", ["contact", "boundary", "forces", "steps"])
def test_every_number_of_a_table_has_the_unit_of_the_scene(solution: bk.Solution, table: str) -> None:
    if table == "steps" and solution.loading is None:
        return
    found, units = table_of(solution, table), solution.summary()["units"]
    for head in found.columns:
        is_number = isinstance(found.values(head.name)[0], float)
        assert head.unit in ({"s"} if head.name == "time" else set(units.values()) if is_number else {""}), head.name


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def texts(row: dict[str, object]) -> dict[str, str]:
    return {key: str(value) for key, value in row.items()}


def test_the_peak_is_where_the_contact_table_has_it(solution: bk.Solution) -> None:
    table = table_of(solution, "contact")
    for contact in solution.summary()["contacts"]:
        rows = [row for row in table.as_dicts() if row["part"] == contact["name"]]
        (peak,) = [row for row in rows if (row["x"], row["y"]) == (contact["peak_x"], contact["peak_y"])][:1]
        assert -peak["sigma_n"] == max(-row["sigma_n"] for row in rows)
        assert 0.0 <= contact["contact_fraction"] <= 1.0 + 1e-12


def test_a_solution_is_explored(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    solution = bk.run(with_overrides(bk.load_scene("paper-1"), elements=24))
    figure = solution.plot("traction")
    assert isinstance(figure, Figure)
    assert figure._repr_png_()[:4] == b"\x89PNG"  # what a notebook shows
    assert isinstance(solution.plot("von-mises"), Figure)
    solution.save(tmp_path / "r.json")
    assert json.loads((tmp_path / "r.json").read_text("utf-8"))["converged"]
    assert list(solution.to_pandas()["sigma_n"]) == solution.contact.sigma_n.tolist()
    assert list(solution.to_pandas("forces")["name"]) == [force.name for force in solution.part_forces]
    with pytest.raises(bk.InputError, match="'tresca' is not a picture"):
        solution.plot("tresca")
    with pytest.raises(bk.InputError, match="part is 'roof': name one of the contacts 'foundation'"):
        solution.plot("traction", "roof")
    with pytest.raises(bk.InputError, match="there is no picture 'friction-loop'"):
        solution.plot("friction-loop")


@pytest.mark.parametrize(
    ("name", "x_sign"), [("paper-1", 1.0), ("cylinder-on-half-plane", -1.0), ("two-cylinders", 0.0)]
)
def test_friction_names_its_direction_along_x(name: str, x_sign: float) -> None:
    """The boundary runs to the right below a body, to the left along the surface of a half-plane."""
    solution = bk.run(with_overrides(load_scene(name), elements=64))
    words = dict(summary_rows(solution))["friction force"].split(", ")[1]
    assert words == {1.0: "towards +x", -1.0: "towards -x", 0.0: "along the boundary"}[x_sign]
    if x_sign:
        (part,) = solution.contact.parts
        (force,) = (fact for fact in solution.part_forces if fact.name == part)
        assert x_sign * solution.force_tangential == pytest.approx(force.force_x, rel=1e-9)


def test_a_contact_without_force_has_no_place_of_its_peak() -> None:
    floor = bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",))
    parts = (floor, bk.Part("top", bk.PrescribedDisplacement(0.0, 1e-3), sides=("top",)))
    scene = bk.Scene(
        title="lifted", shape=bk.Rectangle(1.0, 1.0), material=bk.Material(1.0, 0.3), parts=parts,
        mesh=bk.MeshOptions(elements=16),
    )  # fmt: skip
    assert dict(summary_rows(bk.run(scene)))["peak pressure"] == "0"


def test_round_off_is_zero_in_the_summary() -> None:
    """The block of Example 1 on a frictionless floor, pressed in its middle: no friction, no force along x."""
    floor = bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), ("bottom",))
    punch = bk.Part("punch", bk.PrescribedDisplacement(x=0.0, y=-1e-3), ("top",))
    material, law = bk.Material(1e4, 0.2), bk.Coulomb(0.5)
    block = bk.Rectangle(1.0, 1.0, (-0.5, 0.0))
    solution = bk.run(bk.Scene(title="t", shape=block, material=material, parts=(floor, punch), law=law))
    rows = dict(summary_rows(solution))
    assert 0.0 < abs(solution.forces.as_dicts()[0]["force_x"]) < 1e-12
    assert rows["force on floor"].startswith("(0, ")
    assert rows["force on floor"].endswith("moment 0")
    assert rows["friction force"].startswith("0 ")


def test_supports_come_first_where_there_are_many_parts() -> None:
    square = bk.Body(name="stone", shape=bk.Rectangle(1.0, 1.0), material=bk.Material(1e9, 0.2))
    stone = replace(square, body_forces=(bk.Gravity(1800.0),), copies=bk.GridCopies(rows=3, step=(0.0, 1.0)))
    base = bk.Part("base", bk.Clamped(), ("bottom",))
    ground = replace(square, name="ground", parts=(base,), placement=bk.Placement((0.0, -1.0)))
    mesh, law = bk.MeshOptions(elements=16), bk.Coulomb(0.6)
    scene = bk.Scene(title="Wall", bodies=(stone, ground), touching=bk.Touching(0.01), law=law, mesh=mesh)
    names = [name for name, _ in summary_rows(bk.run(scene)) if name.startswith("force on ")]
    assert names[0] == "force on ground.base"
    assert {"force on stone-1-1.left", "force on stone-1-1.right"}.isdisjoint(names[:7])
