"""Conformance of boundary operators."""

from __future__ import annotations

import numpy as np
from scipy.sparse.linalg import LinearOperator

from bemkit.arrays import FloatArray
from bemkit.geometry.spaces import dof_points
from bemkit.operators.boundary import BoundaryOperator, mass
from bemkit.operators.linear_solvers import Tag
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.testing.failure import class_name, demand


def check_operator(operator: BoundaryOperator, *, adjoint: BoundaryOperator | None = None, rtol: float = 1e-11) -> None:
    """Check everything that `BoundaryOperator` promises, each of its tags included; call it on your own operator.

    Parameters
    ----------
    operator : BoundaryOperator
        Fresh: if it has the property `is_assembled`, as all of bemkit's own do, that must still be False, which
        proves that the matrix is built on first use.
    adjoint : BoundaryOperator, optional
        Another operator that claims to be its adjoint.
    rtol : float
        Allowed errors, relative to the largest entry of the matrix: those of its integrals and of sums over a row.

    Raises
    ------
    CheckFailed
        Naming the operator, the promise broken, and by how much.
    """
    name = class_name(operator)
    demand(operator.trial.mesh is operator.test.mesh, f"{name}: trial and test space are defined on different meshes")
    demand(
        isinstance(operator.tags, frozenset) and all(isinstance(tag, Tag) for tag in operator.tags),
        f"{name}.tags is {operator.tags!r}, not a frozenset of Tag",
    )
    demand(
        not getattr(operator, "is_assembled", False),
        f"{name} is assembled before its matrix is asked for: pass a fresh one",
    )
    random = np.random.default_rng(0)
    rows, columns = (np.sort(random.choice(n, min(n, 5), replace=False)) for n in operator.shape)
    block = operator.block(rows, columns)
    matrix = _checked_matrix(operator, name)
    demand(block.shape == (len(rows), len(columns)), f"{name}.block() has the shape {block.shape}")
    _small(block - matrix[np.ix_(rows, columns)], matrix, rtol, f"{name}.block() is not that of the matrix: it differs")
    _check_products(operator, name, matrix, rtol, random)
    for tag in sorted(operator.tags, key=lambda tag: tag.name):
        _check_tag(tag, operator, name, matrix, rtol)
    if adjoint is not None:
        other = _dense(adjoint)
        expected = matrix.T.shape
        demand(other.shape == expected, f"the adjoint of {name} has the shape {other.shape}, not {expected}")
        _small(other - matrix.T, matrix, rtol, f"{type(adjoint).__name__} is not the transpose of {name}: it differs")


def check_double_layer(operator: BoundaryOperator, *, rtol: float = 1e-11) -> None:
    """Check that a double layer turns rigid motions of the body into minus one half of themselves.

    Parameters
    ----------
    operator : BoundaryOperator
        Made by `bemkit.operators.boundary.double_layer`, on the boundary of a bounded body; outside of a closed
        boundary the factor is plus one half. With curved elements, on which a rotation is not a polynomial, only
        translations are tried.
    rtol : float
        Allowed error, relative to the largest entry of the matrix.

    Raises
    ------
    CheckFailed
        Saying by how much.
    """
    factor = -0.5 if operator.trial.mesh.is_exterior else 0.5
    combined = np.asarray(factor * mass(operator.trial, operator.test).matrix() + operator.matrix())
    sign = "-" if factor < 0.0 else ""
    is_straight = bool(operator.trial.mesh.is_straight.all())
    motions = _motions(operator) if is_straight else _motions(operator)[:, :2]
    _small(combined @ motions, combined, rtol, f"({sign}1/2 M + K) r of a rigid motion is not zero: it differs")


def _dense(operator: BoundaryOperator) -> FloatArray:
    matrix = operator.matrix()
    return matrix if isinstance(matrix, np.ndarray) else np.asarray(matrix.toarray())


