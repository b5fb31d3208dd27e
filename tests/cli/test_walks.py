"""Five walks from an empty folder to numbers and pictures: ten lines of a file at most, and three commands."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from bemkit.cli.main import commands
from tests.slow import slow_except

pytest.importorskip("matplotlib")

PRESS_FIT = """
title = "fit"
units = { length = "mm", stress = "MPa" }
symmetry = { x = 0.0, y = 0.0 }
law = { kind = "coulomb", friction_coefficient = 0.15 }
mesh = { elements = 64 }
bodies.hub = { shape = { kind = "ring", inner_radius = 20.0, outer_radius = 40.0 }, material = { youngs_modulus = "210 GPa", poisson_ratio = 0.3, plane = "stress" } }
bodies.shaft = { shape = { kind = "disk", radius = 20.02 }, material = { youngs_modulus = "210 GPa", poisson_ratio = 0.3, plane = "stress" } }
contacts = [{ sides = ["shaft.arc", "hub.inner"], interference = 0.02 }]
"""  # noqa: E501
PIN = """
title = "pin"
units = { length = "mm", stress = "MPa" }
thickness = "20 mm"
law = { kind = "coulomb", friction_coefficient = 0.2 }
mesh = { elements = 120 }
bodies.lug = { shape = { kind = "plate-with-hole", width = 80.0, height = 80.0, radius = 10.01, corner = [-40.0, -40.0] }, material = { youngs_modulus = "70 GPa", poisson_ratio = 0.33, plane = "stress" }, parts.base = { sides = ["bottom"], condition = "clamped" } }
bodies.pin = { shape = { kind = "ring", inner_radius = 4.0, outer_radius = 10.0 }, material = { youngs_modulus = "210 GPa", poisson_ratio = 0.3, plane = "stress" }, parts.bore = { sides = ["inner"], condition = { kind = "force", y = "14 kN" } } }
contacts = [{ sides = ["pin.outer", "lug.hole"] }]
"""  # noqa: E501
DOVETAIL = """
title = "dove"
units = { length = "mm", stress = "MPa" }
law = { kind = "coulomb", friction_coefficient = 0.2 }
mesh = { elements = 80 }
touching = { within = 0.001 }
bodies.disk = { shape = { kind = "polygon", vertices = [[-40.0, -30.0], [40.0, -30.0], [40.0, 0.0], [10.0, 0.0], [20.0, -15.0], [-20.0, -15.0], [-10.0, 0.0], [-40.0, 0.0]] }, material = { youngs_modulus = "110 GPa", poisson_ratio = 0.3 }, parts.base = { sides = ["side-1"], condition = "clamped" } }
bodies.blade = { shape = { kind = "polygon", vertices = [[-18.0, -14.0], [18.0, -14.0], [8.666666666666666, 0.0], [8.666666666666666, 30.0], [-8.666666666666666, 30.0], [-8.666666666666666, 0.0]] }, placement = { shift = [0.0, 2.0] }, material = { youngs_modulus = "110 GPa", poisson_ratio = 0.3 }, parts.pull = { sides = ["side-4"], condition = { kind = "displacement", x = 0.0, y = 0.01 } } }
"""  # noqa: E501
ROUGH = """
title = "rough"
units = { length = "mm", stress = "MPa" }
law = { kind = "coulomb", friction_coefficient = 0.3 }
shape = { kind = "periodic-half-plane", period = 1.0 }
material = { youngs_modulus = "210 GPa", poisson_ratio = 0.3 }
far = { force_y = 100.0 }
mesh = { elements = 512 }
parts.zone.condition = { kind = "contact", obstacle = { kind = "profile", file = "profile.txt", period = 1.0, levelling = "ends" } }
"""  # noqa: E501
WALL = """
title = "wall"
units = { length = "m", stress = "kPa" }
law = { kind = "coulomb", friction_coefficient = 0.6 }
touching = { within = 0.001 }
mesh = { elements = 48 }
bodies.ground = { shape = { kind = "rectangle", width = 0.4, height = 0.2 }, material = { youngs_modulus = "5 GPa", poisson_ratio = 0.2 }, body_forces = [{ kind = "gravity", density = "1.8 t/m^3" }], copies = { kind = "grid", columns = 3, step = [0.4, 0.0] }, parts.floor = { sides = ["bottom"], condition = { kind = "contact", obstacle = "half-plane" } } }
bodies.course = { shape = { kind = "rectangle", width = 0.4, height = 0.2 }, material = { youngs_modulus = "5 GPa", poisson_ratio = 0.2 }, body_forces = [{ kind = "gravity", density = "1.8 t/m^3" }], placement = { shift = [0.2, 0.2] }, copies = { kind = "grid", columns = 2, step = [0.4, 0.0] } }
bodies.half = { shape = { kind = "rectangle", width = 0.2, height = 0.2 }, material = { youngs_modulus = "5 GPa", poisson_ratio = 0.2 }, body_forces = [{ kind = "gravity", density = "1.8 t/m^3" }], placement = { shift = [0.0, 0.2] }, copies = { kind = "grid", columns = 2, step = [1.0, 0.0] } }
bodies.top = { shape = { kind = "rectangle", width = 0.4, height = 0.2 }, material = { youngs_modulus = "5 GPa", poisson_ratio = 0.2 }, body_forces = [{ kind = "gravity", density = "1.8 t/m^3" }], placement = { shift = [0.4, 0.4] }, copies = { kind = "grid", columns = 2, step = [0.4, 0.0] } }
bodies.pushed = { shape = { kind = "rectangle", width = 0.4, height = 0.2 }, material = { youngs_modulus = "5 GPa", poisson_ratio = 0.2 }, body_forces = [{ kind = "gravity", density = "1.8 t/m^3" }], placement = { shift = [0.0, 0.4] }, parts.push = { sides = ["left"], condition = { kind = "force", x = "800 N/m" } } }
"""  # noqa: E501


def press_fit(numbers: Any) -> None:
    """Lame: a solid shaft of radius b, oversized by d, in a hub of outer radius c of the same material."""
    pressure = 210e3 * 0.02 * (40.0**2 - 20.0**2) / (2.0 * 20.0 * 40.0**2)
    # a quarter of the shaft; with the few elements of this file the mean pressure is right to a percent
    assert numbers["force_normal"] / (10.0 * np.pi) == pytest.approx(pressure, rel=0.01)


def pin(numbers: Any) -> None:
    """The force on the pin goes through the hole to the support."""
    forces = {f"{part['body']}.{part['name']}": part["force_y"] for part in numbers["parts"]}
    assert forces["pin.bore"] == pytest.approx(14e3, rel=1e-10)  # round-off of the equations
    assert forces["lug.base"] == pytest.approx(-14e3, rel=1e-10)


def dovetail(numbers: Any) -> None:
    """Both flanks slip, so that pull and pressing force have the ratio of a wedge with friction."""
    normal = np.array([3.0, 2.0]) / np.sqrt(13.0)
    pull = numbers["force_normal"] * (normal[1] + 0.2 * normal[0])
    forces = {part["name"]: part["force_y"] for part in numbers["parts"] if part["body"] != "blade"}
    assert forces["base"] == pytest.approx(-pull, rel=1e-9)


def rough(numbers: Any) -> None:
    (part,) = numbers["parts"]
    assert part["force_y"] == pytest.approx(-100.0, rel=1e-9)
    assert numbers["force_normal"] == pytest.approx(100.0, rel=1e-9)
    assert "jumps" not in str(numbers["warnings"])
    assert 0.0 < numbers["contacts"][0]["contact_fraction"] < 0.2


def wall(numbers: Any) -> None:
    """The ground carries the weight of nine whole blocks, and the push on one of them."""
    floors = [part for part in numbers["parts"] if part["name"] == "floor"]
    weight = 9.0 * 0.4 * 0.2 * 1.8 * 9.81
    assert sum(part["force_y"] for part in floors) == pytest.approx(weight, rel=1e-3)  # 9.80665 m/s^2 to four digits
    assert sum(part["force_x"] for part in floors) == pytest.approx(-0.8, rel=1e-9)


WALKS: Mapping[str, tuple[str, Callable[[Any], None], str]] = {
    "press fit": (PRESS_FIT, press_fit, "N/mm"),
    "pin": (PIN, pin, "N"),
    "dovetail": (DOVETAIL, dovetail, "N/mm"),
    "rough": (ROUGH, rough, "N/mm"),
    "wall": (WALL, wall, "kN/m"),
}


def write_profile() -> None:
    """Write a measured profile on a tilted table: position and height in two columns."""
    random, x = np.random.default_rng(0), np.arange(256) / 256
    waves = [1e-3 / k**1.5 * np.cos(2.0 * np.pi * (k * x + random.random())) for k in range(1, 33)]
    np.savetxt("profile.txt", np.column_stack([x, np.sum(waves, axis=0) + 0.05 * x]))


def call(*arguments: str) -> str:
    result = CliRunner().invoke(commands, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


@pytest.mark.slow
@pytest.mark.parametrize("name", slow_except(WALKS, "pin"))
@pytest.mark.usefixtures("here")
def test_a_walk_ends_with_numbers_and_pictures(name: str) -> None:
    text, check, unit = WALKS[name]
    if name == "rough":
        write_profile()
    Path("scene.toml").write_text(text)
    assert len(text.strip().splitlines()) <= 10
    summary = call("run", "scene.toml", "-o", "result.h5", "--json", "result.json")
    numbers = json.loads(Path("result.json").read_text())
    assert numbers["certified"]
    assert f"{numbers['force_normal']:.8g} {unit}" in " ".join(summary.split())  # the summary says the same
    check(numbers)
    pictures = {"deformation", "contacts"} | ({"pressures"} if name == "rough" else set())
    call("plot", "result.h5", "--what", ",".join(pictures), "-o", "figures")
    assert {path.name for path in Path("figures").iterdir()} == {f"{picture}.png" for picture in pictures}
