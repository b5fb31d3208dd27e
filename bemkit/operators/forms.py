"""The bilinear forms of plane elasticity on boundary spaces, as combinations of scalar integrals over element pairs.

With r = y - x, Q = r r^T / |r|^2, J = [[0, 1], [-1, 0]], mu the shear modulus, nu the (effective) Poisson ratio, d/ds
the tangential derivative and k the Laplace double layer kernel, for continuous u on closed curves:

    <V t, q> = 1 / (8 pi mu (1 - nu)) int int q^T (-(3 - 4 nu) log(|r| / r0) I + Q) t
    <K u, q> = int int k q^T u + 1 / (4 pi (1 - nu)) int int q^T ((1 - 2 nu) J log|r| + J Q) du/ds
    <W u, v> = mu / (2 pi (1 - nu)) int int dv/ds^T (-log|r| I + Q) du/ds

so that all of them are combinations of the scalar integrals of `integrals`. The forms are those of [Steinbach2008] and
[SauterSchwab2011], K and W integrated by parts after [Han1994].
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from bemkit.arrays import FloatArray, IntArray, read_only
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.local_values import of_one_degree
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.reflection import antisymmetric_dofs
from bemkit.geometry.spaces import BoundarySpace, local_coefficients
from bemkit.operators.integrals.pairs import Degrees
from bemkit.operators.pair_form import PairForm, Tag, TrialTerm, require_one_mesh


def _derivative(coefficients: FloatArray) -> FloatArray:
    """Return the Legendre coefficients of d/dxi of each row; a constant keeps one zero coefficient."""
    return np.asarray(coefficients @ _derivatives_of_polynomials(coefficients.shape[1]))


@lru_cache(maxsize=16)
def _derivatives_of_polynomials(n: int) -> FloatArray:
    """Return the Legendre coefficients, read-only, of dP_k/dxi in row k < n; one column at least."""
    return read_only(np.asarray(np.polynomial.legendre.legder(np.eye(n), axis=1), np.float64))


@dataclass(frozen=True, eq=False)
class SingleLayerForm(PairForm):
    """V: traction -> displacement."""

    @property
    def tags(self) -> frozenset[Tag]:
        """Symmetric and definite on one space; a uniform pressure does not deform an incompressible body: V n = 0."""
        is_one = self.trial is self.test
        return definite(self.trial, self.material.effective_poisson_ratio < 0.5) if is_one else frozenset()

    @property
    def degrees(self) -> Degrees:
        """The integrals it needs."""
        return Degrees(log=(self.test.degree, self.trial.degree))

    @property
    def test_coefficients(self) -> FloatArray:
        """Those of the basis."""
        return local_coefficients(self.test)

    def trial_terms(self) -> list[TrialTerm]:
        """Return the one term of V."""
        nu = self.material.effective_poisson_ratio
        factor = 1.0 / (8.0 * np.pi * self.material.shear_modulus * (1.0 - nu))
        log, half = -factor * (3.0 - 4.0 * nu), 0.5 * factor
        tensor = np.array([[half, log, 0.0], [-1j * half, 1j * log, 0.0]])
        shift = -float(np.log(self.test.mesh.diameter)) - 0.5 / (3.0 - 4.0 * nu)
        return [TrialTerm(local_coefficients(self.trial), tensor, shift=shift)]


@dataclass(frozen=True, eq=False)
class DoubleLayerForm(PairForm):
    """K: displacement -> displacement, for continuous displacements."""

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_continuous(self.trial, "double_layer", "trial")

    @property
    def degrees(self) -> Degrees:
        """The integrals it needs."""
        test, trial = self.test.degree, self.trial.degree
        return Degrees(log=(test, trial - 1), double=(test, trial))

    @property
    def test_coefficients(self) -> FloatArray:
        """Those of the basis."""
        return local_coefficients(self.test)

    def trial_terms(self) -> list[TrialTerm]:
        """Return the scalar double layer of u, and the kernels that act on du/ds."""
        coefficients = local_coefficients(self.trial)
        nu = self.material.effective_poisson_ratio
        factor = 1.0 / (4.0 * np.pi * (1.0 - nu))
        log, half = factor * (1.0 - 2.0 * nu), 0.5 * factor
        slope = np.array([[-1j * half, 1j * log, 0.0], [-half, -log, 0.0]])
        scalar = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1j]])
        return [
            TrialTerm(_derivative(coefficients), slope, of_slopes=(False, True)),
            TrialTerm(coefficients, scalar),
        ]


@dataclass(frozen=True, eq=False)
class HypersingularForm(PairForm):
    """W: displacement -> traction, for continuous displacements."""

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_continuous(self.trial, "hypersingular", "trial")
        _require_continuous(self.test, "hypersingular", "test")

    @property
    def tags(self) -> frozenset[Tag]:
        """Symmetric on one space; the rotation of a curved element is no polynomial, hence not in the space."""
        is_straight = bool(self.trial.mesh.is_straight.all())
        kernel = Tag.KILLS_RIGID_MOTIONS if is_straight else Tag.KILLS_TRANSLATIONS
        symmetric = {Tag.SYMMETRIC, Tag.POSITIVE_SEMIDEFINITE} if self.trial is self.test else set[Tag]()
        return frozenset(symmetric | {kernel})

    @property
    def degrees(self) -> Degrees:
        """The integrals it needs."""
        return Degrees(log=(self.test.degree - 1, self.trial.degree - 1))

    @property
    def test_coefficients(self) -> FloatArray:
        """Those of the derivative of the basis."""
        return _derivative(local_coefficients(self.test))

    def trial_terms(self) -> list[TrialTerm]:
        """Return the one term of W, on du/ds and dv/ds."""
        factor = self.material.shear_modulus / (2.0 * np.pi * (1.0 - self.material.effective_poisson_ratio))
        half = 0.5 * factor
        tensor = np.array([[half, -factor, 0.0], [-1j * half, -1j * factor, 0.0]])
        return [TrialTerm(_derivative(local_coefficients(self.trial)), tensor, of_slopes=(True, True))]


def definite(space: BoundarySpace, is_positive: bool = True) -> frozenset[Tag]:
    """Return the tags of a symmetric operator that is positive but on dofs that are zero by symmetry."""
    is_definite = is_positive and not antisymmetric_dofs(space).any()
    return frozenset({Tag.SYMMETRIC, Tag.POSITIVE_DEFINITE if is_definite else Tag.POSITIVE_SEMIDEFINITE})


def _require_continuous(space: BoundarySpace, operator: str, role: str) -> None:
    if not space.is_continuous:
        msg = (
            f"{operator} needs a continuous {role} space, but {type(space).__name__} may jump: "
            "take LagrangeSpace(mesh, degree=p), LinearSpace(mesh) or QuadraticSpace(mesh) without broken nodes"
        )
        raise GeometryError(msg)


class MassEntries(NamedTuple):
    """The entries of the identity <u, q> with their rows and columns, (n,) each; entries at one place add up."""

    values: FloatArray
    rows: IntArray
    columns: IntArray

    def times(self, functions: FloatArray, n_test: int) -> FloatArray:
        """Return <u, q> for all test functions q: (n_test, m), u in the columns of (n_trial, m)."""
        result = np.zeros((n_test, functions.shape[1]))
        np.add.at(result, self.rows, self.values[:, None] * functions[self.columns])
        return result


def mass_entries(trial: BoundarySpace, test: BoundarySpace) -> MassEntries:
    """Return the entries of the identity <u, q>."""
    require_one_mesh(trial, test)
    found = []
    for elements, (own_test, own_trial) in of_one_degree([test, trial], np.arange(test.mesh.n_elements)):
        points, weights = gauss_legendre(own_test.degree + own_trial.degree + 1)
        local = (own_test.basis(points) * weights) @ own_trial.basis(points).T
        values = (0.5 * test.mesh.lengths[elements])[:, None, None, None] * local[:, :, None] * np.ones(2)
        component = np.arange(2)
        rows = 2 * own_test.element_dofs[elements][:, :, None, None] + component + np.zeros_like(values, np.intp)
        columns = 2 * own_trial.element_dofs[elements][:, None, :, None] + component + np.zeros_like(values, np.intp)
        values[antisymmetric_dofs(test)[rows] | antisymmetric_dofs(trial)[columns]] = 0.0
        found.append((values.ravel(), rows.ravel(), columns.ravel()))
    return MassEntries(*(np.concatenate(each) for each in zip(*found, strict=True)))


def mass_product(trial: BoundarySpace, test: BoundarySpace, functions: FloatArray) -> FloatArray:
    """Return <u, q> for all test functions q: (test.n_dofs, m), u in the columns of (trial.n_dofs, m)."""
    return mass_entries(trial, test).times(functions, test.n_dofs)
