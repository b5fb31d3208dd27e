"""Summary of a result in rows: printed by the command line and by Python, shown by reports and notebooks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from bemkit.contact.certificate import Certificate
from bemkit.errors import counted
from bemkit.geometry.shapes import Shape
from bemkit.geometry.vectors import norms
from bemkit.results.between_nodes import BetweenNodes
from bemkit.results.solution import Solution
from bemkit.results.solved_scene import contact_facts, part_facts, place_in
from bemkit.scene.registry import DISCRETISATIONS, SOLVERS
from bemkit.scene.unit_names import UnitNames, amount, unit_of
from bemkit.solvers.fallbacks import drivers_at_work

DIGITS = 8
"""Digits of the numbers of a summary."""
_TOWARDS = {1.0: "towards +x", -1.0: "towards -x", 0.0: "along the boundary"}
_MANY_TRANSITIONS, _MANY_CONTACTS = 6, 8


def summary_text(solution: Solution) -> str:
    """Return the summary of a result in lines: title, rows, warnings."""
    rows = list(summary_rows(solution))
    width = max(len(name) for name, _ in rows)
    lines = [f"{name:{width}}  {line}" for name, text in rows for name, line in _lines(name, text)]
    return "\n".join([solution.title, *lines, *(f"warning: {warning}" for warning in solution.warnings)])


def _lines(name: str, text: str) -> list[tuple[str, str]]:
    first, *more = text.split("\n")
    return [(name, first), *(("", line) for line in more)]


def summary_rows(solution: Solution) -> Iterator[tuple[str, str]]:
    """Yield the names and texts of the rows of a summary, numbers with their units."""
    yield "status", _status(solution)
    if (thickness := solution.scene.thickness) is not None:
        yield "thickness", _amount(thickness, "length", solution.units)
    yield from _bodies_rows(solution)
    if has_contact := solution.contact.n_contact > 0:
        yield "contact nodes", _node_counts(solution)
        yield from _force_rows(solution)
    else:
        yield "contact", "none"
    yield from _part_rows(solution)
    per = "" if solution.scene.thickness else "  per unit thickness"
    yield "elastic energy", f"{_amount(solution.energy, 'energy', solution.units)}{per}"
    yield from _history_rows(solution)
    if solution.estimated_error is not None:
        words = f"{solution.estimated_error:.1e}  relative, in the energy norm{_traction_errors(solution)}"
        yield "estimated error", words
    if has_contact:
        yield "transitions", "\n".join(_transition_lines(solution))
        drivers = drivers_at_work(solution.scene.solver, (record.message for record in solution.history))
        words = ", ".join(dict.fromkeys(map(SOLVERS.name_of, drivers)))
        yield "linear solves", f"{solution.linear_solves} in {counted(solution.outer_steps, 'step')} ({words})"
    yield from _violation_rows(solution)
    yield "time", _time(solution)


def _bodies_rows(solution: Solution) -> Iterator[tuple[str, str]]:
    if "" not in solution.bodies:
        yield "bodies", f"{len(solution.bodies)}, with {solution.n_elements} elements"
        for elastic in solution.stated.bodies:
            if notes := _notes(elastic.shape):
                yield f"outline of {elastic.name}", notes
        return
    body = solution.body
    mesh, discretisation = body.mesh, body.scene.discretisation
    words = DISCRETISATIONS.name_of(discretisation)
    if (degree := discretisation.displacement_space(mesh).degree) > 2:
        words += f", degree {degree}"
    yield "elements", f"{mesh.n_elements} ({words})"
    if notes := _notes(body.scene.shape):
        yield "outline", notes
    if mesh.symmetry is not None:
        values = f"values of one side, {mesh.n_elements} of {mesh.whole.n_elements} elements"
        yield "symmetry", f"about {mesh.symmetry}: {values}"


def _notes(shape: Shape) -> str:
    """Return notes on how the outline of a body was read, in lines."""
    drawing = shape.outline().drawing
    return "" if drawing is None else "\n".join(drawing.notes)


def _force_rows(solution: Solution) -> Iterator[tuple[str, str]]:
    """Yield the forces of all contacts together, then those of each, the largest first."""
    units = solution.units
    total, least = solution.force_normal, _force_of_round_off(solution)
    friction = _without_round_off(solution.force_tangential, least)
    per = "" if solution.scene.thickness else ", per unit thickness"
    yield "normal force", f"{_amount(total, 'force', units)}  pressing{per}"
    direction = _TOWARDS[solution.contact.common_direction]
    yield "friction force", f"{_amount(friction, 'force', units)}  on the body, {direction}"
    facts = sorted(contact_facts(solution), key=lambda fact: -fact["force_normal"])
    if len(facts) == 1:
        (fact,) = facts
        yield "contact length", _length(fact, units)
        yield "peak pressure", _peak(fact, solution)
        yield "largest slip", _amount(fact["largest_slip"], "length", units)
        return
    for fact in facts[:_MANY_CONTACTS]:
        yield (
            fact["name"],
            f"normal force {_amount(fact['force_normal'], 'force', units)}, "
            f"friction {_amount(_without_round_off(fact['force_tangential'], least), 'force', units)}, "
            f"length {_length(fact, units)}, "
            f"peak pressure {_peak(fact, solution)}, slip up to {_amount(fact['largest_slip'], 'length', units)}",
        )
    yield from _more(len(facts), "contacts")


def _more(count: int, words: str) -> Iterator[tuple[str, str]]:
    if count > _MANY_CONTACTS:
        yield "", f"and {count - _MANY_CONTACTS} {words} more (--json -)"


def _length(fact: Mapping[str, Any], units: UnitNames | None) -> str:
    return f"{_amount(fact['contact_length'], 'length', units)} ({100.0 * fact['contact_fraction']:.4g} %)"


def _peak(fact: Mapping[str, Any], solution: Solution) -> str:
    size = _amount(fact["peak_pressure"], "stress", solution.units)
    return f"{size} at {_place(fact['peak_x'], fact['peak_y'], solution)}" if fact["peak_pressure"] else size


def _place(x: float, y: float, solution: Solution) -> str:
    """Write a point with its unit; coordinates that are round-off beside the bodies are zero."""
    return f"{place_in(solution, (x, y), DIGITS)} {unit_of('length', solution.units)}".rstrip()


def _vector(x: float, y: float, quantity: str, units: UnitNames | None) -> str:
    return f"({_amount(x, '', None)}, {_amount(y, '', None)}) {unit_of(quantity, units)}".rstrip()


def _part_rows(solution: Solution) -> Iterator[tuple[str, str]]:
    """Yield the resultants on the parts of the bodies, and the motions and forces of rigid bodies."""
    units = solution.units
    forces, least = part_facts(solution), _force_of_round_off(solution)
    if len(forces) > _MANY_CONTACTS:
        forces.sort(key=lambda fact: _rank(fact, solution))
    least_moment = least * max(float(norms(body.mesh.nodes).max()) for body in solution.bodies.values())
    for fact in forces[:_MANY_CONTACTS]:
        moment = _amount(_without_round_off(fact["moment"], least_moment), "energy", units)
        name = f"{fact['body']}.{fact['name']}" if "body" in fact else fact["name"]
        yield f"force on {name}", f"{_force(fact['force_x'], fact['force_y'], least, units)}, moment {moment}"
    yield from _more(len(forces), "parts")
    rigid = list(solution.rigid.values())
    for body in rigid[:_MANY_CONTACTS]:
        yield (
            body.name,
            f"moved by {_vector(body.x, body.y, 'length', units)}, turned by {body.turn:.8g} rad; "
            f"force {_force(body.force_x, body.force_y, least, units)}, "
            f"moment {_amount(_without_round_off(body.moment, least_moment), 'energy', units)} on it",
        )
    yield from _more(len(rigid), "rigid bodies")


def _rank(fact: Mapping[str, Any], solution: Solution) -> tuple[bool, bool, float]:
    """Rank supports and loads before contacts, which have rows of their own, and free sides last."""
    size = float(np.hypot(fact["force_x"], fact["force_y"]))
    return size == 0.0, fact["name"] in solution.bodies[fact.get("body", "")].contact_forces, -size


def _force_of_round_off(solution: Solution) -> float:
    """Return the size of forces [N/m] that may be round-off."""
    sizes = [abs(fact[key]) for fact in part_facts(solution) for key in ("force_x", "force_y")]
    return solution.certificate.round_off * max(sizes, default=0.0)


def _without_round_off(force: float, least: float) -> float:
    return 0.0 if abs(force) <= least else force


def _force(x: float, y: float, least: float, units: UnitNames | None) -> str:
    return _vector(_without_round_off(x, least), _without_round_off(y, least), "force", units)


def _traction_errors(solution: Solution) -> str:
    tractions = solution.estimated_traction_error
    local = solution.estimated_local_traction_error
    words = "" if tractions is None else f", {tractions:.1e} of contact tractions"
    return words if local is None else f"{words}, {local:.1e} of single ones"


def _violation_rows(solution: Solution) -> Iterator[tuple[str, str]]:
    round_off = f"round-off of the forces up to {solution.certificate.round_off:.1e}"
    yield "certificate", f"{_worst_entry(solution.certificate)}; {round_off}"
    if (between := solution.between_nodes) is not None:
        depth = amount(between.penetration_depth, "length", solution.units, digits=2)
        yield "between nodes", f"{_worst_entry(between)}; penetration up to {depth}"


def _history_rows(solution: Solution) -> Iterator[tuple[str, str]]:
    loading = solution.loading
    if loading is not None:
        work, units = loading.total(), solution.units
        yield "load history", loading.progress
        yield "external work", f"{_amount(work.external_work, 'energy', units)}  in all steps"
        yield "dissipation", f"{_amount(work.dissipation, 'energy', units)}  in all steps"
        if loading.has_coarse_increments:
            left = _amount(work.increment_work, "energy", units)
            yield "increment error", f"{left}  decreases with smaller increments"


def _status(solution: Solution) -> str:
    words = solution.status_words
    return words if solution.is_converged else f"{words}: {solution.message or solution.status.value}"


def _node_counts(solution: Solution) -> str:
    counts = Counter(solution.contact.status_words())
    nodes = f"{counts['separated']} separated, {counts['slip']} slip, {counts['stick']} stick"
    return f"{solution.contact.n_contact}: {nodes}"


def _time(solution: Solution) -> str:
    timings = solution.timings
    stages = ", ".join(f"{name} {value:.2f}" for name, value in timings.items() if name != "total" and value > 0.0)
    return f"{timings.get('total', sum(timings.values())):.2f} s ({stages})"


def _amount(value: float, quantity: str, units: UnitNames | None) -> str:
    return amount(value, quantity, units, digits=DIGITS)


def _worst_entry(measured: Certificate | BetweenNodes) -> str:
    violations = measured.violations
    worst = max(violations, key=lambda name: np.nan_to_num(violations[name], nan=np.inf))
    name = f" ({worst.replace('_', ' ')})" if measured.worst != 0.0 else ""  # where all are equal
    return f"worst entry {measured.worst:.1e}{name}"


def _transition_lines(solution: Solution) -> list[str]:
    units = solution.units
    lines = [
        f"{item.part}: {item.from_status} to {item.to_status} at {_place(item.x, item.y, solution)}, "
        f"s = {_amount(item.s, 'length', units)}"
        for item in solution.transitions[:_MANY_TRANSITIONS]
    ]
    n_more = len(solution.transitions) - len(lines)
    if n_more > 0:
        lines.append(f"and {n_more} more (--csv -)")
    return lines or ["none"]
