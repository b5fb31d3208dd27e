"""The numbers of a result: the same, with units, in summary, report, notebook, JSON and tables."""

from __future__ import annotations

import html
import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from rich.console import Console

import bemkit as bk
from bemkit.cli.console import print_summary
from bemkit.report.page import report
from bemkit.results.summary_rows import DIGITS, summary_rows
from bemkit.results.tables import table_of, to_json
from bemkit.scene.toml import with_overrides

UNITS = bk.UnitNames("mm", "MPa")


@pytest.fixture(scope="module", params=["paper-1", "wedged-leg"])
def solution(request: pytest.FixtureRequest) -> bk.Solution:
    scene = bk.load_scene(request.param)
    return bk.run(replace(with_overrides(scene, elements=40) if request.param == "paper-1" else scene, units=UNITS))


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
    rows, summary = str(solution), json.loads(to_json(solution))
    force, energy = UNITS.as_dict()["force"], UNITS.energy
    expected = [f"{summary['energy']:.{DIGITS}g} {energy}", f"{summary['force_normal']:.{DIGITS}g} {force}"]
    largest = sorted(summary["contacts"], key=lambda contact: -contact["force_normal"])[:8]
    for contact in largest:
        expected += [
            f"{contact['contact_length']:.{DIGITS}g} mm ({100.0 * contact['contact_fraction']:.4g} %)",
            f"{contact['peak_pressure']:.{DIGITS}g} MPa at "
            f"({contact['peak_x']:.{DIGITS}g}, {contact['peak_y']:.{DIGITS}g}) mm",
            f"{contact['largest_slip']:.{DIGITS}g} mm",
        ]
    for body in list(summary.get("rigid", {}).values())[:8]:
        expected += [f"({body['x']:.{DIGITS}g}, {body['y']:.{DIGITS}g}) mm", f"{body['turn']:.{DIGITS}g} rad"]
    for fact in solution.forces.as_dicts()[:8]:
        expected.append(f"({fact['force_x']:.{DIGITS}g}, {fact['force_y']:.{DIGITS}g}) {force}")
        expected.append(f"moment {fact['moment']:.{DIGITS}g} {energy}")
    for number in expected:
        assert number in rows


def test_the_peak_is_where_the_contact_table_has_it(solution: bk.Solution) -> None:
    table = table_of(solution, "contact")
    for contact in solution.summary()["contacts"]:
        rows = [row for row in table.as_dicts() if row["part"] == contact["name"]]
        (peak,) = [row for row in rows if (row["x"], row["y"]) == (contact["peak_x"], contact["peak_y"])][:1]
        assert -peak["sigma_n"] == max(-row["sigma_n"] for row in rows)
        assert 0.0 <= contact["contact_fraction"] <= 1.0 + 1e-12


def test_the_forces_are_those_of_the_parts(solution: bk.Solution) -> None:
    expected = [force.force_x for body in solution.bodies.values() for force in body.part_forces]
    # sums of nodal forces and integrals of the tractions that they make differ by round-off
    assert list(solution.forces.values("force_x")) == pytest.approx(expected, rel=1e-9, abs=1e-12 * max(expected))


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
