"""Figures of a solution: the deformed body, and displacements, tractions and status along the contact boundary.

Without contact, the tractions along the whole boundary instead.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby, pairwise
from math import floor, log10
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.geometry.reflection import reflected_to_whole
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.symmetry import Symmetry
from bemkit.results.contact_table import ContactTable, Transition
from bemkit.results.drawing import BLUE, GREY, ORANGE, VERMILION, label_values, new_figure, panel_above_strip
from bemkit.results.obstacle_drawing import draw_obstacles
from bemkit.results.outputs import write_figures
from bemkit.results.solution import Solution
from bemkit.scene.unit_names import UnitNames, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STATUS_COLOURS: Mapping[str, str] = MappingProxyType({"separated": "#D9D9D9", "slip": ORANGE, "stick": BLUE})
_STATUS_TEXT: Mapping[str, str] = MappingProxyType({"separated": "#333333", "slip": "#000000", "stick": "#FFFFFF"})

_EXAGGERATION = 0.08
"""The largest displacement is drawn about this long, in diameters of the body."""
_LINE = 0.003
"""Thickness of a line, in sizes of the picture."""
_POINTS_OF_CURVE = 9
"""Points of an element whose displacement or shape is curved."""
_FIRST: Mapping[str, Any] = MappingProxyType({"color": BLUE, "linewidth": 1.6, "marker": "o", "markersize": 2.0})
_SECOND: Mapping[str, Any] = MappingProxyType({"color": VERMILION, "linestyle": "--", "linewidth": 1.6})
_LIMIT: Mapping[str, Any] = MappingProxyType({"color": "black", "linestyle": ":", "linewidth": 1.2})
FREE, PARTS = "#F2F2F2", ("#C6DBEA", "#F3D9B1")
_READABLE = 0.06
"""Share of the boundary from which on a piece is long enough for its name."""


class SolvedContact(Protocol):
    """What is drawn of contacts: `Solution` and `AssemblySolution` have it."""

    @property
    def title(self) -> str:
        """The title."""

    @property
    def units(self) -> UnitNames | None:
        """Names of units, if the scene has them."""

    @property
    def contact(self) -> ContactTable:
        """One row for each contact node."""

    @property
    def transitions(self) -> Sequence[Transition]:
        """Where the status changes."""

    @property
    def friction_bound(self) -> FloatArray | None:
        """(n_contact,) array [Pa], None without friction."""

    def part_length(self, part: str, /) -> float:
        """Return the length of a contact part [m]."""


def save_figures(solution: Solution, folder: str | Path, *, units: UnitNames | None = None) -> tuple[Path, ...]:
    """Draw all figures into a folder, which is made if need be, and return their paths; see `all_figures`.

    Raises
    ------
    OutputFileError
        If the folder or a file in it cannot be written.
    """
    return write_figures(all_figures(solution, units=units), Path(folder))


def all_figures(solution: Solution, *, units: UnitNames | None = None) -> dict[str, Figure]:
    """Draw everything there is to show.

    Returns
    -------
    dict of str to matplotlib.figure.Figure
        By file names without ``.png``: ``deformation``, and for each contact part ``contact-displacement``,
        ``contact-traction`` and ``contact-status``, numbered if there are several; without contact
        ``boundary-traction``.
    """
    figures = {"deformation": draw_deformation(solution, units=units)}
    if not solution.contact.parts:
        figures["boundary-traction"] = draw_boundary_traction(solution, units=units)
    return figures | contact_figures(solution, units=units)


def contact_figures(solution: SolvedContact, *, units: UnitNames | None = None) -> dict[str, Figure]:
    """Draw displacements, tractions and status of each contact; see `all_figures`."""
    figures, parts = {}, solution.contact.parts
    for number, part in enumerate(parts, start=1):
        suffix = f"-{number}" if len(parts) > 1 else ""
        figures[f"contact-displacement{suffix}"] = draw_contact_displacement(solution, part, units=units)
        figures[f"contact-traction{suffix}"] = draw_contact_traction(solution, part, units=units)
        figures[f"contact-status{suffix}"] = draw_contact_status(solution, part, units=units)
    return figures


def draw_deformation(solution: Solution, *, units: UnitNames | None = None) -> Figure:
    """Draw the initial and the deformed body, the displacements enlarged by a factor that the picture tells.

    The factor is so small that no contact node is drawn inside its obstacle by more than a line is thick.
    """
    units = units or solution.units
    space, displacement = whole_displacement(solution)
    factor = exaggeration(space.mesh.diameter, displacement, solution.contact)
    figure = new_figure(5.6, 5.6)
    axes = figure.add_subplot()
    draw_body(axes, space, displacement, factor, is_labelled=True)
    _draw_symmetry_lines(axes, solution.mesh.symmetry)
    axes.set_aspect("equal" if solution.mesh.surface is None else "auto")  # a strip would be a line
    axes.margins(0.08)
    draw_obstacles(axes, [getattr(part.condition, "obstacle", None) for part in solution.scene.contact_parts])
    axes.set_xlabel(with_unit("$x$", "length", units))
    axes.set_ylabel(with_unit("$y$", "length", units))
    axes.set_title(solution.title, parse_math=False, fontsize=11)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    return figure


def whole_displacement(solution: Solution) -> tuple[BoundarySpace, FloatArray]:
    """Return the space of the displacements on the whole body, images included, and their values (n_nodes, 2) [m]."""
    make_space = solution.scene.discretisation.displacement_space
    space = make_space(solution.mesh.whole)
    return space, reflected_to_whole(make_space(solution.mesh), space, solution.boundary.displacement)


def draw_body(
    axes: Axes, space: BoundarySpace, displacement: FloatArray, factor: float, *, is_labelled: bool = False
) -> None:
    """Draw the outline of a body, dashed, and the deformed body."""
    before, after = outlines(space, displacement, 0.0), outlines(space, displacement, factor)
    labels = ("initial", f"deformed, displacements \u00d7 {factor:g}") if is_labelled else (None, None)
    for number, (initial, deformed) in enumerate(zip(before, after, strict=True)):
        of_initial, of_deformed = labels if number == 0 else (None, None)
        axes.plot(*initial.T, color=GREY, linestyle="--", linewidth=1.0, label=of_initial)
        axes.plot(*deformed.T, color=BLUE, linewidth=1.6, label=of_deformed)
    if not space.mesh.is_exterior:
        fill(axes, after)


def outlines(space: BoundarySpace, displacement: FloatArray, factor: float) -> list[FloatArray]:
    """Return the closed loops (n, 2), or the strip, of a body moved by a multiple of its displacement."""
    mesh = space.mesh
    n_points = 2 if space.degree <= 1 and bool(mesh.is_straight.all()) else _POINTS_OF_CURVE
    xi = np.linspace(-1.0, 1.0, n_points)[:-1]
    moved = mesh.points(np.arange(mesh.n_elements), xi)
    if space.is_continuous:
        values = np.einsum("pq,epc->eqc", space.basis(xi), displacement[space.element_dofs])
    else:
        at_start = at_mesh_nodes(space, displacement)[mesh.elements]
        shares = np.stack([0.5 - 0.5 * xi, 0.5 + 0.5 * xi])
        values = np.einsum("pq,epc->eqc", shares, at_start)
    moved = moved + factor * values
    loops = [moved[loop].reshape(-1, 2) for loop in mesh.loops]
    if mesh.surface is not None:
        last = mesh.nodes[-1] + factor * at_mesh_nodes(space, displacement)[-1]
        return [np.concatenate([*loops, [last]])]
    return [np.concatenate([loop, loop[:1]]) for loop in loops]


def draw_contact_displacement(solution: SolvedContact, part: str, *, units: UnitNames | None = None) -> Figure:
    """Draw normal and tangential displacement and the gap along one contact part, above its status."""
    units = units or solution.units
    contact, chosen = solution.contact, solution.contact.rows(part)
    s, gap = contact.s[chosen], contact.gap[chosen]
    figure, axes = _contact_axes(solution, part, units, "Displacements on the contact boundary")
    axes.plot(s, contact.u_n[chosen], label="normal $u_n$", **_FIRST)
    axes.plot(s, contact.u_t[chosen], label="tangential $u_t$", **_SECOND)
    if np.any(np.isfinite(gap) & (gap != 0.0)):
        axes.plot(s, _near(gap, solution, chosen), label="gap $g$", **_LIMIT)
    label_values(axes, with_unit("displacement", "length", units))
    return figure


def draw_contact_traction(solution: SolvedContact, part: str, *, units: UnitNames | None = None) -> Figure:
    """Draw normal and tangential traction and the friction bound; see `draw_contact_displacement`."""
    units = units or solution.units
    contact, chosen = solution.contact, solution.contact.rows(part)
    s = contact.s[chosen]
    figure, axes = _contact_axes(solution, part, units, "Tractions on the contact boundary")
    axes.plot(s, contact.sigma_n[chosen], label=r"normal $\sigma_n$", **_FIRST)
    axes.plot(s, contact.sigma_t[chosen], label=r"tangential $\sigma_t$", **_SECOND)
    if solution.friction_bound is not None:
        axes.plot(s, solution.friction_bound[chosen], label="friction bound", **_LIMIT)
        axes.plot(s, -solution.friction_bound[chosen], **_LIMIT)
    label_values(axes, with_unit("traction", "stress", units))
    return figure


def draw_contact_status(solution: SolvedContact, part: str, *, units: UnitNames | None = None) -> Figure:
    """Draw contact pressure and clearance; see `draw_contact_displacement`."""
    units = units or solution.units
    contact, chosen = solution.contact, solution.contact.rows(part)
    s = contact.s[chosen]
    figure, axes = _contact_axes(solution, part, units, "Contact pressure and clearance")
    pressure = axes.plot(s, -contact.sigma_n[chosen], label=r"pressure $-\sigma_n$ (left)", **_FIRST)
    axes.set_ylabel(with_unit("pressure", "stress", units))
    right = axes.twinx()
    right.ticklabel_format(axis="y", scilimits=(-2, 3), useMathText=True)
    clearance = _near(contact.clearance[chosen], solution, chosen)
    opening = right.plot(s, clearance, label="clearance $g - u_n$ (right)", **_SECOND)
    right.set_ylabel(with_unit("clearance", "length", units))
    axes.axhline(0.0, color="black", linewidth=0.6, zorder=0)  # a uniform pressure is not scaled to its round-off
    for each in (axes, right):
        bottom, top = each.get_ylim()
        each.set_ylim(bottom, top + 0.15 * (top - bottom))  # room for the legend
    axes.legend(handles=[*pressure, *opening], frameon=False, loc="upper center", ncols=2)
    return figure


def exaggeration(size: float, displacement: FloatArray, contact: ContactTable) -> float:
    """Choose the factor 1, 2 or 5 times a power of ten by which displacements are drawn.

    Parameters
    ----------
    size : float [m]
        Of what is drawn.
    displacement : (n, 2) array [m]
    contact : ContactTable
        Drawn so large, displacements close gaps that are not enlarged with them.

    Returns
    -------
    float
        Such that the largest displacement is seen, and no contact node is drawn beyond its partner by more than a line
        is thick; 1 if that is impossible, or if nothing moves.
    """
    largest = float(np.hypot(*displacement.T).max())
    if not 0.0 < largest < np.inf:
        return 1.0
    wanted = _EXAGGERATION * size / largest
    closing = np.isfinite(contact.gap) & (contact.u_n > 0.0)
    room = np.maximum(contact.gap[closing], 0.0) + _LINE * size
    wanted = min(wanted, float(np.min(room / contact.u_n[closing], initial=np.inf)))
    if wanted <= 1.0 and closing.any():
        return 1.0
    power = 10.0 ** floor(log10(wanted))
    return power * max(step for step in (1.0, 2.0, 5.0) if step * power <= wanted or step == 1.0)


def at_mesh_nodes(space: BoundarySpace, displacement: FloatArray) -> FloatArray:
    """Return displacements (n_scalar, 2) at the nodes of the mesh, between the two elements where they differ."""
    mesh = space.mesh
    at_ends = np.einsum("pq,epc->eqc", space.basis(np.array([-1.0, 1.0])), displacement[space.element_dofs])
    before, after = mesh.node_elements.T
    share = (mesh.lengths[after] / (mesh.lengths[before] + mesh.lengths[after]))[:, None]
    return np.asarray(share * at_ends[before, 1] + (1.0 - share) * at_ends[after, 0])


def _near(distance: FloatArray, solution: SolvedContact, chosen: BoolArray) -> FloatArray:
    """Blank out distances to the obstacle that would dwarf the displacements."""
    contact = solution.contact
    largest = max(float(np.abs(component[chosen]).max()) for component in (contact.u_n, contact.u_t))
    return np.where(np.abs(distance) <= 2.0 * largest, distance, np.nan)


def _contact_axes(solution: SolvedContact, part: str, units: UnitNames | None, subject: str) -> tuple[Figure, Axes]:
    """Return a figure with a large panel above a strip that shows the status along the part."""
    abscissa = with_unit(f"arc length $s$ along '{part}'", "length", units)
    figure, axes, strip = panel_above_strip(f"{subject}\n{solution.title}", abscissa, parse_math="$" not in part)
    _draw_status(strip, solution, part)
    for transition in solution.transitions:
        if transition.part == part:
            axes.axvline(transition.s, color=GREY, linestyle="-", linewidth=0.8, zorder=0)
    return figure, axes


def _draw_status(strip: Axes, solution: SolvedContact, part: str) -> None:
    """Paint the status along a part; name it where there is room, and in a legend where there is none."""
    from matplotlib.patches import Patch

    chosen = solution.contact.rows(part)
    length = solution.part_length(part)
    transitions = [transition for transition in solution.transitions if transition.part == part]
    first = solution.contact.status_words()[int(np.flatnonzero(chosen)[0])]
    words = [first, *(transition.to_status for transition in transitions)]
    edges = [0.0, *(transition.s for transition in transitions), length]
    named = set()
    for (begin, end), word in zip(pairwise(edges), words, strict=True):
        strip.axvspan(begin, end, color=STATUS_COLOURS[word], linewidth=0)
        if end - begin > 0.12 * length:
            style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 9, "color": _STATUS_TEXT[word]}
            strip.text((begin + end) / 2.0, 0.5, word, **style)
            named.add(word)
    handles = [Patch(color=colour, label=word) for word, colour in STATUS_COLOURS.items() if word in {*words} - named]
    if handles:
        strip.figure.legend(handles=handles, loc="outside lower right", ncols=3, frameon=False)
    strip.set_xlim(0.0, length)


def fill(axes: Axes, loops: list[FloatArray]) -> None:
    """Fill the inside of closed loops; holes run the other way round and stay open."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    outline = Outline.make_compound_path(*(Outline(np.vstack([loop, loop[:1]]), closed=True) for loop in loops))
    axes.add_patch(PathPatch(outline, facecolor="#DCEBF5", edgecolor="none", zorder=1))


