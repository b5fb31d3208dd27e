"""Entries of Galerkin's equations -V t + B u = 0 and B^T t + W u = f, for any unknowns, with B = M / 2 + K.

Each dof has a place: the nodes of the displacements, where the forces f act, and the dofs of the tractions. Its
unknowns are numbered as those of collocation, 4 * place + 2 * kind + component: kind 1 is the displacement of a node,
kind 0 its force by its weight, or a traction. Its two equations are those tested with its own function. Tractions are
measured by E' / h, h the length of the element, and their equations multiplied by the same, so that all entries of
neighbours are those of E' times a number: equations of one size are all solved to round-off. But for the forces, which
no other equation feels, the matrix is symmetric, and one skeleton of a cluster serves rows and columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.reflection import antisymmetric_dofs
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.operators.forms import mass_entries
from bemkit.operators.hierarchy.dof_functions import DofFunctions, at_elements, at_points, supports
from bemkit.operators.hierarchy.element_fields import Constants
from bemkit.operators.hierarchy.element_pairs import ElementPairs, Rule, by_kind
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.material import Material

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_PROXY_POINTS = 12
"""Gauss points of an element that is seen from a proxy circle, which may be half a length away from its end."""
_PLACES = 1024
"""Places whose unknowns are put into the equations at a time."""


@dataclass(frozen=True, eq=False)
class GalerkinColumns:
    """The dofs of displacements and tractions in the order of a tree, and what they cause.

    Parameters
    ----------
    material : Material
    constants : Constants
    order : (n_places,) array
        The node at each place, or the number of nodes and that of a traction dof.
    is_node : (n_places,) bool array
    start, centre, end : (n_places,) complex arrays [m]
        The points where the function of each dof begins, has its node, and ends.
    lengths : (n_places,) array [m]
        Of the shortest element that each function covers.
    weights : (n_places,) array [m]
        Integrals of the functions.
    idle : (2 n_places,) bool array
        Unknowns that are zero by symmetry.
    image_signs : (2,) array
        Sums of the signs that the components have in all images.
    pairs : ElementPairs
    functions : DofFunctions
    mass : (2 n_places, 2 n_places) sparse array
        M / 2 and its transpose.
    proxy_rule : Rule
    at_proxies : (n_places, n_elements * n_points) sparse array
        The functions at the points of this rule, times lengths and weights.
    """

    material: Material
    constants: Constants
    order: IntArray
    is_node: BoolArray
    start: ComplexArray
    centre: ComplexArray
    end: ComplexArray
    lengths: FloatArray
    weights: FloatArray
    idle: BoolArray
    image_signs: FloatArray
    pairs: ElementPairs
    functions: DofFunctions
    mass: csr_array
    proxy_rule: Rule
    at_proxies: csr_array
    is_symmetric = True

    @classmethod
    def of(
        cls, displacements: BoundarySpace, tractions: BoundarySpace, material: Material, order: IntArray
    ) -> GalerkinColumns:
        """Return the dofs of two spaces in the order of a tree."""
        mesh, spaces, degree = displacements.mesh, (displacements, tractions), displacements.degree
        panels = Panels(mesh.whole)
        start, end, lengths, weights = supports(spaces, panels)
        points = np.concatenate([dof_points(space) for space in spaces])[order]
        idle = np.concatenate([antisymmetric_dofs(space).reshape(-1, 2) for space in spaces])[order]
        return cls(
            material,
            Constants.of(material, mesh.diameter),
            order,
            order < displacements.n_dofs // 2,
            start[order],
            points @ np.array([1.0, 1j]),
            end[order],
            lengths[order],
            weights[order],
            idle.ravel(),
            np.ones(2) if mesh.symmetry is None else mesh.symmetry.images.sum(axis=0),
            ElementPairs.of(mesh, degree),
            DofFunctions.of(displacements, tractions, panels, order),
            _half_mass(displacements, tractions, order),
            Rule.of(panels, (_PROXY_POINTS,), degree),
            at_points(spaces, panels, _PROXY_POINTS)[order],
        )

    @property
    def n_elements(self) -> int:
        """Number of places."""
        return self.order.size

    @property
    def reach(self) -> IntArray:
        """(1, n_places) places on which each dof acts: itself."""
        return np.arange(self.order.size)[None]

    @cached_property
    def units(self) -> FloatArray:
        """(n_places,) array [Pa/m, or 1 at nodes]: of the tractions, by which their equations are multiplied, too."""
        return np.where(self.is_node, 1.0, self.material.plane_modulus / self.lengths)

    @property
    def sizes(self) -> FloatArray:
        """(n_places,) array by which the equations become displacements."""
        return np.where(self.is_node, self.material.plane_modulus, self.weights * self.units)

    def rows_of(self, columns: IntArray) -> IntArray:
        """Return the equations 2 * place + component that belong to columns."""
        rows: IntArray = 2 * (columns // 4) + columns % 2
        return rows

    def felt(self, columns: IntArray) -> IntArray:
        """Return those of some columns that other equations feel: all but the forces."""
        felt: IntArray = columns[(columns // 2) % 2 == self.is_node[columns // 4]]
        return felt

    def beside(self, places: IntArray) -> IntArray:
        """Return some nodes and the tractions on the elements around them, by place."""
        around = self.functions.touching(places)
        return np.asarray(np.union1d(places, around[~self.is_node[around]]))

    def entries(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return entries (n_rows, n_columns) of the equations; rows are 2 * place + component."""
        dofs = self.rows_of(columns)
        is_force = (columns // 2) % 2 != self.is_node[columns // 4]
        if not is_force.any():
            return self.between(rows, dofs)
        block = np.zeros((rows.size, columns.size))
        block[:, ~is_force] = self.between(rows, dofs[~is_force])
        row, column = np.nonzero(rows[:, None] == np.where(is_force, dofs, -1))
        block[row, column] = -self.weights[rows[row] // 2]
        return block

    def between(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return entries (n_rows, n_columns) by 2 * place + component, of tractions and of displacements of nodes."""
        places, numbers, n_nodes = zip(*(self._by_kind(each // 2) for each in (rows, columns)), strict=True)
        block = self._integrals(places[0], n_nodes[0], places[1], n_nodes[1])
        block = block.reshape(2 * places[0].size, -1)[
            np.ix_(rows % 2 * places[0].size + numbers[0], columns % 2 * places[1].size + numbers[1])
        ]
        mass = self.mass[rows][:, columns].tocoo()
        block[mass.row, mass.col] += mass.data
        block *= self.units[rows // 2, None]
        block *= self.units[columns // 2]
        if self.idle.any():
            block[self.idle[rows]] = 0.0
            block[:, self.idle[columns]] = 0.0
            row, column = np.nonzero((rows[:, None] == columns) & (self.idle[rows] & ~self.is_node[rows // 2])[:, None])
            block[row, column] = -self.material.plane_modulus
        return block

    def fields(self, x: ComplexArray, columns: IntArray) -> FloatArray:
        """Return displacements (2 n_points, n_columns) that columns cause at distant points, without images."""
        places, number = np.unique(columns // 4, return_inverse=True)
        result, of = np.empty((places.size, 2, x.size), complex), self.constants
        for is_node in (False, True):
            chosen = np.flatnonzero(self.is_node[places] == is_node)
            factors, elements = at_elements(self.at_proxies[places[chosen]], _PROXY_POINTS)
            y, tangent = (
                each[:, elements].T.reshape(-1, 1) for each in (self.proxy_rule.point, self.proxy_rule.tangent)
            )
            rho = x - y
            squared = np.square(rho.real) + np.square(rho.imag)
            turn = rho * rho / squared
            if is_node:
                nu, rate = of.poisson_ratio, tangent * rho.conj() / squared
                on = of.double * ((2.0 - 2.0 * nu) * rate.imag - 1j * (1.0 - 2.0 * nu) * rate.real)
                on_conjugate = of.double * turn * rate.imag
            else:
                on = of.single * ((1.5 - 2.0 * of.poisson_ratio) * np.log(squared / of.log_length**2) - 0.5)
                on_conjugate = (-0.5 * of.single) * turn
            units = self.units[places[chosen], None]
            on, on_conjugate = units * (factors @ on), units * (factors @ on_conjugate)
            result[chosen, 0], result[chosen, 1] = on + on_conjugate, 1j * (on - on_conjugate)
        return result[number, columns % 2].view(float).T

    def applied(self, places: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return what is left (n, 2) of the equations of some places.

        Parameters
        ----------
        places : (n,) array
        traction, displacement : (n_places, 2) arrays
            By place: tractions in their units, or the forces of nodes by their weights, and displacements of nodes.
        """
        values = np.where(self.is_node[:, None], displacement, traction).ravel()
        rows = (2 * places[:, None] + np.arange(2)).ravel()
        left = np.zeros(rows.size)
        for begin in range(0, self.order.size, _PLACES):
            own = np.arange(2 * begin, 2 * min(begin + _PLACES, self.order.size))
            left += self.between(rows, own) @ values[own]
        of_forces = np.where(self.is_node[places], self.weights[places], 0.0)
        result: FloatArray = left.reshape(-1, 2) - of_forces[:, None] * traction[places]
        return result

    def _by_kind(self, places: IntArray) -> tuple[IntArray, IntArray, int]:
        """Return the different places, nodes first, the number of each of those given, and the number of nodes."""
        found, number = np.unique(places, return_inverse=True)
        is_node = self.is_node[found]
        by_kind = np.argsort(~is_node, kind="stable")
        rank = np.empty_like(by_kind)
        rank[by_kind] = np.arange(by_kind.size)
        return found[by_kind], rank[number], int(np.count_nonzero(is_node))

    def _integrals(self, test: IntArray, n_test: int, trial: IntArray, n_trial: int) -> FloatArray:
        """Return entries without masses of places, the first `n_test` and `n_trial` of which are nodes.

        Returns
        -------
        (2, n, 2, m) array
            By component and number of the row, component and number of the column.
        """
        tested, acting = self.functions.tested(test, n_test), self.functions.acting(trial, n_trial)
        integrals = by_kind(self.pairs.integrals(tested.elements, acting[0].elements), self.pairs.degree)
        rates = [tested.rate @ each for each in integrals[:3]]
        to, fro = tested.rate[n_test:] @ integrals[3], tested.value @ integrals[4]
        parts = (slice(n_test), slice(n_test, None)), (slice(n_trial), slice(n_trial, None))
        single, double, nu = self.constants.single, self.constants.double, self.constants.poisson_ratio
        kappa, of_slopes = 3.0 - 4.0 * nu, 2.0 * self.material.shear_modulus * double
        of_log, of_turn = (-of_slopes, kappa * single), (0.5 * of_slopes, -0.5 * single)
        constant = single * (kappa * np.log(self.constants.log_length) + 0.5)
        measure = constant * np.outer(self.weights[test[n_test:]], self.weights[trial[n_trial:]])
        block = np.empty((2, test.size, 2, trial.size))
        for d, functions in enumerate(acting):
            if d == 0 or functions is not acting[0]:
                products = [each @ functions.rate.T for each in rates]
                of_double, of_adjoint = to @ functions.value.T, fro @ functions.rate[n_trial:].T
            sign = 1.0 - 2.0 * d
            for (i, rows), (j, columns) in product(enumerate(parts[0]), enumerate(parts[1])):
                log, real, imaginary = (each[rows, columns] for each in products)
                if i == j:
                    block[d, rows, d, columns] = of_log[i] * log + (sign * of_turn[i]) * real
                    block[1 - d, rows, d, columns] = of_turn[i] * imaginary
                else:
                    of_ratio = double * (1.0 - 2.0 * nu) * (1.0 if d == i else -1.0)
                    block[d, rows, d, columns] = (of_double if i else of_adjoint) + (0.5 * sign * double) * imaginary
                    block[1 - d, rows, d, columns] = of_ratio * log - (0.5 * double) * real
            block[d, n_test:, d, n_trial:] -= self.image_signs[d] * measure
        return block


def _half_mass(displacements: BoundarySpace, tractions: BoundarySpace, order: IntArray) -> csr_array:
    """Return M / 2 and its transpose, by 2 * place + component."""
    from scipy.sparse import csr_array

    values, rows, columns = mass_entries(displacements, tractions)
    place = np.empty_like(order)
    place[order] = np.arange(order.size)
    n_nodes, kept = displacements.n_dofs // 2, values != 0.0
    test, trial = 2 * place[n_nodes + rows // 2] + rows % 2, 2 * place[columns // 2] + columns % 2
    half, rows = np.tile(0.5 * values[kept], 2), np.concatenate([test[kept], trial[kept]])
    return csr_array((half, (rows, np.concatenate([trial[kept], test[kept]]))), shape=(2 * order.size, 2 * order.size))
