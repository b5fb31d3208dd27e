"""A halved or quartered body gives what the whole body gives on the mirrored mesh."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import bemkit as bk
from bemkit.geometry.neighbours import break_nodes
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, LinearSpace, QuadraticSpace
from bemkit.geometry.symmetry.images import antisymmetric_dofs, reflected_to_whole
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.operators.boundary import (
    SteklovPoincareOperator,
    adjoint_double_layer,
    double_layer,
    hypersingular,
    mass,
    single_layer,
)
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.testing import check_double_layer, check_operator, check_space
from tests.scenes import DISCRETISATIONS, square, squeezed, whole_mesh
from tests.slow import slow_except, slow_only

X, Y, BOTH = bk.Symmetry(x=0.0), bk.Symmetry(y=0.0), bk.Symmetry(x=0.0, y=0.0)
PLATE = bk.PlateWithHole(3.0, 2.0, 0.4, (-1.5, -1.0))
CASES = {
    "square": (square(), bk.Symmetry(x=0.5)),
    "disk": (squeezed(bk.Disk(1.0)), BOTH),
    "ring": (squeezed(bk.Ring(0.5, 1.0)), X),
    "plate with a hole": (squeezed(PLATE), BOTH),
    "rectangle": (squeezed(bk.Rectangle(3.0, 2.0, (-1.5, -1.0))), Y),
}


def names(discretisation: object) -> str:
    return type(discretisation).__name__


RUNS = [(case, discretisation, 0.3) for case in CASES for discretisation in DISCRETISATIONS]
RUNS += [(case, discretisation, 0.5) for case in ("disk", "ring") for discretisation in DISCRETISATIONS]
SLOW = [(*of, 0.3) for of in product(("disk", "ring"), DISCRETISATIONS)]  # as at 0.5, where more can go wrong
SLOW += [(case, DISCRETISATIONS[0], 0.3) for case in ("plate with a hole", "rectangle")]
SLOW += [(case, DISCRETISATIONS[0], 0.5) for case in ("disk", "ring")] + [
    ("disk", DISCRETISATIONS[1], 0.5),
    ("ring", DISCRETISATIONS[1], 0.5),
]
SLOW += [("ring", DISCRETISATIONS[2], 0.5)]
SLOW += [(case, DISCRETISATIONS[1], 0.3) for case in ("plate with a hole", "square")] + [
    ("ring", DISCRETISATIONS[1], 0.5)
]


@pytest.mark.parametrize(("case", "discretisation", "poisson_ratio"), slow_only(RUNS, *SLOW))
def test_fields_are_those_of_the_whole_body(case: str, discretisation: object, poisson_ratio: float) -> None:
    scene, symmetry = CASES[case]
    material = replace(scene.material, poisson_ratio=poisson_ratio)
    scene = replace(scene, discretisation=discretisation, material=material)
    half = bk.run(replace(scene, symmetry=symmetry))
    whole = bk.run(scene, mesh=whole_mesh(scene, half.mesh))
    assert half.is_converged
    assert whole.is_converged
    assert half.mesh.n_elements * symmetry.n_images == whole.mesh.n_elements == scene.mesh.elements
    # round-off of systems of order 100 whose condition is about 1e4
    n = half.mesh.n_elements
    difference = half.boundary.traction - whole.boundary.traction[:n]
    assert np.abs(difference).max() <= 1e-11 * np.abs(whole.boundary.traction).max()
    make_space = scene.discretisation.displacement_space
    displacement = reflected_to_whole(make_space(half.mesh), make_space(whole.mesh), half.boundary.displacement)
    size = np.abs(whole.boundary.displacement).max()
    assert np.abs(displacement - whole.boundary.displacement).max() <= 1e-11 * size
    assert symmetry.n_images * half.energy == pytest.approx(whole.energy, rel=1e-11)
    assert half.certificate.worst <= 1e-12
    if half.estimated_error is not None:
        assert half.estimated_error == pytest.approx(whole.estimated_error, rel=1e-9)


SPACES = {
    "linear": lambda mesh: (LinearSpace(mesh), ConstantSpace(mesh)),
    "quadratic": lambda mesh: (QuadraticSpace(mesh), LinearSpace(mesh, break_nodes(mesh))),
}


def folding(space: BoundarySpace, whole: BoundarySpace) -> np.ndarray:
    """Return the matrix that makes dofs on the whole boundary of symmetric ones on the half."""
    units = np.eye(space.n_dofs)[~antisymmetric_dofs(space)].reshape(-1, space.n_dofs // 2, 2)
    return np.stack([reflected_to_whole(space, whole, unit).ravel() for unit in units], axis=1)


@pytest.mark.parametrize("kind", slow_except(SPACES, "quadratic"))
@pytest.mark.parametrize("symmetry", slow_except((X, Y, BOTH), BOTH), ids=str)
@pytest.mark.parametrize("shape", slow_except([bk.Disk(1.0), PLATE], PLATE), ids=["disk", "plate"])
def test_every_operator_is_the_folded_operator_of_the_whole(
    shape: bk.Disk | bk.PlateWithHole, symmetry: bk.Symmetry, kind: str
) -> None:
    mesh = bk.discretise(shape.outline(), n_elements=24, symmetry=symmetry)
    material = bk.Material(1.0, 0.3)
    (u, t), (whole_u, whole_t) = SPACES[kind](mesh), SPACES[kind](mesh.whole)
    for make, trial, test, whole_trial, whole_test in (
        (single_layer, t, t, whole_t, whole_t),
        (double_layer, u, t, whole_u, whole_t),
        (adjoint_double_layer, t, u, whole_t, whole_u),
        (hypersingular, u, u, whole_u, whole_u),
    ):
        folded = make(trial, test, material).matrix()[np.ix_(~antisymmetric_dofs(test), ~antisymmetric_dofs(trial))]
        whole = make(whole_trial, whole_test, material).matrix()
        expected = folding(test, whole_test).T @ whole @ folding(trial, whole_trial) / symmetry.n_images
        # single integrals are good to about 1e-14
        assert np.abs(folded - expected).max() <= 1e-13 * np.abs(expected).max(), make
    elastic, whole_elastic = (
        GalerkinElasticity(mesh, material, u, t),
        GalerkinElasticity(mesh.whole, material, whole_u, whole_t),
    )
    assert np.array_equal(SteklovPoincareOperator(elastic).matrix(), SteklovPoincareOperator(elastic).matrix().T)
    fold = folding(u, whole_u)
    expected = fold.T @ SteklovPoincareOperator(whole_elastic).matrix() @ fold / symmetry.n_images
    keeps = ~antisymmetric_dofs(u)
    assert (
        np.abs(SteklovPoincareOperator(elastic).matrix()[np.ix_(keeps, keeps)] - expected).max()
        <= 1e-12 * np.abs(expected).max()
    )


@pytest.mark.parametrize("kind", slow_except(SPACES, "quadratic"))
@pytest.mark.parametrize("symmetry", slow_except((X, Y, BOTH), BOTH), ids=str)
def test_spaces_and_operators_on_a_half_keep_their_promises(symmetry: bk.Symmetry, kind: str) -> None:
    material = bk.Material(1.0, 0.3)
    for shape in (bk.Disk(1.0), bk.Rectangle(3.0, 2.0, (-1.5, -1.0))):
        u, t = SPACES[kind](bk.discretise(shape.outline(), n_elements=24, symmetry=symmetry))
        for space in (u, t):
            check_space(space)
        for operator in (
            single_layer(t, t, material),
            single_layer(u, u, material),
            hypersingular(u, u, material),
            mass(t, t),
            mass(u, u),
        ):
            check_operator(operator)
        check_double_layer(double_layer(u, t, material))


@pytest.mark.parametrize(
    ("symmetry", "n_floating"), slow_only([(None, 3), (X, 1), (Y, 1), (BOTH, 0)], (None, 3), (X, 1), (BOTH, 0)), ids=str
)
@pytest.mark.parametrize("discretisation", slow_except(DISCRETISATIONS, DISCRETISATIONS[-1]), ids=names)
def test_only_translations_along_the_line_are_left(
    symmetry: bk.Symmetry | None, n_floating: int, discretisation: object
) -> None:
    scene = replace(squeezed(bk.Disk(1.0)), symmetry=symmetry, discretisation=discretisation)
    motions = build_model(prepare(scene, scene.build_mesh())).body.rigid_motions()
    assert len(motions) == n_floating
    if n_floating == 1:
        frame = build_model(prepare(scene, scene.build_mesh())).prepared.contact_nodes.frame
        along = np.array([0.0, 1.0]) if symmetry.x is not None else np.array([1.0, 0.0])  # type: ignore[union-attr]
        expected = frame @ along
        is_held = np.isclose(motions[0][:, 1], 0.0) & ~np.isclose(expected[:, 1], 0.0)  # on a line
        assert is_held.sum() <= 2
        assert np.allclose(np.abs(motions[0])[~is_held], np.abs(expected)[~is_held], rtol=0.0, atol=1e-12)


@pytest.mark.slow
def test_the_roller_of_the_paper_and_the_image_agree() -> None:
    shipped = bk.load_scene("paper-2")
    roller = bk.run(shipped)
    images = bk.run(
        replace(square(discretisation=shipped.discretisation, mesh=shipped.mesh), symmetry=bk.Symmetry(x=0.5))
    )
    assert images.mesh.n_elements == roller.mesh.n_elements // 2
    assert images.force_normal == pytest.approx(1.0 / 60.0, rel=1e-9)
    assert images.force_normal == pytest.approx(roller.force_normal, rel=1e-9)
    assert images.force_tangential == pytest.approx(roller.force_tangential, rel=1e-3)
    assert images.energy == pytest.approx(roller.energy, rel=1e-3)
    places, expected = ([transition.x for transition in solution.transitions] for solution in (images, roller))
    assert places == pytest.approx(expected, abs=1e-3)
    assert expected == pytest.approx([0.0848134, 0.4892406], abs=2e-3)


@pytest.mark.parametrize("discretisation", DISCRETISATIONS, ids=names)
def test_results_depend_neither_on_units_nor_on_position(discretisation: object) -> None:
    here = bk.run(replace(square(discretisation=discretisation), symmetry=bk.Symmetry(x=0.5)))
    unit, x, y = 1e3, 7e4, -2e4
    parts = (
        bk.Part("foundation", bk.Contact(bk.RigidHalfPlane((x, y))), sides=("bottom",)),
        bk.Part(
            "top load", bk.Traction(y=lambda a, b: -(((a - x) / unit) ** 2) * (1 - (a - x) / unit) ** 2), sides=("top",)
        ),
        bk.Part(
            "left load",
            bk.Traction(x=lambda a, b: 2 * ((b - y) / unit) ** 2 * (1 - (b - y) / unit) ** 2),
            sides=("left",),
        ),
        bk.Part(
            "right load",
            bk.Traction(x=lambda a, b: -2 * ((b - y) / unit) ** 2 * (1 - (b - y) / unit) ** 2),
            sides=("right",),
        ),
    )
    scene = replace(
        square(discretisation=discretisation),
        shape=bk.Rectangle(unit, unit, (x, y)),
        parts=parts,
        symmetry=bk.Symmetry(x=x + 0.5 * unit),
    )
    there = bk.run(scene)
    # coordinates 70 times the size of the body hold 14 digits of it, elements are 50 times smaller than the body
    assert np.allclose(there.boundary.traction, here.boundary.traction, rtol=0.0, atol=1e-9)
    assert there.force_tangential == pytest.approx(unit * here.force_tangential, rel=1e-9)


@pytest.mark.parametrize("factors", [(1.0,), (0.5, 1.0, 0.6)])
def test_load_histories(factors: tuple[float, ...]) -> None:
    scene = square(load_factors=factors, mesh=bk.MeshOptions(elements=64))
    half = bk.run(replace(scene, symmetry=bk.Symmetry(x=0.5)))
    whole = bk.run(scene, mesh=whole_mesh(scene, half.mesh))
    assert half.is_converged
    own = [index for index, x in enumerate(whole.contact.x.tolist()) if x <= 0.5]
    for name in ("u_t", "sigma_n", "sigma_t"):
        values, expected = getattr(half.contact, name), getattr(whole.contact, name)[own]
        assert np.allclose(values, expected, rtol=0.0, atol=1e-11 * np.abs(expected).max())


def test_nothing_moves_across_a_line_and_fields_continue_beyond_it() -> None:
    solution = bk.run(replace(squeezed(bk.Disk(1.0)), symmetry=BOTH))
    displacement = solution.boundary.displacement
    assert (displacement[solution.mesh.on_symmetry_lines] == 0.0).all()
    assert solution.mesh.on_symmetry_lines.sum() == 2
    fields = bk.interior_fields(solution)
    points = np.array([[0.3, 0.5], [-0.3, 0.5], [-0.3, -0.5], [0.3, -0.5]])
    signs = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    assert fields.is_inside(points).all()
    moved, stress = fields.displacement(points), fields.stress(points)
    assert np.allclose(moved, signs * moved[0], rtol=1e-12, atol=0.0)
    assert np.allclose(stress[:, [0, 1], [0, 1]], stress[0, [0, 1], [0, 1]], rtol=1e-12, atol=0.0)
    assert np.allclose(stress[:, 0, 1], signs.prod(axis=1) * stress[0, 0, 1], rtol=1e-12, atol=0.0)
    assert moved[0, 1] < 0.0 < moved[0, 0]  # squeezed from above, it yields sideways


def test_an_accuracy_is_reached_with_a_symmetry() -> None:
    scene = replace(square(mesh=bk.MeshOptions(accuracy=2e-2)), symmetry=bk.Symmetry(x=0.5))
    solution = bk.run(scene)
    assert solution.is_converged
    assert solution.estimated_error is not None
    assert solution.estimated_error <= 2e-2
    assert solution.mesh.symmetry == scene.symmetry
    assert solution.force_normal == pytest.approx(1.0 / 60.0, rel=1e-9)
