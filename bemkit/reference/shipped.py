"""Which reference belongs to a scene; the paper's examples by finite elements, which share nothing with bemkit.

Those are of an adaptive p-version: degree 4 to 6, elements that shrink geometrically to 1e-8 towards transition points,
corners and load jumps; plane strain, one static step, friction coefficients 0.5 and 0.1. Every number comes with an
estimate of its error.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import resources
from types import MappingProxyType

import numpy as np

from bemkit.reference.compare import Answer, Places, Reference, Zone
from bemkit.reference.disc import DiscBetweenPlates
from bemkit.reference.pressure import places_along
from bemkit.reference.wavy import WavyObstacle
from bemkit.scene.discretisation import LinearGalerkin
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.scene import Scene
from bemkit.scene.toml import load_scene
from bemkit.solvers.ssn import SemismoothNewton

_WORDS = {"gap": "separated", "slip-": "slip", "slip+": "slip", "stick": "stick"}
_SCALARS = {"energy": "energy", "force_normal": "Fn", "force_tangential": "Ft"}


def find_reference(scene: Scene) -> Reference | None:
    """Return the reference of a scene, None if there is none.

    Parameters
    ----------
    scene : Scene
        Has one if it poses the problem of a shipped scene that has one, whatever its mesh, its discretisation and its
        solver are. A number that differs makes another problem.
    """
    for name, make in _REFERENCES.items():
        if _problem(scene) == _problem(load_scene(name)):
            return make(scene)
    return None


def _problem(scene: Scene) -> Scene:
    """Leave only what determines the exact solution."""
    return replace(
        scene,
        title="problem",
        description="",
        reference="",
        mesh=MeshOptions(),
        discretisation=LinearGalerkin(),
        solver=SemismoothNewton(),
    )


def _uniform_slip(scene: Scene) -> Reference:
    """Return the linear field of the shipped scene; its strains are 0.1, -11/14 and 0.78 (engineering shear)."""
    s, weight = places_along(2.0, ())
    one = np.ones_like(s)
    energy = 0.5 * 2.0 * (-29.0 / 91.0 * 0.1 + 11.0 / 14.0 + 0.3 * 0.78)
    answer = Answer(0.0 * one, 0.1 * s + 0.2, -one, -0.3 * one, energy, 2.0, -0.6, ())
    return Reference("a linear field", (Places("floor", s, weight),), answer)


_REFERENCES: Mapping[str, Callable[[Scene], Reference]] = MappingProxyType(
    {
        "paper-1": lambda _: paper_reference(1),
        "paper-2": lambda _: paper_reference(2),
        "wavy-obstacle": lambda scene: WavyObstacle(0.0172614981, 0.01, 1.0, 1.5, scene.material).reference(),
        "disc-between-plates": lambda scene: DiscBetweenPlates(1.0, 0.0160343377, scene.material).reference(
            "plate", length=np.pi / 6.0
        ),
        "uniform-slip": _uniform_slip,
    }
)


def paper_reference(number: int) -> Reference:
    """Return the reference of example 1 or 2 along the part ``foundation``."""
    folder = resources.files("bemkit") / "reference" / "data"
    table = np.genfromtxt(io.StringIO((folder / f"paper-{number}.csv").read_text("utf-8")), delimiter=",", names=True)
    data = json.loads((folder / f"paper-{number}.json").read_text("utf-8"))
    scalars = data["scalars"]
    weight = np.gradient(table["x"])
    weight[[0, -1]] *= 0.5  # the trapezoidal rule
    zones = []
    for entry in data["transitions"]:
        before, after = (_WORDS[word] for word in entry["type"].split("->"))
        zones.append(Zone("foundation", entry["x"], before, after))
    answer = Answer(
        u_n=table["u_n"].copy(),
        u_t=table["u_t"].copy(),
        sigma_n=table["sigma_n"].copy(),
        sigma_t=table["sigma_t"].copy(),
        energy=scalars["energy"]["value"],
        force_normal=scalars["Fn"]["value"],
        force_tangential=scalars["Ft"]["value"],
        zones=tuple(zones),
    )

    def relative(*names: str) -> float:
        error, size = (sum(weight @ table[prefix + name] ** 2 for name in names) for prefix in ("err_", ""))
        return float(np.sqrt(error / size))

    own = {measure: abs(scalars[key]["err"] / scalars[key]["value"]) for measure, key in _SCALARS.items()}
    own |= {"sigma_n": relative("sigma_n"), "sigma_t": relative("sigma_t"), "displacement": relative("u_n", "u_t")}
    own["transitions"] = max(entry["err"] for entry in data["transitions"]) / float(weight.sum())
    return Reference(
        "adaptive p-version of finite elements", (Places("foundation", table["x"].copy(), weight),), answer, own
    )
