"""Smallest and largest thrust of rigid blocks: closed forms, balance of each block, settlement, picture, command."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import bemkit as bk
from bemkit.cli.main import _run_to_end, commands
from bemkit.geometry.vectors import cross
from bemkit.pictures.thrust import draw_thrust
from tests.runs.test_collapse import assembly_of

FRICTION = 0.5


def block_at_a_wall() -> bk.Scene:
    """Return a block, 4 wide, 1 high, of weight 4, on ground and against a wall on its left."""
    assembly = assembly_of(np.array([[0.0, 0.0, 4.0, 1.0]]), FRICTION, 4)
    (body,) = assembly.bodies
    wall = bk.Part("wall", bk.Contact(bk.RigidHalfPlane((0.0, 0.0), (1.0, 0.0))), ("left",))
    return replace(
        assembly, bodies=(replace(body, parts=(*body.parts, wall), body_forces=(bk.Gravity(1.0, (0.0, -1.0)),)),)
    )


@pytest.fixture(scope="module")
def arch() -> tuple[bk.Scene, tuple]:  # type: ignore[type-arg]
    assembly = bk.load_scene("masonry-arch")
    assert isinstance(assembly, bk.Scene)
    return assembly, bk.thrust(assembly, "first.springing", (-1.0, 0.0))


def test_a_wall_presses_a_block_between_nothing_and_what_friction_holds() -> None:
    """The ground holds ``s (W + s H)`` against H when friction of the wall presses the block down."""
    smallest, largest = bk.thrust(block_at_a_wall(), "block 0.wall")
    assert smallest.value == pytest.approx(0.0, abs=1e-9)
    assert largest.value == pytest.approx(4.0 * FRICTION / (1.0 - FRICTION**2), rel=1e-9)  # linear programme
    x, _, _ = largest.settlement["block 0"]
    assert x > 0.0  # the wall pushes the block to the right
    assert largest.forces.sum(axis=0) == pytest.approx([0.0, 4.0], abs=1e-8)


def test_every_voussoir_is_in_balance(arch) -> None:
    assembly, states = arch
    for state in states:
        assert state.pressing.min() >= -1e-12
        for number, body in enumerate(assembly.placed_bodies):
            corners = body.placement.forward(np.array(body.shape.vertices))
            x, y = corners.T
            double = x * np.roll(y, -1) - y * np.roll(x, -1)
            area = 0.5 * double.sum()
            centroid_x = ((x + np.roll(x, -1)) @ double) / (6.0 * area)
            total = np.array([0.0, -area, -area * centroid_x])
            for joint, blocks in enumerate(state.blocks):
                chosen = state.joints == joint
                force = np.column_stack([state.forces[chosen], cross(state.points[chosen], state.forces[chosen])])
                total += force.sum(axis=0) * ((blocks[0] == number) - float(blocks[1] == number))
            assert np.abs(total).max() < 1e-9  # of a weight of 0.38; tolerance of the linear programme


def test_the_thrust_of_an_arch_and_what_moves_when_its_support_yields(arch) -> None:
    assembly, (smallest, largest) = arch
    assert 0.0 < smallest.value < largest.value
    total = smallest.forces[[smallest.names[joint].endswith("springing") for joint in smallest.joints]].sum(axis=0)
    vertices = [np.array(body.shape.vertices) for body in assembly.placed_bodies]
    weight = sum(0.5 * cross(each, np.roll(each, -1, axis=0)).sum() for each in vertices)
    assert total == pytest.approx([0.0, weight], rel=1e-9, abs=1e-9)  # tolerance of the linear programme
    assert smallest.settlement["first"][0] == pytest.approx(1.0, abs=1e-9)  # the right support yields outwards
    assert largest.settlement["first"][0] < -0.5  # or inwards, and tilts
    other = bk.thrust(assembly, "last.springing")
    assert [state.value for state in other] == pytest.approx([smallest.value, largest.value], rel=1e-9)  # symmetry


def test_the_line_of_thrust_is_drawn_within_the_arch(arch) -> None:
    assembly, (smallest, _) = arch
    axes = draw_thrust(assembly, smallest)
    lines = [line.get_xydata() for line in axes.lines if line.get_linewidth() > 1.0]
    assert len(lines) == 21  # one for each voussoir
    radii = np.hypot(*np.concatenate(lines).T)
    assert 0.94 * np.cos(np.pi / 42) < radii.min() < radii.max() < 1.06 + 1e-12  # joints are chords


def test_what_is_refused() -> None:
    assembly = block_at_a_wall()
    with pytest.raises(bk.InputError, match=r"no contact 'block 0.wal': .*; did you mean 'block 0.wall'\?"):
        bk.thrust(assembly, "block 0.wal")
    with pytest.raises(bk.InputError, match="give two numbers that are not both zero"):
        bk.thrust(assembly, "block 0.wall", (0.0, 0.0))
    with pytest.raises(bk.InputError, match="friction wedges the bodies"):
        bk.thrust(replace(assembly, law=bk.Coulomb(1.5)), "block 0.wall")
    lifted = replace(assembly.bodies[0], body_forces=(bk.Gravity(1.0, (0.0, 1.0)),))
    with pytest.raises(bk.InputError, match="no contact tractions can balance the loads"):
        bk.thrust(replace(assembly, bodies=(lifted,)), "block 0.wall")


def test_the_command(tmp_path, capsys) -> None:
    file = tmp_path / "block.toml"
    file.write_text(bk.scene_to_toml(assembly_of(np.array([[0.0, 0.0, 4.0, 1.0]]), 0.3, 4)))
    shown = CliRunner().invoke(commands, ["collapse", str(file)], catch_exceptions=False).output
    assert "collapse with Coulomb friction  0.3 " in shown
    assert _run_to_end(["collapse", str(file), "--json", "-"]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert numbers["factor"] == pytest.approx(0.3, rel=1e-6)
    file.write_text(bk.scene_to_toml(assembly_of(np.array([[0.0, 0.0, 4.0, 1.0]]), 0.0, 4)))
    assert _run_to_end(["collapse", str(file)]) == 0
    assert "no such forces found" in capsys.readouterr().out
    assert _run_to_end(["collapse", "masonry-arch"]) == 0
    assert "can hold any multiple" in capsys.readouterr().out
    assert _run_to_end(["collapse", "paper-1"]) == 2
    assert "the scene is a single body" in capsys.readouterr().err
    assert _run_to_end(["collapse", str(file), "--plot", str(tmp_path)]) == 2
    assert "--plot draws the line of thrust: add --thrust CONTACT" in capsys.readouterr().err


def test_thrust_on_the_command_line(tmp_path, capsys) -> None:
    file = tmp_path / "block.toml"
    file.write_text(bk.scene_to_toml(block_at_a_wall()))
    asked = ["collapse", str(file), "--thrust", "block 0.wall", "--plot", str(tmp_path / "figures"), "--json", "-"]
    assert _run_to_end(asked) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert numbers["largest"]["thrust"] == pytest.approx(4.0 * FRICTION / (1.0 - FRICTION**2), rel=1e-9)
    drawn = sorted(path.name for path in (tmp_path / "figures").iterdir())
    assert drawn == ["largest-thrust.png", "smallest-thrust.png"]
