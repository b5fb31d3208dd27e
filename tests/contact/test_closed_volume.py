"""Incompressible bodies whose volume only contact nodes can change: the pressure is an unknown of contact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.body import ClosedVolume, separated, stick
from bemkit.contact.dense_body import DenseBody
from bemkit.errors import InputError
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.solvers.fallbacks import Springs
from bemkit.testing import check_body, check_solution
from tests.slow import slow_except

DISCRETISATIONS = (bk.Galerkin(1), bk.Galerkin(2), bk.ConstantCollocation())
MOVED_DOWN = bk.PrescribedDisplacement(0.0, -1e-2)
PLANE = bk.RigidHalfPlane((0.0, -1.0))


def half_disc(
    poisson_ratio: float = 0.5,
    obstacle: object = PLANE,
    flat: object = MOVED_DOWN,
    friction: float = 0.3,
    discretisation: object = DISCRETISATIONS[1],
) -> bk.Scene:
    """Return a half disc of radius 1 below its flat side, whose whole arc may touch an obstacle."""
    return bk.Scene(
        title="half disc",
        shape=bk.Sector(1.0, 180.0, 360.0),
        material=bk.Material(1.0, poisson_ratio),
        parts=(bk.Part("flat", flat, ("start", "end")), bk.Part("arc", bk.Contact(obstacle), ("arc",))),
        law=bk.Coulomb(friction),
        discretisation=discretisation,
        mesh=bk.MeshOptions(elements=60),
    )


def in_cavity(depth: float, **options: object) -> bk.Scene:
    """Return the half disc in a cavity of radius 1.02: to close, its flat side moves down by 0.01 pi."""
    cavity = bk.RigidCavity((0.0, 0.0), 1.02)
    return half_disc(obstacle=cavity, flat=bk.PrescribedDisplacement(0.0, -depth), **options)  # type: ignore[arg-type]


def press_fit(
    plug: float, ring: float, modulus: float = 2.0, elements: int = 48, friction: float = 0.3, **options: object
) -> bk.Scene:
    """Return a disc of radius 1 in a ring of radii 1 and 2, clamped outside, with an interference of 1e-3."""
    rim, wall, outside = (tuple(f"{side}-{k}" for k in range(1, 5)) for side in ("arc", "inner", "outer"))
    bodies = (
        bk.Body(
            name="plug",
            shape=bk.Disk(1.0),
            material=bk.Material(1.0, plug),
            parts=(bk.Part("rim", bk.Free(), rim),),
            mesh=bk.MeshOptions(elements=24),
        ),
        bk.Body(
            name="ring",
            shape=bk.Ring(1.0, 2.0),
            material=bk.Material(modulus, ring),
            parts=(bk.Part("wall", bk.Free(), wall), bk.Part("outside", bk.Clamped(), outside)),
            mesh=bk.MeshOptions(elements=elements),
        ),
    )
    return bk.Scene(
        title="press fit",
        bodies=bodies,
        contacts=(bk.ContactPair(("plug.rim", "ring.wall"), gap=-1e-3),),
        law=bk.Coulomb(friction),
        **options,  # type: ignore[arg-type]
    )


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("discretisation", DISCRETISATIONS)
def test_a_half_cylinder_is_the_limit_of_compressible_ones(discretisation: object, friction: float) -> None:
    solution = bk.run(half_disc(friction=friction, discretisation=discretisation))
    check_solution(solution)
    assert solution.certificate.worst < 1e-12
    assert solution.work == solution.plan.work
    for distance in (1e-3, 1e-5):
        other = bk.run(half_disc(0.5 - distance, friction=friction, discretisation=discretisation))
        # the force is smooth in nu, with a relative derivative of 2.4
        assert solution.force_normal == pytest.approx(other.force_normal, rel=4.0 * distance)
        assert abs(solution.force_normal / other.force_normal - 1.0) > 0.5 * distance


NEARLY = (0.499, 0.4999, 0.49999, 0.499999, *(0.5 - 10.0**-k for k in range(7, 12)), 0.5 - 1.1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("discretisation", DISCRETISATIONS)
@pytest.mark.parametrize(
    ("scene_of", "n_elements", "slope"),
    [(half_disc, 31, 3.0), (half_disc, 60, 3.0), (partial(in_cavity, 0.03), 60, 400.0)],
)
def test_nearly_incompressible_bodies_approach_the_limit(
    scene_of: Callable[..., bk.Scene], n_elements: int, slope: float, discretisation: object, friction: float
) -> None:
    """On coarse meshes, too, where the pressure of collocation is not conjugate to the change of volume."""
    scene = replace(scene_of(friction=friction, discretisation=discretisation), mesh=bk.MeshOptions(n_elements))
    limit = bk.run(scene).force_normal
    # Galerkin's interpolated normals are used up to nu = 1/2, and exact ones there
    jump = 1e-9 if discretisation == bk.ConstantCollocation() else 1e-4
    for ratio in NEARLY:
        solution = bk.run(replace(scene, material=bk.Material(1.0, ratio)))
        assert solution.is_converged
        # 1e-11 is the round-off of one stiffness of shape and volume at 0.49999
        assert solution.certificate.worst < 2e-12
        assert solution.force_normal == pytest.approx(limit, rel=slope * (0.5 - ratio) + jump)


@pytest.mark.parametrize("discretisation", slow_except(DISCRETISATIONS, bk.ConstantCollocation()))
def test_a_full_cavity_squeezes_nearly_incompressible_bodies(discretisation: object) -> None:
    forces = []
    for distance in (1e-5, 1e-8, 1e-11):
        solution = bk.run(in_cavity(0.1, poisson_ratio=0.5 - distance, discretisation=discretisation))
        assert solution.is_converged
        forces.append(distance * solution.force_normal)
    assert forces == pytest.approx([forces[1]] * 3, rel=1e-4)  # 3e-5 are the stiffness of the shape


@pytest.mark.parametrize("discretisation", slow_except(DISCRETISATIONS, bk.ConstantCollocation()))
def test_half_of_a_symmetric_half_cylinder_carries_half(discretisation: object) -> None:
    whole = bk.run(half_disc(discretisation=discretisation))
    half = bk.run(replace(half_disc(discretisation=discretisation), symmetry=bk.Symmetry(x=0.0)))
    assert half.force_normal == pytest.approx(0.5 * whole.force_normal, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("depth", [1e-3, 3e-3])
def test_a_half_cylinder_has_the_pressure_of_hertz(depth: float) -> None:
    scene = half_disc(flat=bk.PrescribedDisplacement(0.0, -depth), friction=0.0)
    scene = replace(scene, mesh=bk.MeshOptions(accuracy=1e-3), symmetry=bk.Symmetry(x=0.0))
    solution = bk.run(scene)
    force, modulus = 2.0 * solution.force_normal, 1.0 / (1.0 - 0.5**2)
    half_width = np.sqrt(4.0 * force / (np.pi * modulus))
    # elements at the edge are a hundredth of the contact; squares of half_width / radius are 5e-4 and 2e-3
    assert solution.contacts[0].contact_length == pytest.approx(half_width, rel=1e-2)
    assert -solution.contact.sigma_n.min() == pytest.approx(2.0 * force / (np.pi * half_width), rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("discretisation", DISCRETISATIONS)
def test_weight_and_two_load_steps_reach_the_same_state_as_one(discretisation: object) -> None:
    scene = half_disc(friction=0.0, discretisation=discretisation)
    scene = replace(scene, body_forces=(bk.Gravity(1e-3),))
    at_once = bk.run(scene)
    nearly = bk.run(replace(scene, material=bk.Material(1.0, 0.5 - 1e-5)))
    assert at_once.force_normal == pytest.approx(nearly.force_normal, rel=4e-5)
    in_steps = bk.run(replace(scene, load_factors=(0.5, 1.0)))
    assert in_steps.force_normal == pytest.approx(at_once.force_normal, rel=1e-9)


@pytest.mark.parametrize("friction", slow_except([0.0, 0.3], 0.3))
@pytest.mark.parametrize("discretisation", slow_except(DISCRETISATIONS, bk.Galerkin(2)))
def test_a_cavity_is_filled_until_it_is_full(discretisation: object, friction: float) -> None:
    """Contact closes the last room at a depth of 0.01 pi; the polygon of linear elements has 1.4 % less room."""
    options = {"discretisation": discretisation, "friction": friction}
    for depth in (0.02, 0.0305):
        solution = bk.run(in_cavity(depth, **options))
        check_solution(solution)
        assert (solution.force_normal > 0.0) == (depth > 0.025)
    for symmetry in (None, bk.Symmetry(x=0.0)):
        for depth in (0.0318, 0.1):
            with pytest.raises(InputError, match=r"leaves an incompressible body no room; load less, .* 0\.499999"):
                bk.run(replace(in_cavity(depth, **options), symmetry=symmetry))
    # a body that is nearly incompressible is solved, under large pressures
    assert bk.run(in_cavity(0.1, poisson_ratio=0.4999, **options)).force_normal > 1e2


@pytest.mark.parametrize(
    "solver",
    slow_except(
        [bk.SemismoothNewton(), bk.AugmentedLagrangian(), bk.FixedPoint(), Springs(), bk.LemkePivoting()],
        Springs(),
        bk.LemkePivoting(),
    ),
)
def test_other_solvers_find_the_room_or_end_by_name(solver: object) -> None:
    """Lemke's algorithm begins with the stiffness of the contact nodes, which is infinite."""
    solution = bk.run(replace(in_cavity(0.0305), solver=solver))
    if solver == bk.LemkePivoting():
        assert solution.status is bk.Status.STALLED
        assert "an incompressible body whose volume only contact nodes change has no stiffness" in solution.message
    else:
        assert solution.force_normal == pytest.approx(bk.run(in_cavity(0.0305)).force_normal, rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("discretisation", DISCRETISATIONS)
def test_a_rigid_tool_on_a_body_at_rest_presses_like_an_obstacle_on_a_moved_one(discretisation: object) -> None:
    disc = bk.Body(
        name="disc",
        shape=bk.Sector(1.0, 180.0, 360.0),
        material=bk.Material(1.0, 0.5),
        parts=(bk.Part("flat", bk.Clamped(), ("start", "end")), bk.Part("arc", bk.Free(), ("arc",))),
        mesh=bk.MeshOptions(elements=60),
    )

    def force(obstacle: object, **motion: float) -> float:
        tool = bk.RigidBody(name="tool", obstacle=obstacle, **motion)  # type: ignore[arg-type]
        pair = bk.ContactPair(("disc.arc", "tool"))
        solution = bk.run(
            bk.Scene(
                title="tool",
                bodies=(disc,),
                rigid=(tool,),
                contacts=(pair,),
                law=bk.Coulomb(0.3),
                discretisation=discretisation,
            )
        )
        assert solution.is_converged
        return float(solution.contacts[0].force_normal)

    expected = bk.run(half_disc(discretisation=discretisation)).force_normal
    assert force(PLANE, y=1e-2) == pytest.approx(expected, rel=1e-9)
    assert force(PLANE, force_y=expected) == pytest.approx(expected, rel=1e-9)
    cavity = bk.RigidCavity((0.0, 0.0), 1.02)
    filled = bk.run(in_cavity(0.0305, discretisation=discretisation))
    assert force(cavity, y=0.0305) == pytest.approx(filled.force_normal, rel=1e-8)
    with pytest.raises(InputError, match="leaves an incompressible body no room"):
        force(cavity, y=0.0318)


@pytest.mark.parametrize("discretisation", slow_except(DISCRETISATIONS, bk.Galerkin(2)))
def test_a_press_fit_has_the_pressure_of_lame(discretisation: object) -> None:
    """The plug keeps its size, so that the ring takes the interference: u = A r + B / r, zero at 2 and 1e-3 at 1."""
    shear, poisson_ratio = 2.0 / 2.6, 0.3
    a = -1e-3 / 3.0
    pressure = -(2.0 * shear / (1.0 - 2.0 * poisson_ratio) * a + 2.0 * shear * 4.0 * a)
    solution = bk.run(press_fit(0.5, poisson_ratio, discretisation=discretisation))
    check_solution(solution)
    # linear and constant elements on 24 arcs are off by a fraction of their squared angle, 0.07
    rel = 1e-4 if discretisation == bk.Galerkin(2) else 0.03
    assert solution.contacts[0].force_normal == pytest.approx(2.0 * np.pi * pressure, rel=rel)


@pytest.mark.parametrize("discretisation", slow_except(DISCRETISATIONS, bk.ConstantCollocation()))
def test_two_incompressible_bodies_that_overlap_have_no_room(discretisation: object) -> None:
    for modulus, friction in ((2.0, 0.3), (1e2, 0.3), (1e2, 0.0)):  # errors of meshes that do not match are no room
        options = {"modulus": modulus, "elements": 52, "friction": friction, "discretisation": discretisation}
        with pytest.raises(InputError, match="leaves an incompressible body no room; load less, or give a poisson"):
            bk.run(press_fit(0.5, 0.5, **options))  # type: ignore[arg-type]
    for plug, ring in ((0.499999, 0.5), (0.5, 0.4999)):
        assert bk.run(press_fit(plug, ring, discretisation=discretisation)).is_converged


@pytest.mark.parametrize("discretisation", slow_except(DISCRETISATIONS, bk.Galerkin(2)))
def test_the_pressure_is_an_unknown_of_the_body(discretisation: object) -> None:
    scene = half_disc(discretisation=discretisation)
    heavy = replace(scene, body_forces=(bk.Gravity(0.1),))
    body, other = (build_model(prepare(each, each.build_mesh())).body for each in (scene, heavy))
    assert isinstance(body, DenseBody)
    assert body.n_pressures == 1
    check_body(body, is_symmetric=discretisation != bk.ConstantCollocation(), reloaded=other)
    n = body.n_contact
    with pytest.raises(ClosedVolume, match=r"cannot keep the volume of a body of poisson_ratio 0\.5"):
        body.respond(stick(np.zeros(n), np.zeros(n)))
    # nothing on the arc, whose changes of volume equal that of the flat side, two long and moved by 0.01
    state = body.respond(separated(n))
    change = body.stiffness[-1, : body.n_unknowns]
    assert change @ state.displacement.ravel()[body.unknown_dofs] == pytest.approx(body.load[-1], rel=1e-12)
    assert np.abs(state.traction).max() == 0.0
    assert body.imbalance(state).is_below(1e-12)
    off = replace(state, displacement=state.displacement + 1e-6)
    assert not body.imbalance(off).is_below(1e-7)
