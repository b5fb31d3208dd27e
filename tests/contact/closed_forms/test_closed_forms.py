"""Contact problems with known answers, by every driver: wavy obstacle, receding layer, uniform stick and slip."""

from __future__ import annotations

import dataclasses
from functools import lru_cache
from itertools import product

import numpy as np
import pytest

import bemkit as bk
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.solvers.alm import BoundUpdate
from bemkit.solvers.base import ContactSolver, solve
from bemkit.solvers.lemke import LemkePivoting
from tests.slow import slow_except

DRIVERS: dict[str, ContactSolver] = {
    "newton": bk.SemismoothNewton(),
    "augmented": bk.AugmentedLagrangian(),
    "augmented, current bound": bk.AugmentedLagrangian(bound=BoundUpdate.CURRENT),
    "fixed point": bk.FixedPoint(),
    "lemke": LemkePivoting(),
}
YOUNG, POISSON = 1.0, 0.3
SHEAR, LAME = YOUNG / 2.6, 0.3 / (1.3 * 0.4)


def patch(
    shear: float, *, slips: bool, friction: float = 0.3, discretisation: bk.Discretisation | None = None
) -> bk.Scene:
    """A block under uniform pressure 1 and uniform shear; its top is moved along with the exact field."""
    stretch, start = (0.1, 0.2) if slips else (0.0, 0.0)
    down = (1.0 + LAME * stretch) / (LAME + 2.0 * SHEAR)
    side = (LAME + 2.0 * SHEAR) * stretch - LAME * down
    top = bk.PrescribedDisplacement(x=bk.Expression(f"{stretch} * x + {start + shear / SHEAR!r}"), y=-down)
    return bk.Scene(
        title="patch",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(YOUNG, POISSON),
        law=bk.Coulomb(friction),
        discretisation=bk.Galerkin(1) if discretisation is None else discretisation,
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
            bk.Part("top", top, sides=("top",)),
            bk.Part("right", bk.Traction(x=side, y=shear), sides=("right",)),
            bk.Part("left", bk.Traction(x=-side, y=-shear), sides=("left",)),
        ),
        mesh=bk.MeshOptions(elements=60),
    )


def shipped(name: str, elements: int) -> bk.Scene:
    scene = bk.load_scene(name)
    return dataclasses.replace(scene, mesh=dataclasses.replace(scene.mesh, elements=elements))


SCENES = {
    "paper-1": lambda: shipped("paper-1", 160),
    "paper-2": lambda: shipped("paper-2", 160),
    "wavy obstacle": lambda: shipped("wavy-obstacle", 160),
    "receding layer": lambda: shipped("receding-layer", 160),
    "stick": lambda: patch(0.2, slips=False),
    "tie": lambda: patch(0.3, slips=False),
    "tie, backward": lambda: patch(-0.3, slips=False),
    "slip": lambda: patch(0.3, slips=True),
}


QUICK = (*product(("stick", "slip"), DRIVERS), *product(("wavy obstacle", "tie, backward"), ("augmented",)))


@lru_cache
def solved(name: str, driver: str) -> bk.Solution:
    return bk.run(dataclasses.replace(SCENES[name](), solver=DRIVERS[driver]))


@pytest.mark.parametrize(("name", "driver"), slow_except(product(SCENES, DRIVERS), *QUICK))
def test_all_drivers_agree(name: str, driver: str) -> None:
    reference, solution = solved(name, "newton").contact, solved(name, driver)
    assert solution.status is bk.Status.CONVERGED
    assert solution.certificate.worst <= 1e-9
    stress = np.abs(reference.sigma_n).max()
    length = max(np.abs(reference.u_n).max(), np.abs(reference.u_t).max())
    for column in ("sigma_n", "sigma_t"):
        np.testing.assert_allclose(getattr(solution.contact, column), getattr(reference, column), atol=1e-7 * stress)
    np.testing.assert_array_equal(solution.contact.status == 0, reference.status == 0)
    for column in ("u_n", "u_t"):
        # a bottom that only just slips moves by round-off times the compliance
        scale = length if length > 1e-9 else stress / YOUNG
        np.testing.assert_allclose(getattr(solution.contact, column), getattr(reference, column), atol=1e-7 * scale)


