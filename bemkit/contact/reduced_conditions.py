"""Two linear conditions at each node, reduced to unknown tractions and one equation for each of them.

Pairs (n, t) are complex numbers with the tangential component as real part and the normal component as imaginary part.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.contact.body import SingularResponse
from bemkit.operators.boundary_equations import LinearConditions


def as_complex(pairs: FloatArray) -> ComplexArray:
    """Return pairs (..., 2) of normal and tangential components as complex numbers."""
    return np.asarray(pairs[..., 1] + 1j * pairs[..., 0])


def as_pairs(numbers: ComplexArray) -> FloatArray:
    """Return complex numbers as pairs (..., 2) of normal and tangential components."""
    return np.stack([numbers.imag, numbers.real], axis=-1)


@dataclass(frozen=True, eq=False)
class ReducedConditions:
    """Tractions ``t = given + sum of direction * unknown``, with one equation for each unknown.

    Parameters
    ----------
    given : (n_contact,) complex array [Pa]
        Tractions from conditions without displacements; zero elsewhere.
    node : (n_unknowns,) int array
        The node of each unknown, ascending; a node may have two unknowns.
    direction : (n_unknowns,) complex array
        Unit traction of each unknown.
    on_displacement, on_traction : (n_unknowns,) complex arrays
        Factors of the equation of each unknown. The factor of the displacement has unit size; an equation is the real
        part of ``conj(factor) * number``.
    value : (n_unknowns,) array [m]
        Right-hand sides.
    """

    given: ComplexArray
    node: IntArray
    direction: ComplexArray
    on_displacement: ComplexArray
    on_traction: ComplexArray
    value: FloatArray

    @classmethod
    def of(cls, conditions: LinearConditions) -> ReducedConditions:
        """Reduce conditions.

        Raises
        ------
        SingularResponse
            If two conditions on the traction of a node are dependent, or a condition has only zero factors.
        """
        on_u, on_t = conditions.on_displacement, conditions.on_traction
        is_of_traction = ~(on_u != 0.0).any(axis=2)
        n_of_traction = is_of_traction.sum(axis=1)
        given, along = np.zeros(len(on_u), complex), np.zeros(len(on_u), complex)
        both, one = np.flatnonzero(n_of_traction == 2), np.flatnonzero(n_of_traction == 1)
        try:
            given[both] = as_complex(np.asarray(np.linalg.solve(on_t[both], conditions.value[both][..., None]))[..., 0])
        except np.linalg.LinAlgError as error:
            raise SingularResponse("two conditions on the traction of a contact node are not independent") from error
        row = np.argmax(is_of_traction[one], axis=1)
        factor = as_complex(on_t[one, row])
        if not np.abs(factor).all():
            raise SingularResponse("a condition at a contact node involves neither displacement nor traction")
        given[one] = conditions.value[one, row] * factor / np.abs(factor) ** 2
        # the unknown is perpendicular to the factor, with a non-negative normal component
        along[one] = 1j * factor / np.abs(factor)
        along[one] *= np.where(along[one].imag < 0.0, -1.0, 1.0)
        node, equation = np.nonzero(~is_of_traction)
        direction = np.where(n_of_traction[node] == 1, along[node], np.where(equation == 0, 1j, 1.0))
        size = np.hypot(*on_u[node, equation].T)
        return cls(
            given,
            node,
            direction,
            as_complex(on_u[node, equation]) / size,
            as_complex(on_t[node, equation]) / size,
            conditions.value[node, equation] / size,
        )

    @property
    def n_unknowns(self) -> int:
        """Number of unknowns."""
        return self.node.size

    def _summed(self, numbers: ComplexArray) -> ComplexArray:
        """Return the sum (n_contact,) over the unknowns of each node."""
        result = np.zeros(self.given.size, complex)
        result[self.node] = numbers
        result[self.node[self._is_second]] += numbers[self._is_second - 1]
        return result

    @cached_property
    def _is_second(self) -> IntArray:
        """Indices of unknowns with the same node as the unknown before."""
        return 1 + np.flatnonzero(self.node[1:] == self.node[:-1])

    def changes(self, unknowns: FloatArray) -> ComplexArray:
        """Return the tractions (n_contact,) of the unknowns, without given ones."""
        return self._summed(self.direction * unknowns)

    def tractions(self, unknowns: FloatArray) -> ComplexArray:
        """Return all tractions (n_contact,)."""
        return self.given + self.changes(unknowns)

    def rows(self, displacement: ComplexArray, traction: ComplexArray) -> FloatArray:
        """Return the left-hand sides (n_unknowns,) of the equations."""
        left = self._displacement_factor * displacement[self.node]
        if self._traction_factor.any():
            left += self._traction_factor * traction[self.node]
        return np.asarray(left.real)

    @cached_property
    def _displacement_factor(self) -> ComplexArray:
        return np.asarray(self.on_displacement.conj())

    @cached_property
    def _traction_factor(self) -> ComplexArray:
        return np.asarray(self.on_traction.conj())

    def displacements(self, rows: FloatArray, stiffness: float) -> ComplexArray:
        """Return the smallest approximate displacements (n_contact,) with left-hand sides `rows` (n_unknowns,).

        Tractions in an equation are estimated with the stiffness [Pa/m] of a node.
        """
        return self._summed(self.on_displacement * rows / (1.0 + self._softness * stiffness))

    def unknowns(self, traction: ComplexArray, rows: FloatArray, stiffness: float) -> FloatArray:
        """Return the unknowns (n_unknowns,) in tractions that belong to displacements with left-hand sides `rows`.

        An equation with tractions is solved separately, with the stiffness [Pa/m] of a node.
        """
        components = (self._along * traction[self.node]).real
        if not self._traction_factor.any():
            return np.asarray(components)
        softness = self._softness
        return np.asarray(np.where(softness == 0.0, components, rows * stiffness / (1.0 + softness * stiffness)))

    @cached_property
    def _softness(self) -> FloatArray:
        """(n_unknowns,) array [m/Pa]: size of the factor of each unknown traction in its equation."""
        return np.asarray(np.abs((self._traction_factor * self.direction).real))

    @cached_property
    def _along(self) -> ComplexArray:
        return np.asarray(self.direction.conj())
