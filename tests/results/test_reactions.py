"""Reactions of supports are in equilibrium with loads, contacts and weights to round-off, on any mesh."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.errors import InputError

BLOCK = bk.Scene(
    title="Block on a clamped base, beside a smooth wall",
    shape=bk.Rectangle(1.0, 2.0),
    material=bk.Material(1e4, 0.3),
    parts=(
        bk.Part("base", bk.Clamped(), ("bottom",)),
        bk.Part("wall", bk.Roller(), ("right",)),
        bk.Part("load", bk.Pressure(1.0, shear=0.2), ("top",)),
    ),
    mesh=bk.MeshOptions(elements=30),
)


def resultants(body: bk.Solution) -> dict[str, np.ndarray]:
    return {force.name: np.array([force.force_x, force.force_y, force.moment]) for force in body.part_forces}


@pytest.mark.parametrize("discretisation", [bk.ConstantCollocation(), bk.Galerkin(1), bk.Galerkin(2), bk.Galerkin(5)])
def test_supports_carry_the_loads(discretisation: bk.Galerkin) -> None:
    forces = resultants(bk.run(replace(BLOCK, discretisation=discretisation)))
    np.testing.assert_allclose(forces["load"], [-0.2, -1.0, -0.1], rtol=1e-12)
    np.testing.assert_allclose(sum(forces.values()), 0.0, atol=1e-11)
    assert abs(forces["wall"][1]) < 0.02  # what a corner with the clamped base leaves of a smooth wall


@pytest.mark.parametrize("discretisation", [bk.ConstantCollocation(), bk.Galerkin(2)])
def test_supports_carry_the_weight(discretisation: bk.Galerkin) -> None:
    weight = bk.Gravity(density=1.0, acceleration=(3.0, -10.0))
    forces = resultants(bk.run(replace(BLOCK, discretisation=discretisation, body_forces=(weight,))))
    np.testing.assert_allclose(forces["base"] + forces["wall"] + forces["load"], [-6.0, 20.0, 16.0], rtol=1e-9)


def test_a_support_beside_a_contact_takes_what_the_contact_leaves() -> None:
    scene = bk.load_scene("clamped-angle")
    solution = bk.run(replace(scene, mesh=bk.MeshOptions(elements=40)))
    forces = resultants(solution)
    assert forces["foundation"][1] == pytest.approx(solution.force_normal, rel=1e-12)
    np.testing.assert_allclose(sum(forces.values())[:2], 0.0, atol=1e-12 * solution.force_normal)


def test_every_body_of_an_assembly_is_in_equilibrium_wherever_it_is_turned() -> None:
    base, load = bk.Part("base", bk.Clamped(), ("bottom",)), bk.Part("load", bk.Traction(x=0.1, y=-1.0), ("top",))
    lower = bk.Body(name="lower", shape=bk.Rectangle(2.0, 1.0), material=bk.Material(1.0, 0.3), parts=(base,))
    upper = replace(lower, name="upper", shape=bk.Rectangle(1.0, 1.0), parts=(load,))
    lower = replace(lower, placement=bk.Placement(turn=30.0))
    upper = replace(upper, placement=bk.Placement(turn=30.0, shift=(0.0, 1.2)))
    pair = bk.ContactPair(("upper.bottom", "lower.top"), reach=2.0)
    assembly = bk.Scene(
        title="Turned", bodies=(lower, upper), contacts=(pair,), law=bk.Coulomb(1.0), mesh=bk.MeshOptions(elements=32)
    )
    forces = resultants(bk.run(assembly).bodies["lower"])
    np.testing.assert_allclose(forces["base"][:2], [-0.1, 1.0], rtol=1e-9)
    np.testing.assert_allclose(forces["base"][:2] + forces["top"][:2], 0.0, atol=1e-9)


def test_files_keep_reactions_of_every_step(tmp_path: Path) -> None:
    scene = replace(bk.load_scene("friction-loop"), mesh=bk.MeshOptions(elements=30))
    solution = bk.run(replace(scene, steps=(replace(scene.steps[0]), replace(scene.steps[1], increments=2))))
    bk.write_result(tmp_path / "r.h5", solution)
    read = bk.read_result(tmp_path / "r.h5")
    for step in (1, 2, 3):
        assert read.at_step(step).part_forces == solution.at_step(step).part_forces
        forces = resultants(read.at_step(step))
        np.testing.assert_allclose(forces["top"][:2] + forces["floor"][:2], 0.0, atol=1e-11)


def test_reactions_belong_to_points() -> None:
    solution = bk.run(BLOCK)
    with pytest.raises(InputError, match=r"reaction has the shape \(1, 2\): give \(30, 2\) to match points"):
        replace(solution.boundary, reaction=np.zeros((1, 2)))
