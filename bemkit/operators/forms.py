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

from typing import TYPE_CHECKING

import numpy as np

from bemkit.errors import GeometryError
from bemkit.geometry.reflection import antisymmetric_dofs
from bemkit.geometry.series import columns_of, series
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.linear_solvers import Tag
from bemkit.operators.material import Material
from bemkit.operators.pair_form import Functions, PairForm, Term, require_one_mesh

if TYPE_CHECKING:
    from scipy.sparse import csr_array


_IDENTITY = np.eye(2)
_TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])
"""J."""
_HALF_QUOTIENT = 0.5 * np.array([[[1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [1.0, 0.0]]])
"""Tensors of the real and imaginary part of r / conj(r) in Q - I/2."""


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
