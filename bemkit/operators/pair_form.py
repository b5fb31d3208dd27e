"""Bilinear forms as integrals over pairs of elements, and the properties of their matrices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from bemkit.arrays import FloatArray
from bemkit.errors import GeometryError
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.linear_solvers import Tag
from bemkit.operators.material import Material


class Functions(NamedTuple):
    """The functions of a boundary space, or their derivatives with respect to arc length."""

    space: BoundarySpace
    derivative: bool = False


@dataclass(frozen=True, eq=False)
class Term:
    """A term of a bilinear form: the integral of v^T G w over pairs of elements, with a 2 x 2 kernel G(x, y).

    With r = x - y, the kernel is a sum of scalar kernels (see `bemkit.operators.integrals.sweep`) times constant
    tensors,

        G = tensors[0] (log|r| + shift) + tensors[1] Re(r / conj(r)) + tensors[2] Im(r / conj(r)),

    or the double layer k of the Laplace equation times a tensor, G = tensors[0] k.

    Parameters
    ----------
    trial : Functions
        w, at the points y.
    tensors : (3, 2, 2) or (1, 2, 2) array
        Axes scalar kernel, component of v, component of w.
    shift : float
    """

    trial: Functions
    tensors: FloatArray
    shift: float = 0.0

    @property
    def is_double(self) -> bool:
        """Whether the kernel is the double layer of the Laplace equation."""
        return len(self.tensors) == 1


@dataclass(frozen=True, eq=False)
class PairForm:
    """A bilinear form <A trial, test> of integrals over pairs of elements.

    Parameters
    ----------
    trial, test : BoundarySpace
        Spaces of the argument and of the test functions.
    material : Material
    tested : Functions
        v, at the points x: functions of the test space.
    terms : tuple of Term
        Their sum is the form.
    tags : frozenset of Tag
        Properties of the matrix.

    Raises
    ------
    GeometryError
        If the spaces are defined on different meshes.
    """

    trial: BoundarySpace
    test: BoundarySpace
    material: Material
    tested: Functions
    terms: tuple[Term, ...]
    tags: frozenset[Tag]

    def __post_init__(self) -> None:
        require_one_mesh(self.trial, self.test)


def require_one_mesh(trial: BoundarySpace, test: BoundarySpace) -> None:
    """Raise GeometryError unless two spaces are defined on one mesh."""
    if trial.mesh is not test.mesh:
        msg = "trial and test space are defined on different meshes: build both on the same BoundaryMesh object"
        raise GeometryError(msg)