def _checked_matrix(operator: BoundaryOperator, name: str) -> FloatArray:
    matrix = operator.matrix()
    entries = np.asarray(matrix if isinstance(matrix, np.ndarray) else getattr(matrix, "data", None))
    shape = (operator.test.n_dofs, operator.trial.n_dofs)
    demand(entries.dtype == np.float64, f"{name}.matrix() is not an array of doubles, nor a sparse one")
    demand(matrix.shape == shape, f"{name}.matrix() has the shape {matrix.shape}, not (test, trial) dofs {shape}")
    demand(
        bool(np.isfinite(entries).all()), f"{name}.matrix() holds {np.sum(~np.isfinite(entries))} entries not finite"
    )
    demand(not entries.flags.writeable, f"{name}.matrix() can be written to")
    demand(operator.matrix() is matrix, f"{name}.matrix() is built anew at every call")
    return _dense(operator)


def _check_products(
    operator: BoundaryOperator, name: str, matrix: FloatArray, rtol: float, random: np.random.Generator
) -> None:
    """Check that products of the operator as a linear operator of scipy are those of its matrix."""
    demand(isinstance(operator, LinearOperator), f"{name} is not a scipy.sparse.linalg.LinearOperator")
    demand(operator.shape == matrix.shape, f"{name} has the shape {operator.shape}, its matrix {matrix.shape}")
    x, y = np.asarray(random.normal(size=(matrix.shape[1], 2))), np.asarray(random.normal(size=matrix.shape[0]))
    tripled = (2.0 * operator + operator) @ x
    for error, what in (
        (operator @ x - matrix @ x, f"{name} @ x is not that of the matrix"),
        (operator @ x[:, 0] - matrix @ x[:, 0], f"{name} @ x is not that of the matrix"),
        (operator.T @ y - y @ matrix, f"{name}.T is not the transpose"),
        (operator.rmatvec(y) - y @ matrix, f"{name}.rmatvec is not the transpose"),
        (tripled - 3.0 * (matrix @ x), f"sums and multiples of {name} are not those of the matrix"),
    ):
        _small(error, matrix, rtol, f"{what}: it differs")


def _check_tag(tag: Tag, operator: BoundaryOperator, name: str, matrix: FloatArray, rtol: float) -> None:
    label = f"{name} says it is {tag.value}: it"
    if tag in (Tag.KILLS_RIGID_MOTIONS, Tag.KILLS_TRANSLATIONS):
        killed = _motions(operator)[:, : 2 if tag is Tag.KILLS_TRANSLATIONS else None]
        _small(matrix @ killed, matrix, rtol, f"{label} differs")
        return
    demand(matrix.shape[0] == matrix.shape[1], f"{label} is not square")
    if tag is Tag.SYMMETRIC:
        _small(matrix - matrix.T, matrix, rtol, f"{label} differs")
        return
    eigenvalues = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))
    lowest, highest = float(eigenvalues[0]), float(np.abs(eigenvalues).max())
    # round-off may move eigenvalues by about n eps times the largest
    floor = matrix.shape[0] * 2.3e-16 * highest if tag is Tag.POSITIVE_DEFINITE else -rtol * highest
    demand(lowest > floor, f"{label} has the eigenvalue {lowest:.3g} next to {highest:.3g}")


def _motions(operator: BoundaryOperator) -> FloatArray:
    mesh = operator.trial.mesh
    motions = rigid_motions(dof_points(operator.trial), mesh.centre, mesh.diameter)
    if mesh.symmetry is not None:
        motions = motions[:, :, list(mesh.symmetry.rigid_motions)]
    return motions.reshape(operator.trial.n_dofs, motions.shape[2])


def _small(error: FloatArray, matrix: FloatArray, rtol: float, what: str) -> None:
    size = float(np.abs(matrix).max())
    worst = float(np.abs(error).max(initial=0.0))
    demand(worst <= rtol * size, f"{what} by {worst:.3g} where entries reach {size:.3g}")
