"""The bilinear forms of plane elasticity on boundary spaces, as combinations of scalar integrals over element pairs.

With r = y - x, Q = r r^T / |r|^2, J = [[0, 1], [-1, 0]], mu the shear modulus, nu the (effective) Poisson ratio, d/ds
the tangential derivative and k the Laplace double layer kernel, for continuous u on closed curves:

    <V t, q> = 1 / (8 pi mu (1 - nu)) int int q^T (-(3 - 4 nu) log(|r| / r0) I + Q) t
    <K u, q> = int int k q^T u + 1 / (4 pi (1 - nu)) int int q^T ((1 - 2 nu) J log|r| + J Q) du/ds
    <W u, v> = mu / (2 pi (1 - nu)) int int dv/ds^T (-log|r| I + Q) du/ds

so that all are combinations of the scalar integrals of `integrals`. The forms are those of [Steinbach2008] and
[SauterSchwab2011]; K and W are integrated by parts after [Han1994].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import GeometryError
from bemkit.geometry.series import columns_of, series
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.symmetry.images import antisymmetric_dofs
from bemkit.operators.linear_solvers import Tag
from bemkit.operators.material import Material

if TYPE_CHECKING:
    from scipy.sparse import csr_array


_IDENTITY = np.eye(2)
_TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])
"""J."""
_HALF_QUOTIENT = 0.5 * np.array([[[1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [1.0, 0.0]]])
"""Tensors of the real and imaginary part of r / conj(r) in Q - I/2."""


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


def single_layer_form(trial: BoundarySpace, test: BoundarySpace, material: Material) -> PairForm:
    """Return V: traction -> displacement; the constant part of Q is in the shift.

    It is symmetric and definite if both spaces are one; semidefinite for incompressible bodies, where V n = 0.
    """
    nu = material.effective_poisson_ratio
    factor = 1.0 / (8.0 * np.pi * material.shear_modulus * (1.0 - nu))
    tensors = factor * np.stack([-(3.0 - 4.0 * nu) * _IDENTITY, *_HALF_QUOTIENT])
    shift = -float(np.log(test.mesh.diameter)) - 0.5 / (3.0 - 4.0 * nu)
    tags = definite(trial, nu < 0.5) if trial is test else frozenset[Tag]()
    return PairForm(trial, test, material, Functions(test), (Term(Functions(trial), tensors, shift),), tags)


def double_layer_form(trial: BoundarySpace, test: BoundarySpace, material: Material) -> PairForm:
    """Return K: displacement -> displacement, for continuous displacements.

    It has the kernels that act on du/ds, and the scalar double layer of u. The constant part of Q is omitted, because
    the mean of du/ds on a closed curve is zero.
    """
    _require_continuous(trial, "double_layer", "trial")
    nu = material.effective_poisson_ratio
    factor = 1.0 / (4.0 * np.pi * (1.0 - nu))
    tensors = factor * _TURN @ np.stack([(1.0 - 2.0 * nu) * _IDENTITY, *_HALF_QUOTIENT])
    terms = Term(Functions(trial, derivative=True), tensors), Term(Functions(trial), _IDENTITY[None])
    return PairForm(trial, test, material, Functions(test), terms, frozenset())


def hypersingular_form(trial: BoundarySpace, test: BoundarySpace, material: Material) -> PairForm:
    """Return W: displacement -> traction, for continuous displacements.

    The constant part of Q is omitted, because the means of du/ds and dv/ds vanish. W is symmetric and semidefinite if
    both spaces are one; a space on curved elements does not contain rotations.
    """
    _require_continuous(trial, "hypersingular", "trial")
    _require_continuous(test, "hypersingular", "test")
    factor = material.shear_modulus / (2.0 * np.pi * (1.0 - material.effective_poisson_ratio))
    terms = (Term(Functions(trial, derivative=True), factor * np.stack([-_IDENTITY, *_HALF_QUOTIENT])),)
    is_straight = bool(trial.mesh.is_straight.all())
    kernel = Tag.KILLS_RIGID_MOTIONS if is_straight else Tag.KILLS_TRANSLATIONS
    symmetric = {Tag.SYMMETRIC, Tag.POSITIVE_SEMIDEFINITE} if trial is test else set[Tag]()
    return PairForm(trial, test, material, Functions(test, derivative=True), terms, frozenset(symmetric | {kernel}))


def definite(space: BoundarySpace, is_positive: bool = True) -> frozenset[Tag]:
    """Return the tags of a symmetric operator that is positive except on dofs that vanish by symmetry."""
    is_definite = is_positive and not antisymmetric_dofs(space).any()
    return frozenset({Tag.SYMMETRIC, Tag.POSITIVE_DEFINITE if is_definite else Tag.POSITIVE_SEMIDEFINITE})


def _require_continuous(space: BoundarySpace, operator: str, role: str) -> None:
    if not space.is_continuous:
        msg = (
            f"{operator} needs a continuous {role} space, but {type(space).__name__} may jump: "
            "take LagrangeSpace(mesh, degree=p), LinearSpace(mesh) or QuadraticSpace(mesh) without broken nodes"
        )
        raise GeometryError(msg)


def mass_matrix(trial: BoundarySpace, test: BoundarySpace) -> csr_array:
    """Return the identity <u, q>, a sparse (test.n_dofs, trial.n_dofs) array [m].

    Rows and columns of dofs that vanish by symmetry are zero.

    Notes
    -----
    The matrix is T_test D T_trial^T, with the Legendre coefficients T of the functions and the squared norms D of the
    polynomials.
    """
    from scipy.sparse import coo_array

    require_one_mesh(trial, test)
    wholes = series(test), series(trial)
    n = min(whole.shape[1] for whole in wholes) // test.mesh.n_elements
    elements = np.arange(test.mesh.n_elements)
    norms = np.sqrt(test.mesh.lengths[:, None] / (2.0 * np.arange(n) + 1.0)).ravel()
    # both factors carry the norms, so that the matrix of one space is symmetric to the last bit
    tested, acting = ((columns_of(whole, elements.size, elements, n) * norms).tocsr() for whole in wholes)
    scalar = (tested @ acting.T).tocoo()
    component = np.arange(2)[:, None]
    rows, columns = ((2 * dofs + component).ravel() for dofs in (scalar.row, scalar.col))
    keeps = ~(antisymmetric_dofs(test)[rows] | antisymmetric_dofs(trial)[columns])
    values = np.tile(scalar.data, 2)[keeps]
    return coo_array((values, (rows[keeps], columns[keeps])), shape=(test.n_dofs, trial.n_dofs)).tocsr()
