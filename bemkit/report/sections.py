"""Text and tables of a report, from the summary of a result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bemkit.hdf5 import provenance
from bemkit.plan.plan import Plan
from bemkit.report.html import Element, element, facts, number, table
from bemkit.results.file_meanings import CONTACT_COLUMNS
from bemkit.results.solution import Solution
from bemkit.results.tables import RESULTANT_COLUMNS, history_columns, in_units
from bemkit.scene.toml import SceneError, scene_to_toml
from bemkit.version import __version__

_MOST_ROWS = 200
"""Largest number of rows of a table; the files hold all."""


def badge(result: Solution) -> Element:
    """Return the status in a word, with a class for its colour."""
    kind = "good" if result.is_converged else "warned" if result.is_certified else "bad"
    return element("strong", result.status_words, class_=f"badge {kind}")


def warnings_section(result: Solution) -> list[Element]:
    """Return the warnings, one sentence each."""
    sentences = [element("li", warning.text) for warning in result.warnings]
    return [element("ul", *sentences) if sentences else element("p", "No warnings.")]


def forces_section(result: Solution) -> list[Element]:
    """Return the forces of contacts and parts, and the transitions."""
    summary = result.summary()
    tables = {
        "What each contact transmits": summary["contacts"],
        "Resultants on each part": summary["parts"],
        "Where the contact status changes": summary["transitions"],
    }
    heads = [in_units(head, result) for head in (*RESULTANT_COLUMNS, *CONTACT_COLUMNS)]
    units = {} if result.units is None else {head.name: head.unit for head in heads}
    found = [_shortened(rows, caption, units) for caption, rows in tables.items() if rows]
    return found or [element("p", "No part of the boundary has a name.")]


def certificate_section(result: Solution) -> list[Element]:
    """Return the largest violation of each condition, at the nodes and between them."""
    summary = result.summary()
    rows = [(_words(name), number(value, 2)) for name, value in summary["certificate"].items()]
    found = [
        element("p", "The largest violation of each condition, measured after the solve; zero is perfect."),
        facts(rows, "Certificate, at the nodes"),
    ]
    if (between := summary.get("between_nodes")) is not None:
        rows = [(_words(name), number(value, 2)) for name, value in between.items()]
        found.append(facts(rows, "Between the nodes: errors of the discretisation"))
    return found


def convergence_section(result: Solution) -> list[Element]:
    """Return the history of the solver."""
    columns = history_columns(result.history)
    names = ("step", "linear_solves", "n_separated", "n_stick", "n_slip", "n_changed", "relative_change", "worst")
    rows = [{name: _plain(columns[name][k]) for name in (*names, "message")} for k in range(len(result.history))]
    return [element("p", result.message or result.status.value), _shortened(rows, "Steps of the solver")]


def plan_section(plan: Plan) -> list[Element]:
    """Return the plan: computed and skipped items, with reasons."""
    rows = [{"item": item.name, "needed": item.is_needed, "why": item.reason} for item in plan.items]
    size = f"{plan.memory / 1e6:.3g} MB of memory, about {plan.seconds:.2g} s on a common computer."
    return [element("p", size), table(rows, "What is computed, what is skipped, and why")]


def scene_section(result: Solution) -> list[Element]:
    """Return the scene as a scene file."""
    try:
        text = scene_to_toml(result.stated)
    except SceneError as error:
        return [element("p", f"The scene cannot be written as text: {error}")]
    return [element("pre", element("code", text), tabindex="0")]


def timing_section(result: Solution) -> list[Element]:
    """Return how long each stage took."""
    return [facts([(name, f"{seconds:.3g} s") for name, seconds in result.timings.items()], "Run times")]


def version_section(result: Solution) -> list[Element]:
    """Return the versions that computed the result and the version that drew this page."""
    rows = [*(result.provenance or provenance()).items(), ("page drawn by", f"bemkit {__version__}")]
    return [facts(rows, "Versions")]


def _words(name: str) -> str:
    return {"n_bodies": "bodies", "n_elements": "elements", "n_contact": "contact nodes"}.get(
        name, name.replace("_", " ")
    )


def _plain(value: Any) -> Any:
    """Return a number of numpy as one of Python."""
    return value.item() if hasattr(value, "item") else value


def _shortened(rows: Sequence[Mapping[str, Any]], caption: str, units: Mapping[str, str] | None = None) -> Element:
    """Return a table of the first rows, whose caption says how many there are."""
    first = [{key: _plain(value) for key, value in row.items()} for row in rows[:_MOST_ROWS]]
    cut = "" if len(first) == len(rows) else f" (the first {len(first)} of {len(rows)} rows)"
    return table(first, caption + cut, units)
