"""Bodies under their weight, in rotation and heated, against closed forms; what the certificate and the plan know."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.geometry.spaces import dof_points
from bemkit.model.model import Model, build_model
from bemkit.model.prepared import prepare
from bemkit.operators.boundary import SteklovPoincareOperator
from bemkit.operators.material import Plane
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.runs.steps import UnsolvableSceneError
from bemkit.solvers.base import solve
from tests.slow import slow_except, slow_only

MATERIAL = bk.Material(1.0, 0.3)
FLOOR = bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",))
WALLS = bk.Part("walls", bk.Roller(), sides=("left", "right"))
QUARTER = bk.Symmetry(x=0.0, y=0.0)
WEIGHT = bk.Gravity(density=2.0, acceleration=(0.0, -0.5))


def scene(**changes: Any) -> bk.Scene:
    given: dict[str, Any] = {
        "title": "forces inside",
        "material": MATERIAL,
        "parts": (),
        "discretisation": bk.Galerkin(2),
        "mesh": bk.MeshOptions(24),
    }
    return bk.Scene(**(given | changes))


def block(**changes: Any) -> bk.Scene:
    return scene(**({"shape": bk.Rectangle(1.0, 1.0), "parts": (FLOOR, WALLS), "body_forces": (WEIGHT,)} | changes))


def oedometric(material: bk.Material) -> float:
    nu = material.effective_poisson_ratio
    return 2.0 * material.shear_modulus * (1.0 - nu) / (1.0 - 2.0 * nu)


@pytest.mark.parametrize("plane", Plane)
@pytest.mark.parametrize("discretisation", [bk.Galerkin(2), bk.Galerkin(3), bk.Galerkin(6)])
def test_a_block_between_smooth_walls_is_exact(discretisation: Any, plane: Plane) -> None:
    """u_y = -(g / M) (H y - y^2 / 2), p = g H, the settlement of the top g H^2 / (2 M), energy g^2 H^3 / (6 M)."""
    material = bk.Material(1e3, 0.3, plane)
    solution = bk.run(block(discretisation=discretisation, material=material))
    modulus, y = oedometric(material), solution.boundary.points[:, 1]
    assert solution.force_normal == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose(solution.contact.sigma_n, -1.0, rtol=1e-10)
    expected = np.column_stack([0.0 * y, -(y - 0.5 * y**2) / modulus])
    np.testing.assert_allclose(solution.boundary.displacement, expected, atol=1e-10 / modulus)
    assert solution.energy == pytest.approx(1.0 / (6.0 * modulus), rel=1e-10)
    assert solution.certificate.worst < 1e-12
    assert solution.warnings == ()
    assert solution.estimated_error is not None
    assert solution.estimated_error < 1e-10


@pytest.mark.parametrize(
    ("discretisation", "order"), [(bk.ConstantCollocation(), (1.4, 2.3)), (bk.Galerkin(1), (1.4, 2.3))]
)
def test_low_degrees_converge_and_carry_the_whole_weight(discretisation: Any, order: tuple[float, float]) -> None:
    errors = []
    for n in (16, 64):
        solution = bk.run(block(discretisation=discretisation, mesh=bk.MeshOptions(n)))
        assert solution.force_normal == pytest.approx(1.0, rel=1e-12)
        y = solution.boundary.points[:, 1]
        errors.append(np.abs(solution.boundary.displacement[:, 1] + (y - 0.5 * y**2) / oedometric(MATERIAL)).max())
    assert errors[1] < 2e-3
    assert order[0] < 0.5 * np.log2(errors[0] / errors[1]) < order[1]


def test_nearly_and_fully_incompressible_blocks_carry_their_weight() -> None:
    for ratio in (0.4999999, 0.5):
        solution = bk.run(block(material=bk.Material(1.0, ratio)))
        np.testing.assert_allclose(solution.contact.sigma_n, -1.0, rtol=1e-7)
        assert np.abs(solution.boundary.displacement).max() < 1e-6


def rotating_displacement(r: FloatArray, material: bk.Material, a: float = 0.0, b: float = 1.0) -> FloatArray:
    """u_r of a ring or disc with density * omega^2 = 1 [TimoshenkoGoodier1970]; E' and nu' of plane stress."""
    nu = material.effective_poisson_ratio / (1.0 - material.effective_poisson_ratio)
    scale = (3.0 + nu) * (1.0 - nu) / (8.0 * material.plane_modulus) * r
    of_hole = (1.0 + nu) / (1.0 - nu) * a**2 * b**2 / r**2 if a else 0.0
    return np.asarray(scale * (a**2 + b**2 + of_hole - (1.0 + nu) / (3.0 + nu) * r**2))


@pytest.mark.parametrize(
    "material", slow_only([MATERIAL, bk.Material(1.0, 0.3, Plane.STRESS), bk.Material(1.0, 0.5)], MATERIAL)
)
def test_a_rotating_disc(material: bk.Material) -> None:
    spin = bk.Rotation(density=0.25, angular_velocity=2.0)
    solution = bk.run(
        scene(
            shape=bk.Disk(1.0),
            material=material,
            symmetry=QUARTER,
            body_forces=(spin,),
            discretisation=bk.Galerkin(8),
            mesh=bk.MeshOptions(16),
        )
    )
    assert solution.is_converged
    radial = np.sum(solution.boundary.displacement * solution.boundary.points, axis=1)
    np.testing.assert_allclose(radial, rotating_displacement(np.ones(1), material)[0], atol=1e-8)
    nu = material.effective_poisson_ratio / (1.0 - material.effective_poisson_ratio)
    stress = bk.interior_fields(solution).stress(np.array([[0.0, 0.0], [0.5, 0.0]]))
    middle = (3.0 + nu) / 8.0
    np.testing.assert_allclose(stress[0], middle * np.eye(2), atol=1e-8)
    hoop = middle - (1.0 + 3.0 * nu) / 32.0
    np.testing.assert_allclose(stress[1], np.diag([0.75 * middle, hoop]), atol=1e-8)


def test_a_rotating_ring_far_away_and_its_energy() -> None:
    """The energy is half the work of the forces."""
    material, centre = bk.Material(1.0, 0.3, Plane.STRESS), (300.0, -200.0)
    solution = bk.run(
        scene(
            shape=bk.Ring(0.5, 1.0, centre),
            material=material,
            symmetry=bk.Symmetry(*centre),
            body_forces=(bk.Rotation(1.0, 1.0, centre),),
            discretisation=bk.Galerkin(8),
            mesh=bk.MeshOptions(32),
        )
    )
    arms = solution.boundary.points - np.array(centre)
    r = np.hypot(*arms.T)
    radial = np.sum(solution.boundary.displacement * arms, axis=1) / r
    np.testing.assert_allclose(radial, rotating_displacement(r, material, 0.5), atol=1e-8)
    places, weights = np.polynomial.legendre.leggauss(20)
    radii = 0.75 + 0.25 * places
    work = 0.25 * weights @ (rotating_displacement(radii, material, 0.5) * radii**2) * np.pi / 2.0
    assert solution.energy == pytest.approx(0.5 * work, rel=1e-8)


DISCRETISATIONS = [bk.ConstantCollocation(), bk.Galerkin(1), bk.Galerkin(2), bk.Galerkin(5)]
HEAT = bk.Heating(expansion=1e-5, temperature=100.0)


@pytest.mark.parametrize("plane", Plane)
@pytest.mark.parametrize("discretisation", slow_except(DISCRETISATIONS, *DISCRETISATIONS[:2]))
def test_uniform_heat(discretisation: Any, plane: Plane) -> None:
    """Free to expand: no stress. Clamped all around: -E alpha T / (1 - 2 nu), or / (1 - nu) in plane stress."""
    material = bk.Material(200e9, 0.3, plane)
    make = partial(
        scene,
        shape=bk.Rectangle(2.0, 1.0, (3.0, 4.0)),
        material=material,
        discretisation=discretisation,
        body_forces=(HEAT,),
    )
    corner = tuple(bk.Part(side, bk.Roller(), sides=(side,)) for side in ("left", "bottom"))
    free = bk.run(make(parts=corner))
    assert free.is_converged
    assert np.abs(free.boundary.traction).max() < 1e-11 * 200e9 * 1e-3
    strain = 1e-3 * (1.3 if plane is Plane.STRAIN else 1.0)
    expected = strain * (free.boundary.points - [3.0, 4.0])
    np.testing.assert_allclose(free.boundary.displacement, expected, atol=1e-14)
    if discretisation.estimates_error:
        assert not free.warnings
    held = bk.run(make(parts=(bk.Part("all", bk.Clamped()),)))
    pressure = 200e9 * 1e-3 / (1.0 - (0.6 if plane is Plane.STRAIN else 0.3))
    np.testing.assert_allclose(held.boundary.traction, -pressure * held.mesh.normals, atol=1e-11 * pressure)
    assert held.energy == pytest.approx(2.0 * strain * pressure, rel=1e-11)


@pytest.mark.parametrize("plane", slow_except(Plane, Plane.STRESS))
def test_a_ring_with_the_temperature_of_steady_flow(plane: Plane) -> None:
    """Radial displacement and stresses by integrals of T r [TimoshenkoGoodier1970]; the hole is off the origin."""
    material, a, b = bk.Material(1.0, 0.3, plane), 0.5, 1.0
    solution = bk.run(
        scene(
            shape=bk.Ring(a, b, (2.0, 1.0)),
            material=material,
            symmetry=bk.Symmetry(x=2.0, y=1.0),
            body_forces=(bk.Heating(1.0, bk.Expression("3 + 5 * log(hypot(x - 2, y - 1))")),),
            discretisation=bk.Galerkin(8),
            mesh=bk.MeshOptions(32),
        )
    )
    nu = material.effective_poisson_ratio / (1.0 - material.effective_poisson_ratio)
    expansion = 1.3 if plane is Plane.STRAIN else 1.0

    def moment(r: FloatArray) -> FloatArray:
        """The integral of T r from a to r."""

        def primitive(r: Any) -> Any:
            return 1.5 * r**2 + 2.5 * r**2 * (np.log(r) - 0.5)

        return np.asarray(primitive(r) - primitive(a))

    def displacement(r: FloatArray) -> FloatArray:
        inner = ((1.0 - nu) * r**2 + (1.0 + nu) * a**2) / (b**2 - a**2) * moment(np.array(b))
        return np.asarray(expansion / r * ((1.0 + nu) * moment(r) + inner))

    arms = solution.boundary.points - [2.0, 1.0]
    r = np.hypot(*arms.T)
    found = np.sum(solution.boundary.displacement * arms, axis=1) / r
    np.testing.assert_allclose(found, displacement(r), atol=1e-8)
    radii, weights = np.polynomial.legendre.leggauss(30)
    radii = 0.75 + 0.25 * radii
    temperature, mean = 3.0 + 5.0 * np.log(radii), moment(np.array(b)) / (b**2 - a**2)
    first, second = ((radii**2 + sign * a**2) * mean / radii**2 for sign in (-1.0, 1.0))
    first, second = first - moment(radii) / radii**2, second + moment(radii) / radii**2 - temperature
    density = 0.5 * expansion**2 * material.plane_modulus * (first**2 + second**2 - 2.0 * nu * first * second)
    assert solution.energy == pytest.approx(0.25 * np.pi / 2.0 * float(weights @ (density * radii)), rel=1e-8)
    at, whole = np.array([0.7]), moment(np.array(b)) / (b**2 - a**2)
    radial = expansion * material.plane_modulus / at**2 * ((at**2 - a**2) * whole - moment(at))
    hoop = (at**2 + a**2) * whole + moment(at) - (3.0 + 5.0 * np.log(at)) * at**2
    hoop *= expansion * material.plane_modulus / at**2
    fields = bk.interior_fields(solution)
    point = np.array([[1.3, 1.0]])
    np.testing.assert_allclose(fields.stress(point)[0], np.diag([*radial, *hoop]), atol=1e-8)
    np.testing.assert_allclose(fields.displacement(point)[0], [-displacement(at)[0], 0.0], atol=1e-8)
    # the gradient of the sum is that of the displacement, here by a difference of the eighth digit
    step = np.array([1e-4, 0.0])
    slope = (fields.displacement(point + step) - fields.displacement(point - step)) / 2e-4
    np.testing.assert_allclose(fields.displacement_gradient(point)[0, :, 0], slope[0], atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("plane", Plane)
def test_a_ring_that_cools_shrinks_onto_its_shaft(plane: Plane) -> None:
    """A ring a < r < b that cools by T presses on a rigid shaft of radius a as one with the interference e a would."""
    material, a, b, strain = bk.Material(1.0, 0.3, plane), 0.5, 1.0, 1e-3
    solution = bk.run(
        scene(
            shape=bk.Ring(a, b),
            material=material,
            parts=(
                bk.Part(
                    "shaft", bk.Contact(bk.RigidCircle((0.0, 0.0), a)), sides=tuple(f"inner-{k}" for k in range(1, 5))
                ),
            ),
            symmetry=QUARTER,
            body_forces=(bk.Heating(1e-5, -100.0),),
            discretisation=bk.Galerkin(8),
            mesh=bk.MeshOptions(32),
        )
    )
    assert solution.is_converged
    nu = material.effective_poisson_ratio / (1.0 - material.effective_poisson_ratio)
    interference = strain * a * (1.3 if plane is Plane.STRAIN else 1.0)
    pressure = interference * material.plane_modulus / a / ((b**2 + a**2) / (b**2 - a**2) + nu)
    np.testing.assert_allclose(solution.contact.sigma_n, -pressure, rtol=1e-8)


@pytest.mark.parametrize(("distance", "rtol"), [(0.4, 1e-9), (1e3, 1e-6)])
def test_results_do_not_depend_on_place_and_units(distance: float, rtol: float) -> None:
    """A million diameters away coordinates, and so temperatures that depend on them, hold ten digits."""
    from bemkit.studies.stability.transform import AffineMap, transformed_scene

    forces = (WEIGHT, bk.Rotation(1.0, 0.3, (0.2, 0.7)), bk.Heating(0.1, bk.Expression("1 + x * y")))
    here = block(body_forces=forces, law=bk.Coulomb(0.2), parts=(FLOOR,))
    first = bk.run(here)
    affine = AffineMap((1e-3, 1e-3), (distance, -0.7))
    second = bk.run(transformed_scene(here, affine, stress=1e5, displacement=1e-3 * 1e5 / 7e9, modulus=7e9))
    assert first.is_converged
    np.testing.assert_allclose(second.contact.sigma_n, 1e5 * first.contact.sigma_n, rtol=10.0 * rtol, atol=1e-5)
    assert second.energy == pytest.approx(first.energy * 1e5**2 / 7e9 * 1e-6, rel=rtol)


def test_a_symmetric_half_is_half_of_the_whole() -> None:
    forces = (WEIGHT, bk.Rotation(1.0, 0.3, (0.5, 0.1)), bk.Heating(0.1, bk.Expression("1 + y")))
    whole = block(body_forces=forces, parts=(FLOOR,), law=bk.Coulomb(0.3), mesh=bk.MeshOptions(32))
    half = dataclasses.replace(whole, symmetry=bk.Symmetry(x=0.5))
    first, second = bk.run(whole), bk.run(half)
    assert second.energy == pytest.approx(0.5 * first.energy, rel=1e-9)
    rows = first.contact.x < 0.4
    np.testing.assert_allclose(second.contact.sigma_n[second.contact.x < 0.4], first.contact.sigma_n[rows], rtol=1e-8)


def model_of(given: bk.Scene) -> Model:
    return build_model(prepare(given, given.build_mesh()))


@pytest.mark.parametrize("parts", [(FLOOR, WALLS), (bk.Part("floor", bk.Clamped(), sides=("bottom",)),)])
def test_the_certificate_knows_the_weight(parts: tuple[bk.Part, ...]) -> None:
    model = model_of(block(parts=parts))
    solution = bk.run(block(parts=parts))
    body = model.problem.body
    state = solve(model.problem, bk.SemismoothNewton()).state if solution.contact.n_contact else None
    assert body.imbalance(state).worst < 1e-12  # type: ignore[arg-type]
    condensed = dataclasses.replace(model.body.condensed, volume_force=None)
    weightless = dataclasses.replace(model.body, whole=dataclasses.replace(model.body.whole, condensed=condensed))
    assert weightless.imbalance(state).worst > 0.1  # type: ignore[arg-type]


def test_tangential_displacements_are_those_of_the_body() -> None:
    """On a frictionless floor a heated block expands along it."""
    model = model_of(block(parts=(FLOOR,), body_forces=(WEIGHT, bk.Heating(0.1, 1.0))))
    state = solve(model.problem, bk.SemismoothNewton()).state
    ((displacement, _),) = model.nodal_fields(state)
    nodes = model.prepared.contact_nodes
    along = np.sum(displacement[nodes.nodes] * nodes.frame[:, 1], axis=1)
    assert np.ptp(along) * model.units.displacement > 0.1
    np.testing.assert_allclose(state.u_t, along, atol=1e-12 * np.abs(along).max())


def test_load_steps_factor_once_and_keep_what_is_constant() -> None:
    push = bk.Part("push", bk.Traction(y=-1.0), sides=("top",))
    given = block(parts=(FLOOR, WALLS, push), load_factors=(0.5, 1.0, 2.0))
    for constant, expected in ((False, (1.0, 2.0, 4.0)), (True, (1.5, 2.0, 3.0))):
        weight = dataclasses.replace(WEIGHT, is_constant=constant)
        steps = bk.run([dataclasses.replace(given, body_forces=(weight,))])
        for step, force in zip(steps, expected, strict=True):
            assert step.force_normal == pytest.approx(force, rel=1e-12)
        assert len(steps[-1].work.factorisations) == len(steps[0].work.factorisations)
    last = bk.run(given)
    assert last.estimated_error is not None
    assert last.estimated_error < 1e-8


def test_collocation_sweeps_again_for_other_forces() -> None:
    push = bk.Part("push", bk.Traction(y=-1.0), sides=("top",))
    given = block(
        parts=(FLOOR, WALLS, push),
        load_factors=(0.5, 2.0),
        discretisation=bk.ConstantCollocation(),
        body_forces=(dataclasses.replace(WEIGHT, is_constant=True),),
    )
    steps = bk.run([given])
    assert [step.force_normal for step in steps] == pytest.approx([1.5, 3.0], rel=1e-12)
    assert bk.run(given).work == bk.make_plan(given, given.build_mesh()).work


def test_weight_that_nothing_holds_is_named() -> None:
    upward = bk.Gravity(1.0, (0.0, 2.0))
    with pytest.raises(UnsolvableSceneError, match="pushes the body upward with 2; nothing holds it"):
        bk.run(block(body_forces=(upward,)))


def test_the_weight_decides_whether_a_block_slides() -> None:
    for push, slides in ((0.29, False), (0.31, True)):
        given = block(parts=(FLOOR,), law=bk.Coulomb(0.3), body_forces=(bk.Gravity(1.0, (push, -1.0)),))
        if slides:
            with pytest.raises(UnsolvableSceneError, match=r"slides the body to the right with 0\.01 more"):
                bk.run(given)
        else:
            assert bk.run(given).force_tangential == pytest.approx(-push, rel=1e-10)


WRONG: list[tuple[Callable[[], object], str]] = [
    (
        lambda: model_of(block(body_forces=(bk.Heating(1e-5, bk.Expression("x**2 + y**2")),))),
        r"temperature is 'x\*\*2 \+ y\*\*2', which is not harmonic: its mean over small circles",
    ),
    (
        lambda: model_of(block(body_forces=(bk.Heating(1e-5, bk.Expression("log(hypot(x - 1.01, y - 0.5))")),))),
        "which is harmonic, but polynomials of degree 16 miss it by .* of its size: give a number or a polynomial",
    ),
]


@pytest.mark.parametrize(("make", "message"), WRONG)
def test_temperatures_without_a_closed_form_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


def test_smooth_harmonic_temperatures_leave_a_free_body_without_stress() -> None:
    wave = bk.Heating(1e-3, bk.Expression("exp(x) * cos(y)"))
    given = block(parts=(FLOOR,), law=bk.Tresca(0.0), body_forces=(WEIGHT, wave))
    heated, cold = bk.run(given), bk.run(dataclasses.replace(given, body_forces=(WEIGHT,)))
    assert heated.force_normal == pytest.approx(cold.force_normal, rel=1e-10)


def test_body_forces_may_not_change_their_kind() -> None:
    given = block()
    prepared = prepare(given, given.build_mesh())
    with pytest.raises(ValueError, match="body_forces change their kinds or order"):
        prepared.under(dataclasses.replace(given, body_forces=(HEAT,)))


def test_result_files_hold_body_forces(tmp_path: Path) -> None:
    given = block(
        body_forces=(WEIGHT, bk.Heating(0.1, bk.Expression("1 + x * y"))), parts=(FLOOR,), law=bk.Coulomb(0.3)
    )
    solution = bk.run(given)
    bk.write_result(tmp_path / "result.h5", solution)
    again = bk.read_result(tmp_path / "result.h5")
    points = np.array([[0.3, 0.4], [0.6, 0.7]])
    fields, same = bk.interior_fields(solution), bk.interior_fields(again)
    np.testing.assert_array_equal(same.stress(points), fields.stress(points))
    np.testing.assert_array_equal(same.displacement(points), fields.displacement(points))
    # inside, stresses balance the weight; derivatives by differences
    step, gradient = 1e-3, np.zeros((2, 2))
    for axis, shift in enumerate(step * np.eye(2)):
        gradient += ((fields.stress(points + shift) - fields.stress(points - shift)) / (2.0 * step))[:, :, axis]
    np.testing.assert_allclose(gradient, np.tile([0.0, 1.0], (2, 1)), atol=1e-5)


@pytest.mark.slow
def test_adaptive_meshes_take_body_forces() -> None:
    given = block(parts=(FLOOR,), law=bk.Coulomb(0.3), mesh=bk.MeshOptions(accuracy=3e-3))
    solution, fine = bk.run(given), bk.run(dataclasses.replace(given, mesh=bk.MeshOptions(200)))
    assert solution.is_converged
    assert solution.energy == pytest.approx(fine.energy, rel=1e-4)
    assert solution.force_normal == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("n_elements", [16, 48])
def test_the_estimated_error_is_that_of_the_part_with_an_error(n_elements: int) -> None:
    """Against the exact field, in the stiffness of a mesh whose elements are an eighth as long."""
    solution = bk.run(block(discretisation=bk.Galerkin(1), mesh=bk.MeshOptions(n_elements)))
    mesh, make_space = solution.mesh, bk.Galerkin(1).displacement_space
    for _ in range(3):
        mesh = mesh.refined(np.arange(mesh.n_elements))
    coarse, fine = make_space(solution.mesh), make_space(mesh)
    points, own = dof_points(fine), np.arange(mesh.n_elements)
    assert solution.body.particular is not None
    exact = np.column_stack([0.0 * points[:, 0], -(points[:, 1] - 0.5 * points[:, 1] ** 2) / oedometric(MATERIAL)])
    error = np.zeros_like(exact)
    at_nodes = solution.body.map_boundary.displacement[coarse.element_dofs[own // 8]]
    places = (2.0 * (own % 8)[:, None] + 1.0 + fine.local_nodes) / 8.0 - 1.0
    for local, dofs in enumerate(fine.element_dofs.T):
        inherited = np.einsum("pe,epc->ec", coarse.basis(places[:, local]), at_nodes)
        error[dofs] = exact[dofs] - solution.body.particular.displacement(points[dofs]) - inherited
    stiffness = SteklovPoincareOperator(GalerkinElasticity(mesh, MATERIAL, fine)).matrix()
    true = np.sqrt(error.ravel() @ stiffness @ error.ravel() * 3.0 * oedometric(MATERIAL))
    assert solution.estimated_error is not None
    assert 0.4 < solution.estimated_error / true < 2.5


def test_the_plan_names_what_acts_inside() -> None:
    given = block(body_forces=(WEIGHT, HEAT))
    items = {item.name: item for item in bk.make_plan(given, given.build_mesh()).items}
    assert items["particular solution"].reason == "gravity, heating, in closed form: no elements inside the body"
    light = dataclasses.replace(given, body_forces=())
    items = {item.name: item for item in bk.make_plan(light, light.build_mesh()).items}
    assert not items["particular solution"].is_needed
