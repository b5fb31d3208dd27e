"""Boundary meshes: elements in closed loops, with named parts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import InitVar, dataclass, field, fields
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, read_only
from bemkit.errors import GeometryError, UnknownPartError
from bemkit.geometry.curves import Curve, as_point, require_positive, scaled_curve
from bemkit.geometry.loops import (
    as_index,
    check_chains,
    check_curves,
    check_mesh_loops,
    check_parts,
    follow_loops,
    restrict_loops,
    swept_areas,
)
from bemkit.geometry.pieces import Elements, Pieces, bisected, evaluate_curves, make_pieces
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.vectors import norms, turned_right

if TYPE_CHECKING:
    from bemkit.geometry.outline import Surface
    from bemkit.geometry.symmetry.lines import Symmetry

_N_LENGTH_POINTS = 16


@dataclass(frozen=True, eq=False)
class BoundaryMesh:
    """The boundary of one body, divided into elements.

    Every loop is traversed with the body on its left: the outer loop anticlockwise, holes clockwise. The tangent t
    points along the traversal, the normal n = (t_y, -t_x) out of the body.

    Parameters
    ----------
    nodes : (n_nodes, 2) array [m]
        Points where elements meet; each starts one element and ends one.
    elements : (n_elements, 2) int array
        Start node and end node of each element.
    parts : mapping of str to (k,) int array
        Named boundary parts, disjoint sets of elements; kept in increasing order.
    curves : tuple of Curve
        Curves that curved elements follow.
    element_curve : (n_elements,) int array, optional
        Index into `curves`, -1 for a straight element; None if all are straight.
    element_span : (n_elements, 2) array, optional
        Parameters of the start and the end of each curved element on its curve.
    is_exterior : bool
        Whether the body is the plane outside of the loops, which then all run clockwise.
    symmetry : Symmetry, optional
        Lines on which the loops end; the rest of the body are images, see `whole`. A part may then be empty.
    surface : Surface, optional
        Given if the body is a half-plane, an exterior: its elements are a straight strip.
    follows_outline : bool
        Whether elements lie along the sides of an `Outline`, whose loops have been checked and are not checked again.

    Raises
    ------
    GeometryError
        If this is not the boundary of one body: elements of no length, open or branching chains, elements that cross,
        touch or fold back, coincident nodes, wrong orientation, parts that overlap or point nowhere.

    Notes
    -----
    What counts as the same point is decided by the round-off of its own coordinates, never by an absolute length nor by
    the length of elements. All arrays are read-only.
    """

    nodes: FloatArray
    elements: IntArray
    parts: Mapping[str, IntArray] = field(default_factory=dict)
    curves: tuple[Curve, ...] = ()
    element_curve: IntArray | None = None
    element_span: FloatArray | None = None
    is_exterior: bool = False
    symmetry: Symmetry | None = None
    surface: Surface | None = None
    follows_outline: InitVar[bool] = False

    def __post_init__(self, follows_outline: bool) -> None:
        nodes = np.array(self.nodes, dtype=float)
        elements = as_index(self.elements, "elements")
        check_chains(nodes, elements, self.symmetry, is_strip=self.surface is not None)
        if self.symmetry is not None:
            nodes = self.symmetry.snapped(nodes)
        self._keep("nodes", nodes)
        self._keep("elements", elements)
        object.__setattr__(self, "curves", tuple(self.curves))
        if (self.element_curve is None) != (self.element_span is None):
            raise GeometryError("BoundaryMesh: of element_curve and element_span one is missing: give both or neither")
        if self.element_curve is not None and self.element_span is not None:
            self._keep("element_curve", as_index(self.element_curve, "element_curve"))
            self._keep("element_span", np.array(self.element_span, dtype=float))
            check_curves(nodes, elements, self.curves, self._curve_index, self._span)
        parts = check_parts(self.parts, len(elements), may_be_empty=self.symmetry is not None)
        object.__setattr__(self, "parts", MappingProxyType(parts))
        if self.surface is not None:
            self.surface.check(nodes, elements, self.is_exterior and self.symmetry is None)
        elif self.symmetry is not None:
            self.symmetry.check_half(nodes, elements, self.is_exterior)
            _ = self.whole  # checks its loops
        elif not follows_outline:
            check_mesh_loops(nodes, elements, self._pieces, self.loops, self.is_exterior)

    def __repr__(self) -> str:
        parts = [f"{name} ({elements.size})" for name, elements in self.parts.items()]
        return f"BoundaryMesh({', '.join([f'{self.n_elements} elements', *parts])})"

    def _keep(self, name: str, array: FloatArray | IntArray) -> None:
        object.__setattr__(self, name, read_only(array))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle what the constructor takes: a mesh from elsewhere is validated like any other."""
        content = self._content._replace(parts=dict(self.parts))
        return BoundaryMesh, (*content, self.is_exterior, self.symmetry, self.surface)

    @property
    def whole(self) -> BoundaryMesh:
        """The mesh of the whole body: itself, or with the images that a symmetry adds.

        Element e of image g (see `Symmetry.images`) has the number g * n_elements + e; nodes of this mesh come first.
        """
        # a mesh that held itself would have to wait for the garbage collector
        return self if self.symmetry is None else self._unfolded

    @cached_property
    def on_symmetry_lines(self) -> BoolArray:
        """(n_nodes, 2) bool array: whether a node lies on the line x = a, and on y = b, of the symmetry."""
        meets = np.zeros((self.n_nodes, 2), bool) if self.symmetry is None else self.symmetry.meets(self.nodes)
        return read_only(meets)

    @property
    def n_nodes(self) -> int:
        """Number of nodes: of elements, and one more for each chain between symmetry lines and for a half-plane."""
        return len(self.nodes)

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return len(self.elements)

    @cached_property
    def is_straight(self) -> BoolArray:
        """(n_elements,) bool array: whether the element is its chord."""
        return read_only(self._curve_index < 0)

    @cached_property
    def start(self) -> FloatArray:
        """(n_elements, 2) array [m]: start points."""
        return read_only(self.nodes[self.elements[:, 0]])

    @cached_property
    def end(self) -> FloatArray:
        """(n_elements, 2) array [m]: end points."""
        return read_only(self.nodes[self.elements[:, 1]])

    @cached_property
    def lengths(self) -> FloatArray:
        """(n_elements,) array [m]: arc lengths."""
        lengths, curved = self._pieces.chord_length, np.flatnonzero(~self.is_straight)
        xi, weights = gauss_legendre(_N_LENGTH_POINTS)
        lengths[curved] = self.jacobian(curved, xi) @ weights
        return read_only(lengths)

    @cached_property
    def centres(self) -> FloatArray:
        """(n_elements, 2) array [m]: points at xi = 0, on the element."""
        return read_only(self.points(np.arange(self.n_elements), np.zeros(1))[:, 0])

    @cached_property
    def tangents(self) -> FloatArray:
        """(n_elements, 2) array: unit vectors along the chords."""
        chord = self.end - self.start
        return read_only(chord / norms(chord)[:, None])

    @cached_property
    def normals(self) -> FloatArray:
        """(n_elements, 2) array: unit normals of the chords, out of the body."""
        return read_only(turned_right(self.tangents))

    @cached_property
    def node_elements(self) -> IntArray:
        """(n_nodes, 2) int array: the element that ends and the element that starts at each node.

        On a symmetry line both are the one element there, whose image goes on, as at the ends of a half-plane.
        """
        pairs = np.empty((self.n_nodes, 2), dtype=np.intp)
        pairs[self.elements] = np.arange(self.n_elements)[:, None, None]
        pairs[self.elements[:, 1], 0] = np.arange(self.n_elements)
        pairs[self.elements[:, 0], 1] = np.arange(self.n_elements)
        return read_only(pairs)

    @cached_property
    def loops(self) -> tuple[IntArray, ...]:
        """For each closed loop its elements in order, starting at the smallest, or at a symmetry line.

        Of loops that are images of each other there is one; of a half-plane its strip.
        """
        if self.surface is not None:
            return (read_only(np.arange(self.n_elements)),)
        symmetric = self.symmetry is not None
        loops = restrict_loops(self.whole.loops, self.elements) if symmetric else follow_loops(self.elements)
        return tuple(read_only(loop) for loop in loops)

    @cached_property
    def centre(self) -> FloatArray:
        """(2,) array [m]: middle of the bounding box of the boundary, images included."""
        low, high = self._bounds
        return read_only(0.5 * (low + high))

    @cached_property
    def diameter(self) -> float:
        """Diagonal [m] of the bounding box of nodes and element centres."""
        low, high = self._bounds
        return float(np.hypot(*(high - low)))

    @cached_property
    def loop_areas(self) -> FloatArray:
        """(n_loops,) array [m^2]: area within each loop, images included, negative where the loop runs clockwise."""
        if self.symmetry is not None:
            return read_only(self.whole.loop_areas[[loop[0] < self.n_elements for loop in self.whole.loops]])
        areas = swept_areas(self._pieces)
        return read_only(np.array([areas[loop].sum() for loop in self.loops]))

    @property
    def area(self) -> float:
        """Area [m^2] of the body, images included, infinite for an exterior."""
        return float("inf") if self.is_exterior else float(self.whole.loop_areas.sum())

    def part(self, name: str) -> IntArray:
        """Return the elements (k,) of a part by its name, increasing, read-only.

        Raises
        ------
        UnknownPartError
            Listing the names there are.
        """
        if name not in self.parts:
            known = ", ".join(repr(known) for known in self.parts) or "none"
            raise UnknownPartError(f"BoundaryMesh: there is no part {name!r}: the parts are {known}")
        return self.parts[name]

    def points(self, elements: IntArray, xi: FloatArray) -> FloatArray:
        """Return points on elements.

        Parameters
        ----------
        elements : (m,) int array
            Indices of the elements.
        xi : (q,) or (m, q) array
            Local coordinates in [-1, 1], from start to end, common to all elements or one row for each.

        Returns
        -------
        (m, q, 2) array [m]
        """
        before, after = 0.5 - 0.5 * xi, 0.5 + 0.5 * xi
        straight = before[..., None] * self.start[elements][:, None] + after[..., None] * self.end[elements][:, None]
        return self._on_curves(elements, xi, straight)

    def derivatives(self, elements: IntArray, xi: FloatArray) -> FloatArray:
        """Differentiate elements: dx/dxi [m], (m, q, 2), for (m,) elements at (q,) or (m, q) local coordinates."""
        half_chord = 0.5 * (self.end[elements] - self.start[elements])
        straight = np.repeat(half_chord[:, None], xi.shape[-1], axis=1)
        if not self.curves:
            return straight
        derivative = self._on_curves(elements, xi, straight, derivative=True)
        # the chain rule: half the span of the parameter for xi from -1 to 1
        is_curved = ~self.is_straight[elements]
        if is_curved.any():
            derivative[is_curved] *= 0.5 * np.diff(self._span[elements][is_curved], axis=1)[:, :, None]
        return derivative

    def jacobian(self, elements: IntArray, xi: FloatArray) -> FloatArray:
        """Return |dx/dxi| [m], (m, q), for (m,) elements at (q,) or (m, q) local coordinates."""
        return norms(self.derivatives(elements, xi))

    def normals_at(self, elements: IntArray, xi: FloatArray) -> FloatArray:
        """Return unit normals out of the body, (m, q, 2), for (m,) elements at (q,) or (m, q) local coordinates."""
        derivative = self.derivatives(elements, xi)
        return turned_right(derivative / norms(derivative)[..., None])

    def refined(self, marked: IntArray) -> BoundaryMesh:
        """Bisect elements.

        Parameters
        ----------
        marked : (k,) int array
            Numbers of the elements to bisect.

        Returns
        -------
        BoundaryMesh
            Both halves take the place of the element in its parts and in the order of elements; curved elements are
            halved on their curve. The surface of a half-plane is divided anew instead.
        """
        marked = as_index(marked, "marked")
        if marked.size and not (marked.min() >= 0 and marked.max() < self.n_elements):
            raise GeometryError(
                f"BoundaryMesh: marked contains elements from {marked.min()} to {marked.max()}: "
                f"use numbers from 0 to {self.n_elements - 1}"
            )
        halves = bisected(self._content, np.isin(np.arange(self.n_elements), marked), self.centres)
        return BoundaryMesh(*halves, self.is_exterior, self.symmetry, self.surface)

    def transformed(self, shift: tuple[float, float] = (0.0, 0.0), factor: float = 1.0) -> BoundaryMesh:
        """Return the mesh of the body (x - shift) * factor, with the same elements and parts.

        Parameters
        ----------
        shift : (float, float) [m]
            Point that becomes the origin.
        factor : float
            Magnification, positive.
        """
        shift = as_point(shift, "BoundaryMesh: shift")
        require_positive("BoundaryMesh", factor=factor)
        return BoundaryMesh(*self._moved(shift, factor))

    def _moved(self, shift: tuple[float, float], factor: float) -> tuple[Any, ...]:
        """Return the arguments of the constructor."""
        symmetry, nodes = self.symmetry, (self.nodes - np.array(shift)) * factor
        if symmetry is not None:
            symmetry = symmetry.transformed(shift, factor)
            nodes = symmetry.snapped(nodes)
        curves = tuple(scaled_curve(curve, shift, (factor, factor)) for curve in self.curves)
        content = self._content._replace(nodes=read_only(nodes), curves=curves)
        return (*content, self.is_exterior, symmetry, self.surface)

    @cached_property
    def unit(self) -> BoundaryMesh:
        """The same mesh about the origin, in units of its diameter."""
        # coordinates lose nothing there: what was found valid is not checked again
        return unchecked_mesh(*self._moved(tuple(self.centre.tolist()), 1.0 / self.diameter))

    def unchecked_copy(self, nodes: FloatArray, curves: tuple[Curve, ...]) -> BoundaryMesh:
        """Return the mesh of the body moved rigidly, with its nodes (n_nodes, 2) [m] and curves there; no symmetry."""
        moved = self._content._replace(nodes=read_only(nodes), curves=curves)
        return unchecked_mesh(*moved, self.is_exterior, None, self.surface)

    @cached_property
    def _unfolded(self) -> BoundaryMesh:
        return self if self.symmetry is None else BoundaryMesh(*self.symmetry.unfold(self._content))

    @property
    def _content(self) -> Elements:
        return Elements(self.nodes, self.elements, self.parts, self.curves, self.element_curve, self.element_span)

    @cached_property
    def _curve_index(self) -> IntArray:
        return np.full(self.n_elements, -1) if self.element_curve is None else self.element_curve

    @cached_property
    def _span(self) -> FloatArray:
        return np.zeros((self.n_elements, 2)) if self.element_span is None else self.element_span

    @cached_property
    def _pieces(self) -> Pieces:
        return make_pieces(self.curves, self.start, self.end, self._curve_index, self._span)

    @cached_property
    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        if self.symmetry is not None:
            return self.whole._bounds
        points = np.concatenate([self.nodes, self.centres])
        return points.min(axis=0), points.max(axis=0)

    def _on_curves(
        self, elements: IntArray, xi: FloatArray, straight: FloatArray, *, derivative: bool = False
    ) -> FloatArray:
        """Replace the values (m, q, 2) of straight elements by those on curves where elements are curved."""
        if not self.curves:
            return straight
        curve = self._curve_index[elements]
        is_curved = curve >= 0
        if not is_curved.any():
            return straight
        span = self._span[elements]
        s = span[:, :1] * (0.5 - 0.5 * xi) + span[:, 1:] * (0.5 + 0.5 * xi)
        values = evaluate_curves(self.curves, curve, s, derivative=derivative)
        return values if is_curved.all() else np.where(is_curved[:, None, None], values, straight)


def unchecked_mesh(*content: Any) -> BoundaryMesh:
    """Return a mesh from the first arguments of its constructor, at least three, all of them valid."""
    mesh = object.__new__(BoundaryMesh)
    for entry, value in zip(fields(BoundaryMesh), content, strict=False):
        object.__setattr__(mesh, entry.name, value)
    return mesh