def test_wavy_obstacle() -> None:
    solution = bk.run(bk.load_scene("wavy-obstacle"))
    contact = solution.contact
    a, mean = 0.25, 0.0172614981
    inside = np.maximum(np.sin(np.pi * a) ** 2 - np.sin(np.pi * contact.x) ** 2, 0.0)
    exact = 2.0 * mean * np.cos(np.pi * contact.x) / np.sin(np.pi * a) ** 2 * np.sqrt(inside)
    miss = np.sqrt(np.sum(contact.weight * (-contact.sigma_n - exact) ** 2) / np.sum(contact.weight * exact**2))
    assert miss <= 0.02
    ends = [transition.x for transition in solution.transitions if transition.to_status == "separated"]
    assert ends == pytest.approx([a], abs=0.5 / 107)  # one of 107 elements on the bottom
    assert solution.force_normal == pytest.approx(0.5 * mean, rel=1e-9)


def test_receding_layer() -> None:
    solution = bk.run(bk.load_scene("receding-layer"))
    contact = solution.contact
    ends = [transition.x for transition in solution.transitions if transition.to_status == "separated"]
    element = solution.mesh.lengths[solution.mesh.part("base")].min()
    assert ends == pytest.approx([1.0077824], abs=0.5 * element)
    at_axis = int(np.argmin(contact.x))
    assert -contact.sigma_n[at_axis] == pytest.approx(0.789588, rel=1e-3)


@pytest.mark.parametrize(
    ("load", "young"), slow_except(product((1e-12, 1e-3, 1e12), (1.0, 2e11)), (1e-12, 1.0), (1e12, 2e11))
)
def test_receding_contact_knows_no_load_and_no_stiffness(load: float, young: float) -> None:
    scene = shipped("receding-layer", 160)
    parts = (*scene.parts[:2], dataclasses.replace(scene.parts[2], condition=bk.Pressure(load)))
    other = bk.run(dataclasses.replace(scene, material=bk.Material(young, POISSON), parts=parts))
    plain = solved("receding layer", "newton")
    np.testing.assert_array_equal(other.contact.status, plain.contact.status)
    assert (other.linear_solves, other.outer_steps) == (plain.linear_solves, plain.outer_steps)
    np.testing.assert_allclose(other.contact.sigma_n / load, plain.contact.sigma_n, atol=1e-9)


@pytest.mark.parametrize("shear", [0.0, 0.1, -0.29, 0.3, -0.3])
def test_uniform_stick_is_exact(shear: float) -> None:
    solution = bk.run(patch(shear, slips=False))
    contact = solution.contact
    np.testing.assert_allclose(contact.sigma_n, -1.0, atol=1e-9)
    np.testing.assert_allclose(contact.sigma_t, -shear, atol=1e-9)  # the tangent of the bottom points to +x
    np.testing.assert_allclose(contact.u_t, 0.0, atol=1e-9)
    assert solution.linear_solves <= 4  # no cycling, also exactly at the tie
    if abs(shear) < 0.3:
        assert set(contact.status_words()) == {"stick"}


def test_uniform_slip_is_exact() -> None:
    for scene, scale in ((patch(0.3, slips=True), 1.0), (bk.load_scene("uniform-slip"), 1e-3)):
        contact = bk.run(scene).contact
        np.testing.assert_allclose(contact.sigma_n, -1.0, atol=1e-9)
        np.testing.assert_allclose(contact.sigma_t, -0.3, atol=1e-9)
        np.testing.assert_allclose(contact.u_t / scale, 0.1 * contact.x + 0.2, atol=1e-9)
        assert set(contact.status_words()) == {"slip"}


@pytest.mark.slow
def test_the_tie_on_the_whole_body_ends_whatever_the_driver() -> None:
    """Pushed by exactly the friction it has, nothing but friction holding it: stick or slip, but an answer."""
    scene = bk.Scene(
        title="edge of sliding",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(YOUNG, POISSON),
        law=bk.Coulomb(0.25),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
            bk.Part("top", bk.Traction(x=0.125, y=-0.5), sides=("top",)),
            bk.Part(
                "ends", bk.Traction(x=0.0, y=bk.Expression("where(x > 1, 0.125, -0.125)")), sides=("right", "left")
            ),
        ),
        mesh=bk.MeshOptions(elements=60),
    )
    model = build_model(prepare(scene, scene.build_mesh()))
    for driver in DRIVERS.values():
        solution = solve(model.problem, driver, throw=False)
        assert solution.is_converged or solution.status is bk.Status.STALLED
        if solution.is_converged:
            force = (
                model.prepared.contact_nodes.weights @ solution.state.sigma_t * model.units.stress * model.units.length
            )
            assert force == pytest.approx(-0.25, rel=1e-6)
