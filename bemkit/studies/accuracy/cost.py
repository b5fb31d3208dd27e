"""What an over-resolved solution would cost, told before it is made."""

from __future__ import annotations

from dataclasses import dataclass, replace

from bemkit.plan import make_plan
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.scene import QuadraticGalerkin, Scene

SUGGESTED = 600
"""Elements of an over-resolved solution whose error is small against that of the default meshes."""
MESHES_TOGETHER = 1.3
"""Time of all adaptive meshes over that of the last one, which is at most 2.5 times as large as the one before."""


@dataclass(frozen=True)
class Cost:
    """Estimated cost of a run.

    Parameters
    ----------
    elements : int
    seconds : float [s]
    memory : int [bytes]
    """

    elements: int
    seconds: float
    memory: int

    def __str__(self) -> str:
        """Say it in words."""
        return f"{self.elements} elements, about {self.seconds:.1g} s and {self.memory / 1e9:.1g} GB"


def over_resolution_cost(scene: Scene, n_elements: int = SUGGESTED) -> Cost:
    """Predict what `bemkit.reference.over_resolved` takes, from the plan of its last mesh.

    Parameters
    ----------
    scene : Scene
    n_elements : int

    Returns
    -------
    Cost
    """
    options = MeshOptions(elements=n_elements, density=scene.mesh.density)
    fine = replace(scene, discretisation=QuadraticGalerkin(), mesh=options)
    plan = make_plan(fine, fine.build_mesh())
    return Cost(n_elements, MESHES_TOGETHER * plan.seconds, plan.memory)
