"""Condensation onto the contact boundary: what the drivers see of a body, and the way back."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.body import ContactState, separated, stick
from bemkit.contact.contact_nodes import ContactNodes
from bemkit.contact.direct_body import DirectBody, WholeBody
from bemkit.contact.equilibrium import resultant_imbalance
from bemkit.contact.laws import Coulomb, FrictionLaw, Frictionless
from bemkit.contact.problem import ContactProblem
from bemkit.geometry import BoundaryMesh, Polygon, Rectangle, Selection, Shape, discretise
from bemkit.geometry.spaces import BoundarySpace, LinearSpace, dof_points
from bemkit.model.contact_free_body import ContactFreeBody, certified
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.linear_solvers import SingularMatrixError
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, Support, integrate_traction, supported
from bemkit.solvers.base import Status, solve
from bemkit.solvers.ssn import SemismoothNewton
from tests.handmade import condense, contact_along_normals

MAPS = [GalerkinElasticity, CollocationElasticity]
MATERIAL = Material(1.0, 0.3)


def mesh_of(shape: Shape, n_elements: int, *sides: str) -> BoundaryMesh:
    return discretise(shape.outline(), n_elements=n_elements, parts={side: Selection((side,)) for side in sides})


def roller(mesh: BoundaryMesh, part: str) -> Support:
    return Support(part, mesh.part(part), mesh.normals[mesh.part(part)][:, None, :])


def side_of(elastic: SteklovPoincare, part: str) -> ContactNodes:
    space = elastic.displacement_space
    return contact_along_normals(space, space.mesh.part(part))


def respond(body: DirectBody, conditions: LinearConditions) -> ContactState:
    """Ask as the drivers do, without tangential conditions where supports hold the tangent."""
    return ContactProblem(body, np.zeros(body.n_contact), Frictionless()).respond(conditions)


def pressed_block(kind: type, *rollers: str) -> tuple[DirectBody, ContactNodes, SteklovPoincare]:
    """A 2 x 1 block with a unit pressure on top."""
    mesh = mesh_of(Rectangle(2.0, 1.0), 48, "bottom", "right", "top", "left")
    elastic: SteklovPoincare = kind(mesh, MATERIAL)
    force = integrate_traction(
        elastic.displacement_space, mesh.part("top"), lambda x, _: np.broadcast_to([0.0, -1.0], x.shape)
    )
    body = condense(elastic, [roller(mesh, part) for part in rollers], side_of(elastic, "bottom"), force)
    return body, body.nodes, elastic


@pytest.mark.parametrize("kind", MAPS)
@pytest.mark.parametrize(("rollers", "n_motions"), [((), 3), (("right",), 1), (("right", "top"), 0)])
def test_motions_that_only_contact_holds(kind: type, rollers: tuple[str, ...], n_motions: int) -> None:
    body, _, _ = pressed_block(kind, *rollers)
    motions = body.rigid_motions()
    assert motions.shape == (n_motions, body.n_contact, 2)
    translations = motions if kind is GalerkinElasticity or n_motions == 1 else motions[:0]
    size = np.abs(body.stiffness).max()
    is_unknown = np.stack([np.ones(body.n_contact, bool), ~body.tangent_follows], axis=1)
    for motion in translations:  # constant elements represent translations only
        assert np.abs(body.stiffness @ motion[is_unknown]).max() < 1e-12 * size


@pytest.mark.parametrize("kind", MAPS)
def test_uniform_pressure_between_rollers_is_carried_uniformly(kind: type) -> None:
    body, nodes, elastic = pressed_block(kind, "left", "right")
    held = respond(body, stick(np.zeros(body.n_contact), np.zeros(body.n_contact)))
    # the linear field sigma_yy = -1 is exact for linear elements; constants err at the corners
    tolerance = 1e-11 if kind is GalerkinElasticity else 0.1
    np.testing.assert_allclose(held.sigma_n, -1.0, atol=tolerance)
    assert -float(np.sum(nodes.weights * held.sigma_n)) == pytest.approx(2.0, rel=1e-12)  # equilibrium
    displacement, force = body.recover(held)
    assert np.abs(force.sum(axis=0)).max() < 1e-12
    assert body.imbalance(held).worst < 1e-12
    if kind is GalerkinElasticity:
        top = np.isclose(elastic.mesh.nodes[:, 1], 1.0)  # type: ignore[attr-defined]
        oedometric = 2.0 * MATERIAL.shear_modulus * (1 - 0.3) / (1 - 0.6)
        np.testing.assert_allclose(displacement[top, 1], -1.0 / oedometric, rtol=1e-11)


@pytest.mark.parametrize("kind", MAPS)
def test_recovered_fields_repeat_the_contact_state(kind: type) -> None:
    body, nodes, elastic = pressed_block(kind, "right")
    rng = np.random.default_rng(5)
    state = respond(body, stick(rng.normal(size=body.n_contact), np.zeros(body.n_contact)))
    displacement, force = body.recover(state)
    own = np.einsum("nkc,nc->nk", nodes.frame, displacement[nodes.nodes])
    np.testing.assert_allclose(own[:, 0], state.u_n, atol=1e-12)
    free = np.setdiff1d(np.arange(force.shape[0]), np.append(nodes.nodes, elastic_nodes_on_right(elastic)))
    given = integrate_traction(
        elastic.displacement_space,
        elastic.displacement_space.mesh.part("top"),
        lambda x, _: np.broadcast_to([0.0, -1.0], x.shape),
    )
    np.testing.assert_allclose(force[free], given[free], atol=1e-11)
    total = force[nodes.nodes] - given[nodes.nodes]
    normal_force = np.einsum("nc,nc->n", total, nodes.directions)
    np.testing.assert_allclose(normal_force, nodes.weights * state.sigma_n, atol=1e-11)


def elastic_nodes_on_right(elastic: SteklovPoincare) -> np.ndarray:  # type: ignore[type-arg]
    space = elastic.displacement_space
    return np.unique(space.element_dofs[space.mesh.part("right")])


def test_a_node_between_contact_and_roller_keeps_contact_and_rests() -> None:
    body, nodes, _ = pressed_block(GalerkinElasticity, "right")
    corner = int(np.argmin(np.hypot(*(nodes.points - [2.0, 0.0]).T)))
    open_state = body.respond(
        separated(body.n_contact).replaced(
            np.arange(2 * body.n_contact).reshape(-1, 2) == 0, stick(np.zeros(body.n_contact), np.zeros(body.n_contact))
        )
    )
    assert open_state.u_t[corner] == 0.0
    assert open_state.sigma_t[corner] == pytest.approx(0.0, abs=1e-14)
    assert abs(open_state.sigma_t).max() < 1e-12


def test_oblique_roller_at_the_end_of_the_contact_boundary() -> None:
    # a triangle sliding along a wall inclined by 60 degrees: the corner node moves along the wall only, and may touch
    triangle = Polygon(((0.0, 0.0), (2.0, 0.0), (1.0, np.sqrt(3.0))))
    mesh = mesh_of(triangle, 36, "side-1", "side-2", "side-3")
    elastic = GalerkinElasticity(mesh, MATERIAL)
    force = integrate_traction(
        elastic.displacement_space, mesh.part("side-3"), lambda x, _: np.broadcast_to([0.3, -1.0], x.shape)
    )
    body = condense(elastic, [roller(mesh, "side-2")], side_of(elastic, "side-1"), force)
    nodes = body.nodes
    assert body.rigid_motions().shape[0] == 1  # along the wall
    held = respond(body, stick(np.zeros(body.n_contact), np.zeros(body.n_contact)))
    displacement, force = body.recover(held)
    corner = int(np.argmin(np.hypot(*(mesh.nodes - [2.0, 0.0]).T)))
    assert np.abs(displacement[corner]).max() < 1e-13
    assert np.abs(force.sum(axis=0)).max() < 1e-12
    lifted = respond(body, stick(np.where(nodes.nodes == corner, -0.1, 0.0), np.zeros(body.n_contact)))
    moved, _ = body.recover(lifted)
    assert moved[corner, 1] == pytest.approx(0.1, rel=1e-12)  # u_n = -0.1 upwards
    wall = mesh.normals[mesh.part("side-2")[0]]
    assert float(moved[corner] @ wall) == pytest.approx(0.0, abs=1e-14)


def test_contact_nodes_fixed_along_their_normal_are_left_to_the_support() -> None:
    mesh = mesh_of(Rectangle(2.0, 1.0), 48, "bottom", "left")
    elastic = GalerkinElasticity(mesh, MATERIAL)
    axes = np.broadcast_to(np.eye(2), (mesh.part("left").size, 2, 2))
    clamp = Support("left", mesh.part("left"), axes)
    nodes = condense(elastic, [clamp], side_of(elastic, "bottom"), np.zeros((mesh.n_nodes, 2))).nodes
    assert nodes.nodes.size == mesh.part("bottom").size  # one node less than the side has
    assert not np.any(np.isclose(nodes.points[:, 0], 0.0))


def test_a_body_that_tied_contact_cannot_hold_is_named() -> None:
    mesh = mesh_of(Rectangle(2.0, 1.0), 24, "bottom")
    elastic = GalerkinElasticity(mesh, MATERIAL)
    with pytest.raises(SingularMatrixError, match="the body held by its supports and its contact boundary"):
        condense(elastic, [], side_of(elastic, "bottom").take(np.zeros(0, np.intp)), np.zeros((mesh.n_nodes, 2)))


@pytest.mark.parametrize("kind", MAPS)
def test_the_scale_of_stiffness_is_that_of_the_material(kind: type) -> None:
    for rollers in ((), ("right", "top")):  # whatever the supports leave of it
        body, nodes, elastic = pressed_block(kind, *rollers)
        assert body.stiffness_scale == pytest.approx(elastic.material.plane_modulus / np.median(nodes.weights))


@dataclass(frozen=True, eq=False)
class Heavy:
    """A body under its own weight: displacements and forces of a particular solution are added to those of a map.

    The weight 1 acts along -y; the particular solution is that of a wide layer on the floor y = 0, sigma_yy = y - 1.
    """

    light: SteklovPoincare

    @property
    def material(self) -> Material:
        return self.light.material

    @property
    def displacement_space(self) -> BoundarySpace:
        return self.light.displacement_space

    def particular(self) -> tuple[FloatArray, FloatArray]:
        """Return displacement and boundary forces (n_nodes, 2) of the particular solution."""
        mesh, nu = self.displacement_space.mesh, self.material.poisson_ratio
        y = dof_points(self.displacement_space)[:, 1]
        shear = self.material.shear_modulus
        modulus = 2.0 * shear * (1.0 - nu) / (1.0 - 2.0 * nu)
        displacement = np.stack([np.zeros_like(y), (0.5 * y**2 - y) / modulus], axis=1)

        def traction(points: FloatArray, normals: FloatArray) -> FloatArray:
            return (points[:, 1:] - 1.0) * normals * [nu / (1.0 - nu), 1.0]

        return displacement, integrate_traction(self.light.displacement_space, np.arange(mesh.n_elements), traction)

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        displacement, forces = self.particular()
        own = np.einsum("nkc,nc->nk", conditions.frame, displacement)
        fixed = np.where(conditions.is_fixed, conditions.displacement - own, 0.0)
        light = self.light.condense(replace(conditions, displacement=fixed), force - forces)
        shift = own[conditions.is_retained]

        x, y = dof_points(self.displacement_space).T
        resultant = -np.array([*forces.sum(axis=0), np.sum(x * forces[:, 1] - y * forces[:, 0])])
        return HeavyMap(
            stiffness=light.stiffness, load=light.load + light.stiffness @ shift, sensitivity=light.sensitivity,
            work=light.work, volume_force=resultant, light=light, particular=(displacement, forces), own=own,
            shift=shift,
        )  # fmt: skip


@dataclass(frozen=True, eq=False, kw_only=True)
class HeavyMap(CondensedMap):
    light: CondensedMap
    particular: tuple[FloatArray, FloatArray]
    own: FloatArray
    shift: FloatArray

    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        displacement, force = self.light.recover(retained_displacement - self.shift)
        return displacement + self.particular[0], force + self.particular[1]

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        raise NotImplementedError

    def follow(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        response, at_rest = self.light.follow(directions)
        return response, at_rest + self.own.ravel()[directions] - response @ self.shift


def heavy_block(law: FrictionLaw) -> tuple[ContactProblem, DirectBody]:
    mesh = mesh_of(Rectangle(2.0, 1.0), 48, "bottom", "right", "left")
    heavy = Heavy(GalerkinElasticity(mesh, MATERIAL, LinearSpace(mesh)))
    space = heavy.displacement_space
    nodes = contact_along_normals(space, mesh.part("bottom"))
    body = condense(heavy, [roller(mesh, part) for part in ("left", "right")], nodes, np.zeros((space.n_dofs // 2, 2)))
    return ContactProblem(body, np.zeros(body.n_contact), law), body


@pytest.mark.parametrize("law", [Frictionless(), Coulomb(0.3)])
def test_a_body_under_its_own_weight_is_certified(law: FrictionLaw) -> None:
    """Forces inside the body belong to the balance; a layer between rollers presses evenly, rho g h = 1."""
    problem, body = heavy_block(law)
    solution = solve(problem, SemismoothNewton())
    # the particular solution is the solution here, so that the elements have nothing to do
    np.testing.assert_allclose(solution.state.sigma_n, -1.0, rtol=1e-10)
    assert -float(body.weights @ solution.state.sigma_n) == pytest.approx(2.0, rel=1e-9)
    assert solution.certificate.force_imbalance < 1e-10
    weightless = replace(body, whole=replace(body.whole, condensed=replace(body.condensed, volume_force=None)))
    assert weightless.imbalance(solution.state).force > 0.3  # as if nothing pressed the block down


def test_a_body_that_touches_nothing_is_certified_under_its_own_weight() -> None:
    mesh = mesh_of(Rectangle(2.0, 1.0), 48, "bottom", "right", "left")
    heavy = Heavy(GalerkinElasticity(mesh, MATERIAL, LinearSpace(mesh)))
    space = heavy.displacement_space
    conditions = supported(space, [roller(mesh, part) for part in ("bottom", "left", "right")])
    nothing = np.zeros((space.n_dofs // 2, 2))
    whole = WholeBody.of(space, heavy.condense(conditions, nothing), conditions, nothing)
    body = ContactFreeBody(whole)
    assert certified(body).status is Status.CONVERGED
    weightless = ContactFreeBody(replace(whole, condensed=replace(whole.condensed, volume_force=None)))
    assert weightless.imbalance(certified(body).state).force > 0.3


def test_forces_inside_a_body_have_a_moment() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    lift = np.array([[0.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    beside, below = (np.array([0.0, -1.0, -x]) for x in (0.0, 1.0))  # a unit weight at x = 0, and at x = 1
    assert resultant_imbalance(points, lift, (0, 1, 2), 0.0, below).worst < 1e-15
    off = resultant_imbalance(points, lift, (0, 1, 2), 0.0, beside)
    assert off.force < 1e-15
    assert off.moment == pytest.approx(1.0 / (2.0 * 2.0 / 3.0))  # a couple of 1 by the forces 2 and the arm 2/3


def test_contact_meets_a_support_that_moves_along_an_oblique_direction() -> None:
    mesh = mesh_of(Polygon(((0.0, 0.0), (2.0, 0.0), (1.0, 3.0**0.5))), 30, "side-1", "side-2")
    elastic = GalerkinElasticity(mesh, MATERIAL, LinearSpace(mesh))
    normal = mesh.normals[mesh.part("side-2")]
    wall = Support(
        "side-2", mesh.part("side-2"), normal[:, None, :], lambda points: np.tile(0.1 * normal[0], (len(points), 1))
    )
    body = condense(elastic, [wall], side_of(elastic, "side-1"), np.zeros((mesh.n_nodes, 2)))
    assert body.tangent_follows.sum() == 1
    none = np.zeros(body.n_contact)
    state = respond(body, stick(np.random.default_rng(2).normal(size=body.n_contact), none))
    recovered = body.recover(state)[0][body.nodes.nodes]
    own = np.einsum("nkc,nc->nk", body.nodes.frame, recovered)
    np.testing.assert_allclose(own, state.displacement, atol=1e-12)
    np.testing.assert_allclose(recovered[body.tangent_follows] @ normal[0], 0.1, rtol=1e-12)
