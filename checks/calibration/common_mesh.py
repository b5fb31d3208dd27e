"""A mesh with the nodes of two meshes of one body, on which the difference of two solutions is a polynomial."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.local_values import values_on_elements
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, LagrangeSpace
from bemkit.geometry.vectors import norms
from bemkit.operators.boundary import assemble, hypersingular, single_layer
from bemkit.results.solved_body import SolvedBody

MERGED = 1e-5
"""Share of a coarse element within which a node of the fine mesh counts as its end."""
INWARDS = 1e-9
"""Shift of the ends of pieces, so that a point between two fine elements is found on the right one."""
HIGHER, HIGHEST = 2, 8
"""Degrees by which the difference is higher than the coarse solution, and its largest degree: on pieces of elements
more changes the norm by less than a hundredth."""
_NEWTON_STEPS = 8


class Located(NamedTuple):
    """Points (m, q) on a mesh: elements and local coordinates."""

    elements: IntArray
    xi: FloatArray


def located(mesh: BoundaryMesh, points: FloatArray, elements: IntArray | None = None) -> Located:
    """Return the places nearest to points (m, q, 2) on some elements, by default on all."""
    chosen = np.arange(mesh.n_elements) if elements is None else elements
    flat, start = points.reshape(-1, 2), mesh.start[chosen]
    chord = mesh.end[chosen] - start
    along = np.clip(np.einsum("nec,ec->ne", flat[:, None] - start, chord) / np.sum(chord**2, axis=1), 0.0, 1.0)
    best = np.argmin(norms(start + along[:, :, None] * chord - flat[:, None]), axis=1)
    found, xi = chosen[best], 2.0 * along[np.arange(len(flat)), best] - 1.0
    for _ in range(_NEWTON_STEPS):  # from the chord to the curve
        tangents = mesh.derivatives(found, xi[:, None])[:, 0]
        misses = flat - mesh.points(found, xi[:, None])[:, 0]
        xi = np.clip(xi + np.sum(misses * tangents, axis=1) / np.sum(tangents**2, axis=1), -1.0, 1.0)
    return Located(found.reshape(points.shape[:2]), xi.reshape(points.shape[:2]))


@dataclass(frozen=True, eq=False)
class CommonMesh:
    """The elements of a coarse mesh, cut at the nodes of a fine one.

    Parameters
    ----------
    coarse, fine : SolvedBody
    """

    coarse: SolvedBody
    fine: SolvedBody

    @cached_property
    def _cuts(self) -> list[FloatArray]:
        """Local coordinates of the ends of the pieces of each coarse element."""
        mesh = self.coarse.mesh
        elements, xi = (column[:, 0] for column in located(mesh, self.fine.mesh.nodes[:, None]))
        is_inside = np.abs(xi) < 1.0 - 2.0 * MERGED
        cuts = []
        for element in range(mesh.n_elements):
            inner = np.sort(xi[is_inside & (elements == element)])
            cuts.append(np.concatenate([[-1.0], inner[np.diff(inner, prepend=-1.0) > 2.0 * MERGED], [1.0]]))
        return cuts

    @cached_property
    def parents(self) -> IntArray:
        """(n_pieces,) array: the coarse element of each piece."""
        return np.repeat(np.arange(self.coarse.mesh.n_elements), [len(xi) - 1 for xi in self._cuts])

    @cached_property
    def spans(self) -> FloatArray:
        """(n_pieces, 2) array: local coordinates of each piece on its coarse element."""
        return np.concatenate([np.column_stack([xi[:-1], xi[1:]]) for xi in self._cuts])

    @cached_property
    def mesh(self) -> BoundaryMesh:
        """The pieces as elements."""
        old, parents, spans = self.coarse.mesh, self.parents, self.spans
        is_inner, is_last = spans[:, 0] > -1.0, spans[:, 1] == 1.0
        inner = old.points(parents[is_inner], spans[is_inner, :1])[:, 0]
        starts = old.elements[parents, 0]
        starts[is_inner] = old.n_nodes + np.arange(len(inner))
        ends = np.where(is_last, old.elements[parents, 1], np.append(starts[1:], -1))
        curve = span = None
        if old.element_curve is not None and old.element_span is not None:
            curve, own = old.element_curve[parents], old.element_span[parents]
            inside = own[:, :1] + 0.5 * (spans + 1.0) * (own[:, 1:] - own[:, :1])
            span = np.where(np.column_stack([is_inner, ~is_last]), inside, own)
        parts = {name: np.flatnonzero(np.isin(parents, elements)) for name, elements in old.parts.items()}
        nodes, elements = np.concatenate([old.nodes, inner]), np.column_stack([starts, ends])
        return BoundaryMesh(nodes, elements, parts, old.curves, curve, span, is_exterior=old.is_exterior)

    def on_coarse(self, pieces: IntArray, xi: FloatArray) -> Located:
        """Return where local coordinates (q,) of some pieces lie on the coarse mesh."""
        start, end = self.spans[pieces].T[:, :, None]
        places = 0.5 * (start * (1.0 - xi) + end * (1.0 + xi))
        return Located(np.broadcast_to(self.parents[pieces, None], places.shape), places)

    def on_fine(self, pieces: IntArray, xi: FloatArray) -> Located:
        """Return where they lie on the fine mesh."""
        return located(self.fine.mesh, self.mesh.points(pieces, (1.0 - INWARDS) * xi))

    def squared_error(self) -> float:
        """Return <W e, e> + <V d, d> [J/m] of the differences e of displacements and d of tractions."""
        coarse, fine = space_of(self.coarse).degree, space_of(self.fine).degree
        degree = min(max(coarse, fine), coarse + HIGHER, HIGHEST)
        mesh, material = self.mesh, self.coarse.scene.material
        displacements = LagrangeSpace(mesh, degree=degree)
        tractions = LagrangeSpace(mesh, np.ones(mesh.n_nodes, bool), degree=degree - 1)
        e, d = self._difference(displacements_at, displacements), self._difference(tractions_at, tractions)
        strained = hypersingular(displacements, displacements, material)
        loaded = single_layer(tractions, tractions, material)
        assemble(strained, loaded)
        return float(e @ strained.matrix() @ e + d @ loaded.matrix() @ d)

    def _difference(self, field: Callable[[SolvedBody, Located], FloatArray], space: BoundarySpace) -> FloatArray:
        """Return the dofs (n_dofs,) of the difference of the two solutions."""
        pieces, values = np.arange(self.mesh.n_elements), np.empty((space.n_dofs // 2, 2))
        fine = field(self.fine, self.on_fine(pieces, space.local_nodes))
        values[space.element_dofs] = fine - field(self.coarse, self.on_coarse(pieces, space.local_nodes))
        return values.ravel()


def space_of(body: SolvedBody) -> BoundarySpace:
    """Return the space of the displacements."""
    return body.scene.discretisation.displacement_space(body.mesh)


def values_at(space: BoundarySpace, at_nodes: FloatArray, places: Located) -> FloatArray:
    """Return the values (m, q, c) of a function with the values (n_elements, n_local, c) at the local nodes."""
    basis = space.basis(places.xi.ravel()).T.reshape(*places.xi.shape, at_nodes.shape[1])
    return np.asarray(np.einsum("mql,mqlc->mqc", basis, at_nodes[places.elements]))


def displacements_at(body: SolvedBody, places: Located) -> FloatArray:
    """Return displacements (m, q, 2) [m]."""
    space = space_of(body)
    return values_at(space, values_on_elements(space, body.boundary.displacement), places)


def tractions_at(body: SolvedBody, places: Located) -> FloatArray:
    """Return tractions (m, q, 2) [Pa]."""
    space = body.scene.discretisation.traction_space(body.mesh)
    return values_at(space, body.boundary.traction_dofs.reshape(body.mesh.n_elements, -1, 2), places)
