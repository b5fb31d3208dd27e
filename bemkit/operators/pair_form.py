"""Bilinear forms made of integrals over pairs of elements, and what is promised of their matrices."""

from __future__ import annotations

import enum
from abc import ABC, abstractmethod
from dataclasses import dataclass

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.integrals.pairs import Degrees
from bemkit.operators.material import Material


@dataclass(frozen=True, eq=False)
class TrialTerm:
    """One part of an operator: a 2 x 2 tensor of combinations of the scalar integrals of P_a (test) and P_b (trial).

    Parameters
    ----------
    coefficients : (n_local, n_polynomials) array
        Legendre coefficients of what the kernel acts on: the trial functions or their derivatives.
    tensor : (2, 3) complex array
        By the components of the test function, and by the integrals of the quotient, the logarithm and the double
        layer. What acts on the components of the trial function is one complex number, its real part on x and its
        imaginary part on y.
    of_slopes : (bool, bool)
        Whether it acts on tangential derivatives of the test and of the trial functions.
    shift : float
        What is added to the logarithm.
    """

    coefficients: FloatArray
    tensor: ComplexArray
    of_slopes: tuple[bool, bool] = (False, False)
    shift: float = 0.0


class Tag(enum.Enum):
    """Promises about an operator; `bemkit.testing.check_operator` proves each one."""

    SYMMETRIC = "symmetric"
    POSITIVE_DEFINITE = "positive definite"
    POSITIVE_SEMIDEFINITE = "positive semidefinite"
    KILLS_RIGID_MOTIONS = "zero on rigid motions"
    KILLS_TRANSLATIONS = "zero on translations"


@dataclass(frozen=True, eq=False)
class PairForm(ABC):
    """A bilinear form <A trial, test> made of integrals over pairs of elements.

    Parameters
    ----------
    trial, test : BoundarySpace
        The space of the argument, and the one that the result is tested with.
    material : Material

    Raises
    ------
    GeometryError
        If the spaces live on different meshes.
    """

    trial: BoundarySpace
    test: BoundarySpace
    material: Material

    def __post_init__(self) -> None:
        require_one_mesh(self.trial, self.test)

    @property
    def tags(self) -> frozenset[Tag]:
        """What is promised of its matrix."""
        return frozenset()

    @property
    @abstractmethod
    def degrees(self) -> Degrees:
        """The integrals it needs."""

    @property
    @abstractmethod
    def test_coefficients(self) -> FloatArray:
        """(n_local, n_polynomials) Legendre coefficients on the test element."""

    @abstractmethod
    def trial_terms(self) -> list[TrialTerm]:
        """Return the parts that share the test coefficients."""


def require_one_mesh(trial: BoundarySpace, test: BoundarySpace) -> None:
    """Raise GeometryError unless two spaces live on one mesh."""
    if trial.mesh is not test.mesh:
        msg = "trial and test space live on different meshes: build both on the same BoundaryMesh object"
        raise GeometryError(msg)
