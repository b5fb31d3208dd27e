"""All boundary operators conform, and broken ones are caught."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.sparse.linalg import LinearOperator, aslinearoperator

import bemkit.testing
from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry import BoundaryMesh, ExteriorOf, PlateWithHole, Polygon, Rectangle, discretise
from bemkit.geometry.neighbours import corner_nodes
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, LinearSpace, QuadraticSpace
from bemkit.operators import boundary
from bemkit.operators.boundary import (
    BoundaryOperator,
    PairOperator,
    SteklovPoincareOperator,
    adjoint_double_layer,
    double_layer,
    hypersingular,
    mass,
    single_layer,
)
from bemkit.operators.forms import single_layer_form
from bemkit.operators.linear_solvers import Tag
from bemkit.operators.material import Material, Plane
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.testing import CheckFailed, check_double_layer, check_operator
from tests.slow import slow_except, slow_only
from tests.testing.test_spaces import public_classes

MATERIALS = [Material(2.0, 0.3), Material(2.0, 0.5), Material(2.0, 0.2, Plane.STRESS)]
L_SHAPE = Polygon(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)))
MESH = discretise(L_SHAPE.outline(), n_elements=24)
ARCS = discretise(PlateWithHole(2.0, 1.0, 0.3).outline(), n_elements=32)
OUTSIDE = discretise(ExteriorOf(L_SHAPE).outline(), n_elements=24)


def operators_on(mesh: BoundaryMesh, material: Material) -> list[BoundaryOperator]:
    """Every operator on every pair of spaces it is made for."""
    broken = corner_nodes(mesh)
    displacements: list[BoundarySpace] = [LinearSpace(mesh), QuadraticSpace(mesh)]
    tractions: list[BoundarySpace] = [ConstantSpace(mesh), LinearSpace(mesh, broken)]
    result: list[BoundaryOperator] = []
    for t in tractions:
        result += [single_layer(t, t, material), mass(t, t), mass(t, t).T]
        result += [PairOperator(single_layer_form(t, t, material))]
        for u in displacements:
            result += [double_layer(u, t, material), adjoint_double_layer(t, u, material), mass(u, t)]
            result += [single_layer(t, u, material)]
    result += [hypersingular(u, u, material) for u in displacements]
    result += [hypersingular(displacements[0], displacements[1], material)]
    result += [SteklovPoincareOperator(GalerkinElasticity(mesh, material))]
    return result


@pytest.mark.parametrize("material", slow_except(MATERIALS, MATERIALS[1]), ids=str)
@pytest.mark.parametrize("mesh", slow_only([MESH, OUTSIDE, ARCS], ARCS), ids=["inside", "outside", "arcs"])
def test_operators_conform(mesh: BoundaryMesh, material: Material) -> None:
    for operator in operators_on(mesh, material):
        check_operator(operator)


@pytest.mark.parametrize("mesh", [MESH, OUTSIDE, ARCS], ids=["inside", "outside", "arcs"])
def test_double_layers_know_rigid_motions(mesh: BoundaryMesh) -> None:
    for operator in operators_on(mesh, MATERIALS[0]):
        if isinstance(operator, PairOperator) and any(term.is_double for term in operator.form.terms):
            check_double_layer(operator)


def test_the_adjoint_double_layer_is_one() -> None:
    u, t = LinearSpace(MESH), ConstantSpace(MESH)
    adjoint = adjoint_double_layer(t, u, MATERIALS[0])
    check_operator(double_layer(u, t, MATERIALS[0]), adjoint=adjoint)
    wrong = adjoint_double_layer(t, u, MATERIALS[1])
    with pytest.raises(CheckFailed, match=r"Transposed is not the transpose of PairOperator: it differs by"):
        check_operator(double_layer(u, t, MATERIALS[0]), adjoint=wrong)
    with pytest.raises(CheckFailed, match="the adjoint of PairOperator has the shape"):
        check_operator(double_layer(u, t, MATERIALS[0]), adjoint=mass(u, LinearSpace(MESH, corner_nodes(MESH))))


def test_every_public_operator_is_checked() -> None:
    # those that leave `_build` abstract are excluded by `public_classes`
    assert public_classes(boundary, "matrix") == {type(one) for one in operators_on(MESH, MATERIALS[0])}


def test_every_tag_is_carried_by_some_operator() -> None:
    operators = operators_on(MESH, MATERIALS[0]) + operators_on(ARCS, MATERIALS[1])
    assert {tag for operator in operators for tag in operator.tags} == set(Tag)


class Handmade(LinearOperator):
    """An operator given by its matrix."""

    def __init__(self, matrix: FloatArray, *tags: Tag, **changes: Any) -> None:
        self.space = ConstantSpace(MESH)
        self.trial = changes.get("trial", self.space)
        self.test = self.space
        self.tags = changes.get("tags", frozenset(tags))
        self._matrix = matrix
        self._linear = changes.get("linear", aslinearoperator(matrix))
        self._block = changes.get("block", matrix)
        super().__init__(np.dtype(float), self._linear.shape)
        self.is_assembled = changes.get("is_assembled", False)
        matrix.setflags(write=changes.get("writeable", False))
        self._is_copied = changes.get("is_copied", False)

    def matrix(self) -> FloatArray:
        if self._is_copied:
            copy = self._matrix.copy()
            copy.setflags(write=False)
            return copy
        return self._matrix

    def block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        return self._block[rows][:, columns]

    def _matvec(self, x: FloatArray) -> FloatArray:
        return self._linear.matvec(x)

    def _rmatvec(self, y: FloatArray) -> FloatArray:
        return self._linear.rmatvec(y)


N = 2 * MESH.n_elements
IDENTITY = np.eye(N)
SKEW = np.triu(np.ones((N, N)), 1) - np.tril(np.ones((N, N)), -1)


def with_entry(value: float) -> FloatArray:
    matrix = np.eye(N)
    matrix[3, 4] = value
    return matrix


def other_linear(matvec: Callable[[Any], Any], rmatvec: Callable[[Any], Any], n: int = N) -> LinearOperator:
    return LinearOperator((n, n), matvec=matvec, rmatvec=rmatvec, dtype=float)


@pytest.mark.parametrize(
    ("operator", "complaint"),
    [
        (Handmade(np.eye(N), trial=ConstantSpace(OUTSIDE)), "trial and test space are defined on different meshes"),
        (Handmade(np.eye(N), tags={Tag.SYMMETRIC}), "not a frozenset of Tag"),
        (Handmade(np.eye(N), tags=frozenset({"symmetric"})), "not a frozenset of Tag"),
        (Handmade(np.eye(N), is_assembled=True), "is assembled before its matrix is asked for"),
        (Handmade(np.eye(N, dtype=np.float32)), "is not an array of doubles"),
        (
            Handmade(np.eye(4), block=np.eye(N)),
            r"matrix\(\) has the shape \(4, 4\), not \(test, trial\) dofs \(48, 48\)",
        ),
        (Handmade(with_entry(np.inf)), "holds 1 entries not finite"),
        (Handmade(np.eye(N), writeable=True), "can be written to"),
        (Handmade(np.eye(N), is_copied=True), "is built anew at every call"),
        (Handmade(np.eye(N), linear=aslinearoperator(np.eye(4))), r"has the shape \(4, 4\), its matrix \(48, 48\)"),
        (
            Handmade(np.eye(N), linear=aslinearoperator(with_entry(1e-3))),
            "@ x is not that of the matrix: it differs",
        ),
        (Handmade(np.eye(N), linear=other_linear(lambda x: x, lambda x: -x)), "T is not the transpose: it differs by"),
        (Handmade(np.eye(N), block=-np.eye(N) - np.ones((N, N))), "block.. is not that of the matrix: it differs by"),
        (Handmade(with_entry(1e-9), Tag.SYMMETRIC), "says it is symmetric: it differs by 1e-09 where entries reach 1"),
        (
            Handmade(-np.eye(N), Tag.POSITIVE_DEFINITE),
            "says it is positive definite: it has the eigenvalue -1 next to 1",
        ),
        (Handmade(np.diag([0.0] + [1.0] * (N - 1)), Tag.POSITIVE_DEFINITE), "positive definite: it has the eigenvalue"),
        (Handmade(np.diag([-1e-6] + [1.0] * (N - 1)), Tag.POSITIVE_SEMIDEFINITE), "positive semidefinite: it has"),
        (Handmade(np.eye(N), Tag.KILLS_TRANSLATIONS), "zero on translations: it differs by 1"),
        (Handmade(np.eye(N), Tag.KILLS_RIGID_MOTIONS), "zero on rigid motions: it differs by 1"),
    ],
)
def test_broken_operators_are_caught(operator: BoundaryOperator, complaint: str) -> None:
    with pytest.raises(CheckFailed, match=complaint):
        check_operator(operator)


def test_rigid_motions_need_the_rotation_too() -> None:
    # the projector on what is left of translations
    translations = np.tile(np.eye(2), (MESH.n_elements, 1)) / np.sqrt(MESH.n_elements)
    projector = np.eye(N) - translations @ translations.T
    check_operator(Handmade(projector, Tag.KILLS_TRANSLATIONS, Tag.SYMMETRIC, Tag.POSITIVE_SEMIDEFINITE))
    with pytest.raises(CheckFailed, match="zero on rigid motions"):
        check_operator(Handmade(projector.copy(), Tag.KILLS_RIGID_MOTIONS))


def test_a_double_layer_with_a_wrong_sign_is_caught() -> None:
    operator = double_layer(LinearSpace(MESH), ConstantSpace(MESH), MATERIALS[0])
    operator.keep(-operator.matrix())
    with pytest.raises(CheckFailed, match=r"\(1/2 M \+ K\) r of a rigid motion is not zero: it differs by"):
        check_double_layer(operator)


def test_checks_assert_nothing_but_types() -> None:
    """Python without these statements, -O, would let all things pass."""
    files = list(Path(bemkit.testing.__file__).parent.rglob("*.py"))
    assert len(files) > 10
    pattern = re.compile(r"^ *assert (?!isinstance|\S+ is not None$)", re.MULTILINE)
    assert [path.name for path in files if pattern.search(path.read_text("utf-8"))] == []


@pytest.mark.slow
def test_checks_work_without_assert_statements() -> None:
    program = (
        "import numpy as np; from bemkit.testing import CheckFailed, check_curve\n"
        "from bemkit.geometry import Arc\n"
        "class Wrong(Arc):\n    is_straight = True\n"
        "try:\n    check_curve(Wrong((0.0, 0.0), 1.0, 0.0, 1.0))\nexcept CheckFailed:\n    print('caught')"
    )
    run = subprocess.run([sys.executable, "-O", "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout == "caught\n"


def test_meshes_of_other_sizes_conform() -> None:
    mesh = discretise(Rectangle(1e3, 2e3, (1e4, 0.0)).outline(), n_elements=20)
    for operator in operators_on(mesh, Material(1e11, 0.3)):
        check_operator(operator)
