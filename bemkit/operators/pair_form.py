"""Bilinear forms made of integrals over pairs of elements, and what is promised of their matrices."""

from __future__ import annotations

import enum
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

from bemkit.arrays import FloatArray
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.material import Material


class Functions(NamedTuple):
    """The functions of a boundary space, or their derivatives by the arc length."""

    space: BoundarySpace
    derivative: bool = False


@dataclass(frozen=True, eq=False)
class Term:
    """A part of a bilinear form: the integral of v^T G w over pairs of elements, with a 2 x 2 kernel G(x, y).

    With r = x - y, the kernel is a sum of scalar ones (see `bemkit.operators.integrals.sweep`) times constant tensors,

        G = tensors[0] (log|r| + shift) + tensors[1] Re(r / conj(r)) + tensors[2] Im(r / conj(r)),

    or the double layer k of the Laplace equation times one, G = tensors[0] k.

    Parameters
    ----------
    trial : Functions
        w, at the points y.
    tensors : (3, 2, 2) or (1, 2, 2) array
        By the scalar kernels and the components of v and w.
    shift : float
    """

    trial: Functions
    tensors: FloatArray
    shift: float = 0.0

    @property
    def is_double(self) -> bool:
        """Whether it is the double layer of the Laplace equation."""
        return len(self.tensors) == 1


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
        """Promised properties of its matrix."""
        return frozenset()

    @property
    def tested(self) -> Functions:
        """v, at the points x: those of the test space."""
        return Functions(self.test)

    @abstractmethod
    def terms(self) -> list[Term]:
        """Return the parts of the form; their sum is the form."""


def require_one_mesh(trial: BoundarySpace, test: BoundarySpace) -> None:
    """Raise GeometryError unless two spaces live on one mesh."""
    if trial.mesh is not test.mesh:
        msg = "trial and test space live on different meshes: build both on the same BoundaryMesh object"
        raise GeometryError(msg)
