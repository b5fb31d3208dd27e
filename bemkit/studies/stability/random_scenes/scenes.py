"""Random scenes: body, contact, supports, loads, material, mesh, driver and load history."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bemkit.geometry.grading import Algebraic, Geometric, Grading, Uniform
from bemkit.operators.linear.solvers import Automatic, DenseCholesky, Krylov, LinearSolverChoice
from bemkit.operators.material import Material, Plane
from bemkit.scene.conditions import Part
from bemkit.scene.discretisation import ConstantCollocation, Discretisation, LinearGalerkin, QuadraticGalerkin
from bemkit.scene.load_history import with_scaled_loads
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.scene import LARGEST_KRYLOV_ERROR, Scene
from bemkit.scene.toml import scene_to_toml
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import ContactSolver
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.ssn import SemismoothNewton
from bemkit.studies.stability.random_scenes.acting import random_actions
from bemkit.studies.stability.random_scenes.bodies import random_body
from bemkit.studies.stability.random_scenes.draw import between, chance, decades, one_by_weight, one_of
from bemkit.studies.stability.random_scenes.mirrored import mirrored_layout
from bemkit.studies.stability.random_scenes.touching import random_contact
from bemkit.testing.lemke import LemkePivoting

_NEARLY_INCOMPRESSIBLE = (0.45, 0.49, 0.4995, 0.499995, 0.49999995, 0.5, 0.5)


@dataclass(frozen=True)
class RandomCase:
    """Scenes that follow each other in time, mostly a single one.

    Parameters
    ----------
    seed, index : int
        From which they were drawn.
    scenes : tuple of Scene
        For `bemkit.runs.history.run_history`.
    """

    seed: int
    index: int
    scenes: tuple[Scene, ...]

    def files(self) -> dict[str, str]:
        """Return scene files (TOML) by name, one for each scene."""
        name = f"random-{self.seed}-{self.index}"
        names = [name] if len(self.scenes) == 1 else [f"{name}-step-{k}" for k in range(1, len(self.scenes) + 1)]
        return {f"{each}.toml": scene_to_toml(scene) for each, scene in zip(names, self.scenes, strict=True)}


def random_case(seed: int, index: int) -> RandomCase:
    """Draw scene number `index` of a seed; the same numbers always give the same scene.

    Parameters
    ----------
    seed, index : int
        Not negative.

    Returns
    -------
    RandomCase

    Raises
    ------
    BemkitError
        If what was drawn is no scene; the message says why.
    """
    random = np.random.default_rng([seed, index])
    modulus = decades(random, -6.0, 12.0)
    if chance(random, 0.1):
        layout = mirrored_layout(random, modulus)
    else:
        body = random_body(random)
        contact, down, law = random_contact(random, body, modulus)
        taken = [side for part in contact for side in part.sides]
        parts = (*contact, *random_actions(random, body, taken, down, modulus))
        layout = {"shape": body.shape, "parts": parts, "law": law}
    scene = _scene(random, f"random scene {index} of seed {seed}", modulus, layout)
    return RandomCase(seed, index, _history(random, scene))


def _scene(random: np.random.Generator, title: str, modulus: float, layout: dict[str, Any]) -> Scene:
    discretisation = one_of(random, (LinearGalerkin(), QuadraticGalerkin(), _collocation(random)))
    material = _material(random, modulus)
    mesh, factors = _mesh(random, layout["shape"], discretisation), _load_factors(random)
    if mesh.accuracy is not None:
        factors = (1.0,)
    solver, linear_solver = _solver(random), _linear_solver(random, discretisation, material)
    if not any(part for part in layout["parts"] if "contact" in part.name or part.name == "shaft"):
        layout = {name: value for name, value in layout.items() if name != "law"}
        solver = SemismoothNewton()
    return Scene(
        title=title,
        material=material,
        discretisation=discretisation,
        mesh=mesh,
        solver=solver,
        linear_solver=linear_solver,
        load_factors=factors,
        **layout,
    )


def _material(random: np.random.Generator, modulus: float) -> Material:
    kinds = {"usual": 5.0, "incompressible": 3.0, "any": 2.0}
    match one_by_weight(random, kinds):
        case "usual":
            ratio = one_of(random, (0.0, 0.2, 0.3, 0.3, 0.4))
        case "incompressible":
            ratio = one_of(random, _NEARLY_INCOMPRESSIBLE)
        case _:
            ratio = between(random, -0.9, 0.5)
    return Material(modulus, ratio, Plane.STRESS if chance(random, 0.2) else Plane.STRAIN)


def _collocation(random: np.random.Generator) -> Discretisation:
    return ConstantCollocation(slopes=not chance(random, 0.2))


def _mesh(random: np.random.Generator, shape: Any, discretisation: Discretisation) -> MeshOptions:
    if discretisation.estimates_error and chance(random, 0.04):
        return MeshOptions(accuracy=decades(random, -2.0, -0.7), most_elements=int(random.integers(40, 100)))
    low, high = one_by_weight(random, {(3, 9): 0.08, (10, 40): 0.67, (41, 80): 0.2, (81, 160): 0.05})
    gradings: dict[Grading, float] = {
        Uniform(): 6.0,
        Algebraic(between(random, 1.2, 3.0)): 3.0,
        Geometric(between(random, 0.2, 0.6), int(random.integers(1, 6))): 1.0,
    }
    density = {}
    if chance(random, 0.2):
        sides = [side.name for loop in shape.outline().loops for side in loop]
        density = {one_of(random, sides): one_of(random, (0.25, 2.0, 4.0, 10.0))}
    return MeshOptions(int(random.integers(low, high + 1)), one_by_weight(random, gradings), density)


def _solver(random: np.random.Generator) -> ContactSolver:
    drivers: dict[ContactSolver, float] = {
        SemismoothNewton(): 8.0,
        SemismoothNewton(rho=decades(random, -3.0, 3.0)): 1.0,
        AugmentedLagrangian(max_steps=60): 1.5,
        FixedPoint(max_steps=60): 1.5,
        LemkePivoting(): 1.5,
    }
    return one_by_weight(random, drivers)


def _linear_solver(
    random: np.random.Generator, discretisation: Discretisation, material: Material
) -> LinearSolverChoice:
    weights: dict[LinearSolverChoice, float] = {Automatic(): 7.0, DenseCholesky(): 1.0, Krylov(): 2.0}
    is_too_inexact = Krylov().error_at(material) > LARGEST_KRYLOV_ERROR
    if not discretisation.is_symmetric or is_too_inexact:  # scenes refuse both
        del weights[Krylov()]
    return one_by_weight(random, weights)


def _load_factors(random: np.random.Generator) -> tuple[float, ...]:
    if not chance(random, 0.12):
        return (1.0,)
    return one_of(random, ((0.5, 1.0), (0.3, 0.6, 1.0), (1.0, 0.5), (1.0, -0.3, 0.7), (1.0, 0.0), (2.0,)))


def _history(random: np.random.Generator, scene: Scene) -> tuple[Scene, ...]:
    """Return the scene, sometimes followed by a second one whose loads have changed, each in its own way."""
    if scene.mesh.accuracy is not None or len(scene.load_factors) > 1 or not chance(random, 0.08):
        return (scene,)
    parts: list[Part] = []
    for k in range(len(scene.parts)):
        factor = one_of(random, (0.5, 1.0, 1.5, 0.0, -0.5))
        parts.append(with_scaled_loads(scene, factor).parts[k])
    return scene, replace(scene, parts=tuple(parts))