def _draw_symmetry_lines(axes: Axes, symmetry: Symmetry | None) -> None:
    style: dict[str, Any] = {"color": "black", "linestyle": "-.", "linewidth": 0.8}
    if symmetry is not None and symmetry.x is not None:
        axes.axvline(symmetry.x, **style)
    if symmetry is not None and symmetry.y is not None:
        axes.axhline(symmetry.y, **style)


def draw_boundary_traction(solution: Solution, *, units: UnitNames | None = None) -> Figure:
    """Draw the normal and the tangential traction of each element along the boundary, above the parts it belongs to.

    Closed curves of the boundary follow each other; a line marks where each of them begins.
    """
    units = units or solution.units
    mesh, traction = solution.mesh, solution.boundary.traction
    order = np.concatenate(mesh.loops)
    s = np.append(0.0, np.cumsum(mesh.lengths[order]))
    normals = mesh.normals[order]
    tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    title = f"Tractions on the boundary\n{solution.scene.title}"
    figure, axes, strip = panel_above_strip(title, with_unit("arc length $s$", "length", units))
    for directions, colour, label in ((normals, BLUE, r"normal $t_n$"), (tangents, VERMILION, r"tangential $t_t$")):
        axes.stairs(np.einsum("ec,ec->e", traction[order], directions), s, color=colour, label=label, linewidth=1.4)
    starts = np.cumsum([0, *(len(loop) for loop in mesh.loops)])[1:-1]
    for place in s[starts]:
        axes.axvline(place, color="black", linewidth=0.8)
    label_values(axes, with_unit("traction", "stress", units))
    _draw_parts(strip, solution, order.tolist(), s.tolist())
    return figure


def _draw_parts(strip: Axes, solution: Solution, order: list[int], s: list[float]) -> None:
    """Paint the part that each piece of the boundary belongs to, with its name where there is room."""
    name_of = {element: name for name, elements in solution.mesh.parts.items() for element in elements.tolist()}
    numbers = {name: number for number, name in enumerate(solution.mesh.parts)}
    for name, group in groupby(range(len(order)), key=lambda k: name_of.get(order[k])):
        places = list(group)
        begin, end = s[places[0]], s[places[-1] + 1]
        strip.axvspan(begin, end, color=FREE if name is None else PARTS[numbers[name] % 2], linewidth=0)
        if name is not None and end - begin > _READABLE * s[-1]:
            strip.text((begin + end) / 2.0, 0.5, name, ha="center", va="center", fontsize=8, parse_math=False)
    strip.set_xlim(0.0, s[-1])
