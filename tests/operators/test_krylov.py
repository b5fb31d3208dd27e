"""The iterative linear solver: steps that do not grow, the answers of the direct one, and how it fails."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.contact.condensation.reduction import CondensedBody
from bemkit.geometry import (
    Algebraic,
    BoundaryMesh,
    Disk,
    ExteriorOf,
    Grading,
    PlateWithHole,
    Polygon,
    Rectangle,
    Shape,
    Uniform,
    discretise,
)
from bemkit.geometry.corners import break_nodes
from bemkit.geometry.spaces import LinearSpace, QuadraticSpace
from bemkit.operators.linear.block_cg import NotConvergedError, block_cg
from bemkit.operators.linear.dense import SingularMatrixError
from bemkit.operators.linear.multigrid import Multigrid
from bemkit.operators.linear.solvers import DenseCholesky, Krylov, LinearSolver
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare.free_stiffness import FreeStiffness
from bemkit.operators.steklov_poincare.maps import GalerkinMap
from bemkit.operators.steklov_poincare.nodal_conditions import Support, supported
from tests.handmade import condense, contact_along_normals

L_SHAPE = Polygon(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)))
SQUARE = Rectangle(1.0, 1.0)
ALL_LEVELS = Krylov(coarsest=40)
"""With a hierarchy on small meshes, too."""


def mesh_of(shape: Shape, n_elements: int, grading: Grading | None = None) -> BoundaryMesh:
    return discretise(shape.outline(), n_elements=n_elements, grading=Uniform() if grading is None else grading)


def pressed(
    mesh: BoundaryMesh,
    solver: LinearSolver,
    poisson_ratio: float = 0.3,
    n_contact: int = 4,
    supports: tuple[Support, ...] = (),
    is_quadratic: bool = False,
) -> tuple[CondensedBody, GalerkinMap]:
    """A body under an uneven load on its upper half, with contact in the middle of its lower side."""
    spaces = (QuadraticSpace(mesh), LinearSpace(mesh, break_nodes(mesh))) if is_quadratic else (None, None)
    elastic = GalerkinMap(mesh, Material(1.0, poisson_ratio), *spaces, solver)
    lowest = np.array([mesh.nodes[:, 0].mean(), mesh.nodes[:, 1].min()])
    contact = np.sort(np.argsort(np.abs(mesh.centres - lowest).sum(axis=1))[:n_contact])
    upper = np.flatnonzero(mesh.centres[:, 1] > mesh.centre[1])
    force = elastic.nodal_forces(upper, lambda x, _: np.stack([0.3 + 0.0 * x[:, 0], -1.0 - x[:, 0]], axis=1))
    body = condense(elastic, supports, contact_along_normals(elastic.displacement_space, contact), force)
    return body, elastic


def free_stiffness(body: CondensedBody, elastic: GalerkinMap) -> FreeStiffness:
    return FreeStiffness(elastic.layers, elastic.displacement_space, body.conditions)


BODIES = {
    "square": (SQUARE, None),
    "L": (L_SHAPE, None),
    "strip": (Rectangle(10.0, 1.0), None),
    "circle": (Disk(1.0), None),
    "graded": (SQUARE, Algebraic(2.0)),
    "hole": (PlateWithHole(2.0, 1.0, 0.3), None),
}


def steps_of(name: str, n_elements: int, solver: Krylov) -> int:
    # the second is for the uniform pressure
    iterations, _ = pressed(mesh_of(BODIES[name][0], n_elements, BODIES[name][1]), solver)[0].condensed.iterations
    return iterations.n_steps


@pytest.mark.parametrize("name", BODIES)
def test_steps_do_not_grow_with_the_number_of_elements(name: str) -> None:
    # measured: 14 to 20; with a diagonal preconditioner 28 on the square with 128 elements, and more on finer meshes
    coarse, fine = (steps_of(name, n_elements, ALL_LEVELS) for n_elements in (80, 160))
    assert 12 <= coarse <= fine <= coarse + 4 <= 22


@pytest.mark.slow
@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize(("solver", "growth"), [(Krylov(), 2), (ALL_LEVELS, 8)], ids=["factored", "all levels"])
def test_steps_do_not_grow_up_to_800_elements(name: str, solver: Krylov, growth: int) -> None:
    steps = [steps_of(name, n_elements, solver) for n_elements in (100, 200, 400, 800)]
    assert min(steps) >= 9
    assert max(steps) <= min(steps[0] + growth, 23)


def test_more_columns_do_not_take_more_steps() -> None:
    mesh = mesh_of(L_SHAPE, 160)
    few, many = (pressed(mesh, Krylov(), n_contact=n)[0].condensed.iterations[0] for n in (4, 20))
    assert many.n_columns == 43
    assert many.n_steps <= few.n_steps


def roller(mesh: BoundaryMesh, direction: tuple[float, float]) -> Support:
    right = np.flatnonzero(np.isclose(mesh.centres[:, 0], mesh.nodes[:, 0].max()))
    return Support("roller", right, np.broadcast_to(direction, (right.size, 1, 2)))


SAME = {
    "floating": (L_SHAPE, 0.3, False),
    "exterior": (ExteriorOf(SQUARE), 0.3, False),
    "hole": (PlateWithHole(2.0, 1.0, 0.3), 0.3, False),
    "arcs": (Disk(1.0), 0.3, False),
    "quadratic": (L_SHAPE, 0.3, True),
    "incompressible": (L_SHAPE, 0.5, False),
    "incompressible with a hole": (PlateWithHole(2.0, 1.0, 0.3), 0.5, False),
    "negative ratio": (SQUARE, -0.5, False),
}


def assert_same(direct: CondensedBody, iterated: CondensedBody, maps: tuple[GalerkinMap, GalerkinMap]) -> None:
    """Compare stiffness, load and recovered fields; the tolerances are the square of 1e-9 and 1e-9 with room."""
    own, other = direct.condensed, iterated.condensed
    for name in ("stiffness", "load"):
        one, two = getattr(own, name), getattr(other, name)
        assert np.abs(one - two).max() < 1e-11 * np.abs(one).max(), name
    np.testing.assert_array_equal(other.stiffness, other.stiffness.T)
    motion = np.random.default_rng(0).normal(size=own.load.size)
    fields = [condensed.recover(motion) for condensed in (own, other)]
    # entry by entry forces are less certain than in the energy norm
    for one, two in zip(*fields, strict=True):
        assert np.abs(one - two).max() < 1e-8 * np.abs(one).max()
    tractions = [elastic.element_tractions(*field) for elastic, field in zip(maps, fields, strict=True)]
    assert np.abs(tractions[0] - tractions[1]).max() < 1e-8 * np.abs(tractions[0]).max()


@pytest.mark.parametrize("name", SAME)
def test_answers_are_those_of_the_direct_solver(name: str) -> None:
    shape, poisson_ratio, is_quadratic = SAME[name]
    mesh = mesh_of(shape, 100)
    solvers = (DenseCholesky(), ALL_LEVELS)
    (direct, first), (iterated, second) = (
        pressed(mesh, solver, poisson_ratio, is_quadratic=is_quadratic) for solver in solvers
    )
    assert_same(direct, iterated, (first, second))
    assert not direct.condensed.iterations
    assert iterated.condensed.iterations
    own, other = direct.condensed.work, iterated.condensed.work
    assert own.element_pairs == other.element_pairs
    assert len(own.factorisations) == len(other.factorisations) + 1
    # equilibrium does not depend on how far the iteration went
    _, force = iterated.condensed.recover(np.ones(len(other_load := iterated.condensed.load)))
    if not mesh.is_exterior:
        assert np.abs(force.sum(axis=0)).max() < 1e-11 * max(np.abs(force).sum(), np.abs(other_load).sum())


def test_inclined_supports_and_other_loads() -> None:
    mesh = mesh_of(L_SHAPE, 100)
    support = roller(mesh, (0.6, 0.8))
    bodies = [pressed(mesh, solver, supports=(support,)) for solver in (DenseCholesky(), ALL_LEVELS)]
    (direct, first), (iterated, second) = bodies
    assert_same(direct, iterated, (first, second))
    random = np.random.default_rng(3)
    displacement, force = random.normal(size=(2, mesh.n_nodes, 2))
    later = iterated.under(displacement, force)
    assert_same(direct.under(displacement, force), later, (first, second))
    assert [one.n_columns for one in later.condensed.iterations] == [11, 1, 1]  # with the uniform pressure
    free = np.flatnonzero(direct.conditions.is_free)[::7]
    for one, two in zip(direct.condensed.follow(free), iterated.condensed.follow(free), strict=True):
        assert np.abs(one - two).max() < 1e-8 * np.abs(one).max()


def test_contact_all_round_leaves_nothing_to_solve_for() -> None:
    mesh = mesh_of(SQUARE, 24)
    direct, iterated = (pressed(mesh, solver, n_contact=24)[0] for solver in (DenseCholesky(), Krylov()))
    assert np.abs(direct.stiffness - iterated.stiffness).max() < 1e-12 * direct.stiffness.max()


def test_a_map_that_iterates_still_forms_its_matrix_when_asked() -> None:
    mesh = mesh_of(SQUARE, 40)
    _, iterated = pressed(mesh, Krylov())
    reference = GalerkinMap(mesh, Material(1.0, 0.3)).matrix()
    assert np.abs(iterated.matrix() - reference).max() < 1e-13 * np.abs(reference).max()


@pytest.mark.parametrize("shape", [SQUARE, L_SHAPE, Rectangle(20.0, 1.0), PlateWithHole(2.0, 1.0, 0.3)], ids=str)
@pytest.mark.parametrize("rollers", [0, 1])
def test_a_body_that_nothing_holds_is_refused(shape: Shape, rollers: int) -> None:
    mesh = mesh_of(shape, 40)
    elastic = GalerkinMap(mesh, Material(1.0, 0.3), linear_solver=Krylov())
    conditions = supported(elastic.displacement_space, [roller(mesh, (1.0, 0.0))] * rollers)
    with pytest.raises(SingularMatrixError, match="the body held by its supports and its contact boundary is not posi"):
        elastic.condense(conditions, np.eye(mesh.n_nodes, 2, -3))


def test_too_few_steps_are_an_error_that_says_what_helps() -> None:
    message = (
        r"the body held by its supports and its contact boundary: conjugate gradients stopped after 5 of 5 steps with "
        r"the residual \d\.\de-0\d, above rtol 1.0e-09: use the direct linear solver, or a larger rtol"
    )
    with pytest.raises(NotConvergedError, match=message):
        pressed(mesh_of(SQUARE, 60), Krylov(max_steps=5))


def test_a_tolerance_below_round_off_is_an_error() -> None:
    matrix = np.diag(np.geomspace(1.0, 1e6, 30))

    def rounded(x: FloatArray) -> FloatArray:
        return np.asarray(matrix @ x, dtype=np.float32).astype(float)

    with pytest.raises(NotConvergedError, match=r"above rtol 1\.0e-12"):
        block_cg(
            rounded, lambda r: r, np.full((30, 1), 1.0 / 3.0), rtol=1e-12, max_steps=1000, name="a matrix of few digits"
        )


def test_dependent_and_vanishing_columns_are_solved_for() -> None:
    random = np.random.default_rng(1)
    matrix = np.diag(np.geomspace(1.0, 100.0, 50))
    one, two = random.normal(size=(2, 50))
    right = np.column_stack([one, two, 0.0 * one, one + 1e-9 * two, 1e6 * two])
    solution, iterations = block_cg(
        lambda x: matrix @ x, lambda r: r, right, rtol=1e-10, max_steps=100, name="a diagonal matrix"
    )
    # round-off of one, which a thousand millionth of two rides on, aside
    assert np.all(np.abs(matrix @ solution - right).max(axis=0) <= 1e-9 * np.abs(right).max(axis=0))
    assert iterations.n_columns == 5
    assert not solution[:, 2].any()


def test_columns_help_each_other() -> None:
    matrix = np.diag(np.geomspace(1.0, 1e4, 200))
    right = np.random.default_rng(2).normal(size=(200, 20))

    def steps(columns: FloatArray) -> int:
        return block_cg(
            lambda x: matrix @ x, lambda r: r, columns, rtol=1e-8, max_steps=1000, name="a diagonal matrix"
        )[1].n_steps

    # 200 unknowns are exhausted by 10 steps with 20 columns
    assert steps(right) <= 16
    assert steps(right[:, :1]) > 60


@pytest.mark.parametrize("indefinite", ["matrix", "preconditioner"])
def test_what_is_not_definite_is_refused(indefinite: str) -> None:
    signs = np.where(np.arange(10) == 3, -1.0, 1.0)[:, None]
    matrix, preconditioner = (
        signs if indefinite == name else np.ones((10, 1)) for name in ("matrix", "preconditioner")
    )
    right = np.eye(10)
    with pytest.raises(SingularMatrixError, match="an example is not positive definite"):
        block_cg(lambda x: matrix * x, lambda r: preconditioner * r, right, rtol=1e-8, max_steps=9, name="an example")


def test_a_cycle_is_symmetric_definite_and_close_to_the_inverse() -> None:
    operator = free_stiffness(*pressed(mesh_of(SQUARE, 100), ALL_LEVELS))
    matrix = np.ascontiguousarray(operator.equivalent())
    cycle = Multigrid(matrix, operator.neighbours(), coarsest=30, name="W")
    assert cycle.orders[0] == len(matrix)
    assert cycle.orders[-1] <= 30
    inverse = cycle.apply(np.eye(len(matrix)))
    assert np.abs(inverse - inverse.T).max() < 1e-12 * np.abs(inverse).max()
    eigenvalues = np.linalg.eigvals(inverse @ matrix).real
    # a cycle with Gauss-Seidel is a contraction in the energy norm: no eigenvalue reaches 0 or exceeds 1
    assert eigenvalues.min() > 0.3
    assert eigenvalues.max() < 1.0 + 1e-10


def test_energies_of_w_and_s_are_close() -> None:
    for name, (shape, grading) in BODIES.items():
        operator = free_stiffness(*pressed(mesh_of(shape, 80, grading), Krylov()))
        ratios = np.linalg.eigvals(np.linalg.solve(operator.equivalent(), operator.matrix())).real
        # S = W (1 + S'^-1 S) >= W, up to discretisation; added energies of a loop take some from its other motions
        assert ratios.min() > (0.1 if name == "hole" else 0.999)
        # the strip, which is the slenderest of these bodies, is 23 times as stiff
        assert ratios.max() < 25.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rtol": 0.0}, "rtol is 0.0: give a number between 0 and 1 such as 1e-9"),
        ({"rtol": 1.0}, "rtol is 1.0: give a number"),
        ({"max_steps": 0}, "max_steps is 0: give a positive whole number"),
        ({"coarsest": 0}, "coarsest is 0: give a positive whole number"),
    ],
)
def test_wrong_options_are_refused(options: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Krylov(**options)  # type: ignore[arg-type]


def test_pyamg_is_loaded_by_a_hierarchy_alone() -> None:
    program = (
        "import sys, numpy as np, bemkit as bk\n"
        "from tests.handmade import condense, contact_along_normals\n"
        "mesh = bk.discretise(bk.Rectangle(1.0, 1.0).outline(), n_elements=24)\n"
        "for solver in (bk.DenseCholesky(), bk.Krylov(), bk.Krylov(coarsest=8)):\n"
        "    elastic = bk.GalerkinMap(mesh, bk.Material(1.0, 0.3), linear_solver=solver)\n"
        "    condense(elastic, [], contact_along_normals(elastic.displacement_space, np.arange(4)), np.ones((24, 2)))\n"
        "    print('pyamg' in sys.modules)\n"
    )
    root = Path(__file__).parents[2]
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=root)
    assert run.stdout.split() == ["False", "False", "True"]


def test_more_columns_than_unknowns_are_solved_for() -> None:
    """A small body all of whose sides but one are contact sides: few free unknowns, many that are retained."""
    random = np.random.default_rng(3)
    factor = random.normal(size=(10, 10))
    matrix = factor @ factor.T + 0.1 * np.eye(10)
    preconditioner = np.linalg.inv(matrix + 0.3 * np.diag(np.diag(matrix)))
    right = random.normal(size=(10, 27)) * np.geomspace(1e-6, 1.0, 27)
    solution, _ = block_cg(
        lambda x: matrix @ x, lambda r: preconditioner @ r, right, rtol=1e-10, max_steps=50, name="a full matrix"
    )
    np.testing.assert_allclose(matrix @ solution, right, atol=1e-8)
