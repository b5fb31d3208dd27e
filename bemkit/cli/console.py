"""Terminal output: summary, plan, convergence table, time and memory of a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console, Group
from rich.table import Table
from rich.text import Text

from bemkit.cli.outputs import plain_table, stdout_console
from bemkit.contact.certificate import Certificate
from bemkit.geometry.shapes import Shape
from bemkit.operators.counts import OperationCounts
from bemkit.plan import Plan
from bemkit.result_warning import ResultWarning
from bemkit.results.between_nodes import BetweenNodes
from bemkit.results.solution import Solution
from bemkit.scene.registry import DISCRETISATIONS, SOLVERS
from bemkit.scene.unit_names import UnitNames, amount
from bemkit.solvers.base import StepRecord
from bemkit.solvers.fallbacks import drivers_at_work

if TYPE_CHECKING:
    from bemkit.results.assembly_solution import AssemblySolution

_MANY_TRANSITIONS, _MANY_CONTACTS = 12, 8


def print_summary(solution: Solution | AssemblySolution, console: Console | None = None) -> None:
    """Print a solution as a compact table, to standard output by default."""
    console = stdout_console(console)
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0), title_justify="left")
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in _summary_rows(solution):
        table.add_row(name, Text(value) if isinstance(value, str) else value)
    console.print(Text(solution.title, style="bold"))
    console.print(table)
    _print_warnings(solution.warnings, console)


def print_plan(title: str, plan: Plan) -> None:
    """Print what a scene needs and what it skips, with the time and memory of each."""
    console = stdout_console()
    table = plain_table(("", "item", "why"), gap=2)
    for item in plan.items:
        style = "" if item.is_needed else "dim"
        mark = Text("needed", style="green") if item.is_needed else Text("skipped", style="dim")
        table.add_row(mark, Text(item.name, style=style), Text(item.reason, style=style))
    console.print(Text(title, style="bold"))
    console.print(table)
    memory = format_size(plan.memory)
    console.print(f"about {format_seconds(plan.seconds)}, and {memory} of memory at the largest moment")
    _print_warnings(plan.warnings, console)


def _print_warnings(warnings: Sequence[ResultWarning], console: Console) -> None:
    for warning in warnings:
        console.print(Text(f"warning: {warning}", style="yellow"))


class ConvergenceTable:
    """A callback of `bemkit.run` that prints one line per step of the solver, to standard error by default."""

    def __init__(self, console: Console | None = None) -> None:
        self._console = Console(stderr=True, highlight=False) if console is None else console
        self._has_header = False

    def __call__(self, record: StepRecord) -> None:
        """Print a line."""
        if not self._has_header:
            header = "step  solves  separated   stick    slip  changed     worst"
            self._console.print(Text(header, style="bold"))
            self._has_header = True
        line = (
            f"{record.step:4d}  {record.linear_solves:6d}  {record.n_separated:9d}  {record.n_stick:6d}  "
            f"{record.n_slip:6d}  {record.n_changed:7d}  {record.certificate.worst:8.1e}"
        )
        self._console.print(Text(f"{line}  {record.message}".rstrip()))


def print_explanation(solution: Solution | AssemblySolution, output_seconds: float, *, to_stderr: bool = False) -> None:
    """Print planned and measured time and memory, the counts, and what was skipped.

    Memory was traced in the run, which makes small scenes about twice as slow. Standard output may be taken by data.
    """
    console = Console(stderr=to_stderr, highlight=False)
    console.print(Group(_stages(solution, output_seconds), _counts(solution.plan.work, solution.work)))
    console.print(_left_out(solution))


def _stages(solution: Solution | AssemblySolution, output_seconds: float) -> Table:
    table = plain_table(("stage",), ("time", "memory"), gap=2)
    for name, seconds in solution.timings.items():
        if name != "total" and seconds > 0.0:  # a stage that this run did not need is not listed
            size = solution.memory.get(name, 0)
            table.add_row(name, format_seconds(seconds), format_size(size) if size else "")
    table.add_row("outputs", format_seconds(output_seconds), "")
    table.add_section()
    memory = format_size(max(solution.memory.values(), default=0))
    table.add_row("all", format_seconds(solution.timings["total"] + output_seconds), memory)
    table.add_row("planned", format_seconds(solution.plan.seconds), format_size(solution.plan.memory))
    return table


def _counts(planned: OperationCounts, counted: OperationCounts) -> Table:
    table = plain_table(("what was computed",), gap=2)
    for name in ("planned", "counted"):
        table.add_column(name, justify="right", overflow="fold")
    for (name, one), (_, other) in zip(_lines(planned), _lines(counted), strict=True):
        table.add_row(name, one, Text(other, style="" if one == other else "bold red"))
    return table


def _lines(work: OperationCounts) -> Iterator[tuple[str, str]]:
    yield "element pairs integrated", f"{work.element_pairs:,}"
    for name, entries in (("V", work.single_layer), ("K", work.double_layer), ("W", work.hypersingular)):
        yield f"entries of {name} computed", f"{entries.computed:,}"
        yield f"entries of {name} stored", f"{entries.stored:,}"
    factorisations = ", ".join(f"{one.kind.value} {one.order}" for one in work.factorisations)
    yield "factorisations and their orders", factorisations or "none"
    yield "right-hand sides", f"{work.right_hand_sides:,}"
    yield "unknowns of the contact system", f"{work.contact_unknowns:,}"


def _left_out(solution: Solution | AssemblySolution) -> Table:
    table = plain_table(("skipped", "why"), gap=2)
    for item in solution.plan.items:
        if not item.is_needed:
            table.add_row(item.name, item.reason)
    return table


def format_size(n_bytes: int) -> str:
    """Return a memory size in words such as ``3.3 MB``."""
    size = float(n_bytes)
    for unit in ("B", "kB", "MB", "GB"):
        if size < 1000.0:
            return f"{size:.3g} {unit}"
        size /= 1000.0
    return f"{size:.3g} TB"


def format_seconds(seconds: float) -> str:
    """Return a time in words such as ``3.3 ms``."""
    return f"{seconds:.3g} s" if seconds >= 1.0 else f"{1e3 * seconds:.3g} ms"


def _summary_rows(solution: Solution | AssemblySolution) -> Iterator[tuple[str, Text | str]]:
    yield "status", _status(solution)
    if isinstance(solution, Solution):
        solver, of_tractions = solution.scene.solver, _traction_errors(solution)
        yield from _body_rows(solution)
    else:
        solver, of_tractions = solution.assembly.solver, ""
        yield from _bodies_rows(solution)
    if has_contact := solution.contact.n_contact > 0:
        yield "contact nodes", _node_counts(solution)
        yield from _force_rows(solution) if isinstance(solution, Solution) else _contacts_rows(solution)
    else:
        yield "contact", "none"
    yield "elastic energy", f"{_amount(solution.energy, 'energy', solution.units)}  per unit thickness"
    yield from _history_rows(solution)
    if solution.estimated_error is not None:
        yield "estimated error", f"{solution.estimated_error:.1e}  relative, in the energy norm{of_tractions}"
    if has_contact:
        yield "transitions", "\n".join(_transition_lines(solution))
        drivers = drivers_at_work(solver, (record.message for record in solution.history))
        words = ", ".join(dict.fromkeys(map(SOLVERS.word_of, drivers)))
        yield "linear solves", f"{solution.linear_solves} in {solution.outer_steps} steps ({words})"
    yield from _violation_rows(solution)
    yield "time", _time(solution)


def _body_rows(solution: Solution) -> Iterator[tuple[str, str]]:
    mesh = solution.mesh
    discretisation = DISCRETISATIONS.word_of(solution.scene.discretisation)
    if (degree := solution.scene.discretisation.displacement_space(mesh).degree) > 2:
        discretisation += f", degree {degree}"
    yield "elements", f"{mesh.n_elements} ({discretisation})"
    if notes := _notes(solution.scene.shape):
        yield "outline", notes
    if mesh.symmetry is not None:
        values = f"values of one side, {mesh.n_elements} of {mesh.whole.n_elements} elements"
        yield "symmetry", f"about {mesh.symmetry}: {values}"


def _notes(shape: Shape) -> str:
    """Return what was done to read the outline of a body, in lines."""
    drawing = shape.outline().drawing
    return "" if drawing is None else "\n".join(drawing.notes)


def _force_rows(solution: Solution) -> Iterator[tuple[str, str]]:
    units = solution.units
    yield "normal force", f"{_amount(solution.force_normal, 'force', units)}  pressing, per unit thickness"
    yield "friction force", f"{_amount(solution.force_tangential, 'force', units)}  on the body, along the boundary"


def _traction_errors(solution: Solution) -> str:
    tractions, local = solution.estimated_traction_error, solution.estimated_local_traction_error
    words = "" if tractions is None else f", {tractions:.1e} of contact tractions"
    return words if local is None else f"{words}, {local:.1e} of single ones"


def _bodies_rows(solution: AssemblySolution) -> Iterator[tuple[str, str]]:
    yield "bodies", f"{len(solution.bodies)}, with {solution.n_elements} elements"
    for elastic in solution.assembly.bodies:
        if notes := _notes(elastic.shape):
            yield f"outline of {elastic.name}", notes


def _contacts_rows(solution: AssemblySolution) -> Iterator[tuple[str, str]]:
    units = solution.units
    for contact in solution.contacts[:_MANY_CONTACTS]:
        yield (
            contact.name,
            f"normal force {_amount(contact.force_normal, 'force', units)}, "
            f"friction {_amount(contact.force_tangential, 'force', units)}, "
            f"length {amount(contact.contact_length, 'length', units, digits=6)}, "
            f"peak pressure {amount(contact.peak_pressure, 'stress', units, digits=6)}, "
            f"slip up to {amount(contact.largest_slip, 'length', units, digits=3)}",
        )
    if len(solution.contacts) > _MANY_CONTACTS:
        yield "", f"and {len(solution.contacts) - _MANY_CONTACTS} contacts more (--json -)"
    for body in list(solution.rigid.values())[:_MANY_CONTACTS]:
        yield (
            body.name,
            f"moved by ({body.x:.6g}, {body.y:.6g}), turned by {body.turn:.6g}; "
            f"force ({body.force_x:.8g}, {body.force_y:.8g}), moment {body.moment:.8g} on it",
        )
    if len(solution.rigid) > _MANY_CONTACTS:
        yield "", f"and {len(solution.rigid) - _MANY_CONTACTS} rigid bodies more (--json -)"


def _violation_rows(solution: Solution | AssemblySolution) -> Iterator[tuple[str, str]]:
    round_off = f"round-off of the forces up to {solution.certificate.round_off:.1e}"
    yield "certificate", f"{_worst_entry(solution.certificate)}; {round_off}"
    if (between := solution.between_nodes) is not None:
        yield "between nodes", f"{_worst_entry(between)}; penetration up to {between.penetration_depth:.1e}"


def _history_rows(solution: Solution | AssemblySolution) -> Iterator[tuple[str, str]]:
    loading = solution.loading
    if loading is not None:
        work, units = loading.total(), solution.units
        yield "load history", f"{len(loading.steps)} of {loading.n_steps} steps, up to t = {loading.times[-1]:.6g}"
        yield "external work", f"{_amount(work.external_work, 'energy', units)}  in all steps"
        yield "dissipation", f"{_amount(work.dissipation, 'energy', units)}  in all steps"
        if loading.has_coarse_increments:
            left = _amount(work.increment_work, "energy", units)
            yield "increment error", f"{left}  decreases with smaller increments"


def _status(solution: Solution | AssemblySolution) -> Text:
    colour = "green" if solution.is_converged else "yellow" if solution.is_certified else "red"
    status = Text(solution.status_words, style=f"bold {colour}")
    if not solution.is_converged:
        status.append(f": {solution.message or solution.status.value}", style="not bold")
    return status


def _node_counts(solution: Solution | AssemblySolution) -> str:
    counts = Counter(solution.contact.status_words())
    nodes = f"{counts['separated']} separated, {counts['slip']} slip, {counts['stick']} stick"
    return f"{solution.contact.n_contact}: {nodes}"


def _time(solution: Solution | AssemblySolution) -> str:
    timings = solution.timings
    stages = ", ".join(f"{name} {value:.2f}" for name, value in timings.items() if name != "total" and value > 0.0)
    return f"{timings.get('total', sum(timings.values())):.2f} s ({stages})"


def _amount(value: float, quantity: str, units: UnitNames | None) -> str:
    return amount(value, quantity, units, digits=8)


def _worst_entry(measured: Certificate | BetweenNodes) -> str:
    violations = measured.violations
    worst = max(violations, key=lambda name: np.nan_to_num(violations[name], nan=np.inf))
    name = f" ({worst.replace('_', ' ')})" if measured.worst != 0.0 else ""  # where all are equal
    return f"worst entry {measured.worst:.1e}{name}"


def _transition_lines(solution: Solution | AssemblySolution) -> list[str]:
    lines = [
        f"{item.part}: {item.from_status} to {item.to_status} at ({item.x:.6g}, {item.y:.6g}), s = {item.s:.6g}"
        for item in solution.transitions[:_MANY_TRANSITIONS]
    ]
    n_more = len(solution.transitions) - len(lines)
    if n_more > 0:
        lines.append(f"and {n_more} more (--csv -)")
    return lines or ["none"]
