"""The references of shipped scenes; the paper's examples by elements of rising degree (`docs/make_references.py`).

Plane strain, one static step, friction coefficients 0.5 and 0.1. Finite elements that share nothing with bemkit agree
to the 1e-7 that they can claim (`tests/reference/test_paper.py`).
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import resources
from types import MappingProxyType

import numpy as np

from bemkit.operators.linear_solvers import Automatic
from bemkit.reference.column import uniaxial_strain_modulus
from bemkit.reference.compare import Reference, SampledFields, SamplePoints, ZoneEnd
from bemkit.reference.disc import DiscBetweenPlates
from bemkit.reference.pressure import places_along
from bemkit.reference.wavy import WavyObstacle
from bemkit.scene.discretisation import Galerkin, MeshOptions
from bemkit.scene.scene import Scene
from bemkit.scene.toml import load_scene
from bemkit.solvers.fallbacks import Fallbacks


def find_reference(scene: Scene) -> Reference | None:
    """Return the reference solution of a scene, None if there is none.

    Parameters
    ----------
    scene : Scene
        Its problem must be that of a shipped scene with a reference, to the last number; mesh, discretisation,
        solvers and names of units may differ.
    """
    for name, make in _REFERENCES.items():
        if _problem(scene) == _problem(load_scene(name)):
            return make(scene)
    return None


def _problem(scene: Scene) -> Scene:
    """Return a scene reduced to the data that determine the exact solution."""
    return replace(
        scene,
        title="problem",
        description="",
        reference="",
        mesh=MeshOptions(),
        discretisation=Galerkin(1),
        solver=Fallbacks(),
        linear_solver=Automatic(),
        units=None,
    )


def _uniform_slip(scene: Scene) -> Reference:
    """Return the linear field of the shipped scene; a thousand times its strains are 0.1, -11/14 and 0.78 (shear)."""
    s, weight = places_along(2.0, ())
    one = np.ones_like(s)
    energy = 0.5 * 2.0 * (-29.0 / 91.0 * 0.1 + 11.0 / 14.0 + 0.3 * 0.78) / 1000.0
    answer = SampledFields(0.0 * one, (0.1 * s + 0.2) / 1000.0, -one, -0.3 * one, energy, 2.0, -0.6, ())
    return Reference("a linear field", (SamplePoints("floor", s, weight),), answer)


def _gravity_column(scene: Scene) -> Reference:
    """Return the state of uniaxial strain of a column between smooth walls, p = weight * (height - y)."""
    width, height, gap, weight = 2.0, 10.0, 1e-4, 2400.0 * 9.81
    energy = width * weight**2 * height**3 / (6.0 * uniaxial_strain_modulus(scene.only.material))
    s, length = places_along(width, ())
    one = np.ones_like(s)
    pressure = weight * height
    answer = SampledFields(gap * one, 0.0 * one, -pressure * one, 0.0 * one, energy, pressure * width, 0.0, ())
    return Reference("uniaxial strain", (SamplePoints("floor", s, length),), answer)


_REFERENCES: Mapping[str, Callable[[Scene], Reference]] = MappingProxyType(
    {
        "paper-1": lambda _: paper_reference(1),
        "paper-2": lambda _: paper_reference(2),
        "wavy-obstacle": lambda scene: WavyObstacle(0.0172614981, 0.01, 1.0, 1.5, scene.only.material).reference(),
        "disc-between-plates": lambda scene: DiscBetweenPlates(1.0, 0.0160343377, scene.only.material).reference(
            "plate", length=np.pi / 6.0
        ),
        "uniform-slip": _uniform_slip,
        "gravity-column": _gravity_column,
    }
)


def paper_reference(number: int) -> Reference:
    """Return the reference of example 1 or 2 along the part ``foundation``."""
    folder = resources.files("bemkit") / "reference" / "data"
    table = (folder / f"paper-{number}.csv").read_text("utf-8")
    s, weight, u_n, u_t, sigma_n, sigma_t = np.loadtxt(io.StringIO(table), delimiter=",", skiprows=1, unpack=True)
    record = json.loads((folder / f"paper-{number}.json").read_text("utf-8"))
    zones = tuple(ZoneEnd(record["part"], **zone) for zone in record["zones"])
    energy, force_normal, force_tangential = (record[name] for name in ("energy", "force_normal", "force_tangential"))
    answer = SampledFields(u_n, u_t, sigma_n, sigma_t, energy, force_normal, force_tangential, zones)
    return Reference(record["source"], (SamplePoints(record["part"], s, weight),), answer, record["own_errors"])
