"""The axes of the stability sweeps, and their cases."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import resources
from math import radians
from types import MappingProxyType
from typing import Any

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.laws import Coulomb
from bemkit.contact.obstacle import Gap, RigidHalfPlane
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.discretise import Uniform
from bemkit.geometry.shapes import Rectangle
from bemkit.geometry.spaces import ConstantSpace
from bemkit.operators.boundary import single_layer
from bemkit.operators.material import Material
from bemkit.results.solution import Solution
from bemkit.scene.body import Body
from bemkit.scene.conditions import Contact, Part, Pressure, Traction
from bemkit.scene.discretisation import MeshOptions
from bemkit.scene.load_history import with_changed_steps
from bemkit.scene.plane_motion import FarField
from bemkit.scene.scene import Scene
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import ContactSolver
from bemkit.solvers.ssn import SemismoothNewton
from bemkit.studies.engine import StudyError
from bemkit.studies.stability.case import PRECISION, Case, precision_elsewhere, with_friction
from bemkit.studies.stability.similarity import Similarity
from bemkit.studies.stability.transform import AffineMap, transformed_scene, with_gap_offset, with_turned_loads


@dataclass(frozen=True)
class Axis:
    """A direction in which a scene is driven to its extremes.

    Parameters
    ----------
    name : str
    label : str
        Of the values, for tables and plots.
    promise : str
        One sentence on what must hold along the axis.
    values : tuple of float
    make : callable (baseline solution, value) -> Case
    reference : float, optional
        Value whose row the others are compared with; by default the given scene.
    reason_against : callable (scene) -> str
        Why the axis does not apply to a scene; empty if it does.
    """

    name: str
    label: str
    promise: str
    values: tuple[float, ...]
    make: Callable[[Solution, float], Case]
    reference: float | None = None
    reason_against: Callable[[Any], str] = lambda scene: ""

    @property
    def is_logarithmic(self) -> bool:
        """Whether the values span decades."""
        size = [abs(value) for value in self.values if value]
        return min(self.values) >= 0.0 and max(size) / min(size) > 100.0


def find_axes(names: Sequence[str]) -> tuple[Axis, ...]:
    """Return the axes that have the given names; all if there are no names.

    Raises
    ------
    StudyError
        If there is no axis of a name; the message lists the names.
    """
    known = {axis.name: axis for axis in AXES}
    for name in names:
        if name not in known:
            raise StudyError(f"axis is {name!r}: the axes are {', '.join(known)}")
    return tuple(known[name] for name in names) if names else AXES


def axes_of(scene: Scene) -> tuple[Axis, ...]:
    """Return the axes that apply to a scene."""
    return tuple(axis for axis in AXES if not axis.reason_against(scene))


_BLOCK_FRICTION = 0.5
_REFERENCE_GRADING = 1e6  # as in axes.toml


def changed(baseline: Solution, change: Callable[[Any], Any]) -> Scene:
    """Return a case after a change of its scene, or of each step of several bodies with their contacts."""
    if not baseline.scene.bodies:
        result: Scene = change(baseline.scene)
        return result
    contacts = baseline.scene.contacts
    return with_changed_steps(
        baseline.stated, lambda step: change(step.with_contacts(contacts) if step.touching else step)
    )


def _similar_case(baseline: Solution, value: float, similarity: Similarity, precision: float = PRECISION) -> Case:
    keeps_steps = not baseline.scene.bodies and precision == PRECISION
    scene = changed(baseline, similarity.apply)
    return Case(value, scene, similarity, precision=precision, deviation_limit=precision, keeps_steps=keeps_steps)


def _similar(*factors: str) -> Callable[[Solution, float], Case]:
    """Return a function that makes a case in which some factors have the given value."""

    def make(baseline: Solution, value: float) -> Case:
        numbers: dict[str, Any] = dict.fromkeys(factors, value)
        return _similar_case(baseline, value, Similarity(**numbers))

    return make


def _moved(baseline: Solution, value: float) -> Case:
    """Return the case moved from the origin by the value, in diameters."""
    distance = value * max(body.mesh.diameter for body in baseline.bodies.values())
    similarity = Similarity(shift=(0.8 * distance, -0.6 * distance))
    return _similar_case(baseline, value, similarity, precision_elsewhere(baseline, distance))


def _stiffened(baseline: Solution, value: float) -> Case:
    def stiffened(scene: Scene) -> Scene:
        first, *others = scene.bodies
        material = replace(first.material, youngs_modulus=value * first.material.youngs_modulus)
        return replace(scene, bodies=(replace(first, material=material), *others))

    # displacements of the soft bodies hold eps of themselves, forces of stiff pairs as much times the ratio
    precision = PRECISION * max(1.0, value, 1.0 / value) ** 0.5
    return Case(value, changed(baseline, stiffened), precision=precision)


def _friction(baseline: Solution, value: float) -> Case:
    """Return the case in which all contacts have one friction coefficient."""
    return Case(value, changed(baseline, partial(with_friction, coefficient=value)))


def _degenerate(baseline: Solution, value: float) -> Case:
    critical = degenerate_diameters(baseline.mesh, baseline.body.scene.material)[0]
    return _similar_case(baseline, value, Similarity(length=value * float(critical) / baseline.mesh.diameter))


def _poisson(baseline: Solution, value: float) -> Case:
    material = replace(baseline.body.scene.material, poisson_ratio=value)
    # short of 1/2 the bulk modulus, 1 / (1 - 2 nu) times the shear modulus, multiplies round-off
    precision = PRECISION + (8.0 * np.finfo(float).eps / (0.5 - value) if value < 0.5 else 0.0)
    return Case(value, replace(baseline.scene, material=material), precision=precision)


def _gap(baseline: Solution, value: float) -> Case:
    displacement = float(np.abs(baseline.boundary.displacement).max())
    # clearances are differences of gaps and displacements that both grow with the offset
    precision = PRECISION * max(1.0, abs(value))
    return Case(value, with_gap_offset(baseline.scene, value * displacement), precision=precision)


def _turned(baseline: Solution, value: float) -> Case:
    return Case(value, with_turned_loads(baseline.scene, radians(value)))


def _pushed(baseline: Solution, value: float) -> Case:
    """Press a loose block, twice as wide as high, onto the floor and push it from the left.

    A half-plane is pressed by its own force onto its own obstacles, and pushed from far away.
    """
    scene = baseline.scene
    if baseline.mesh.surface is not None:
        return _pushed_half_plane(baseline, value)
    parts = (
        Part("floor", Contact(RigidHalfPlane()), sides=("bottom",)),
        Part("press", Traction(y=-1.0), sides=("top",)),
        Part("push", Pressure(2.0 * _BLOCK_FRICTION * value), sides=("left",)),
    )
    block = Scene(
        title="loose block",
        shape=Rectangle(2.0, 1.0),
        material=scene.material,
        parts=parts,
        law=Coulomb(_BLOCK_FRICTION),
        discretisation=scene.discretisation,
        mesh=MeshOptions(min(scene.mesh.n_elements, 96), Uniform()),
        solver=scene.solver,
    )
    return Case(value, block, is_solvable=None if value == 1.0 else value < 1.0)


def _pushed_half_plane(baseline: Solution, value: float) -> Case:
    scene, force = with_friction(baseline.scene, _BLOCK_FRICTION), baseline.force_normal
    far = FarField(force_x=_BLOCK_FRICTION * value * force, force_y=force, turn=0.0)
    parts = tuple(part for part in scene.parts if isinstance(part.condition, Contact))
    # where gaps are measured along the surface's normal, only friction acts along it
    is_flat = all(isinstance(part.condition, Contact) and isinstance(part.condition.obstacle, Gap) for part in parts)
    scene = replace(scene, parts=parts, far=far)
    return Case(value, scene, is_solvable=value < 1.0 if is_flat and value != 1.0 else None)


def _stretched(baseline: Solution, value: float) -> Case:
    # stiffnesses of thin bodies differ by the third power of their slenderness
    precision = PRECISION + np.finfo(float).eps * max(value, 1.0 / value) ** 3
    return Case(
        value, transformed_scene(baseline.scene, AffineMap((value, 1.0)), displacement=1.0), precision=precision
    )


def _penalised(solver: Callable[[float], ContactSolver]) -> Callable[[Solution, float], Case]:
    # answers with a certificate of 1e-9 differ by that times the compliance of what is certified
    return lambda baseline, rho: Case(rho, replace(baseline.scene, solver=solver(rho)), deviation_limit=1e-6)


def _elements(baseline: Solution, value: float) -> Case:
    """Return the case with the value times as many elements of each body."""
    common = baseline.scene.mesh

    def options(stated: MeshOptions | None, body: str) -> MeshOptions:
        n_elements = max(3, round(value * baseline.bodies[body].mesh.whole.n_elements))
        return MeshOptions(n_elements, (stated or common).grading, (stated or common).density)

    def divided(body: Body) -> Body:
        return replace(body, mesh=options(body.mesh, next(iter(body.copied())).name))

    def of_step(scene: Scene) -> Scene:
        if not scene.bodies:
            return replace(scene, mesh=options(None, ""))
        mesh = replace(common, accuracy=None)
        return replace(scene, mesh=mesh, bodies=tuple(divided(body) for body in scene.bodies))

    return Case(value, changed(baseline, of_step))


def _graded(baseline: Solution, value: float) -> Case:
    lengths = baseline.mesh.lengths
    levels = max(0, round(float(np.log2(value * lengths.min() / lengths.max()))))
    # The ends of the smallest elements are coordinates like all others: their lengths are known to 64 eps value only,
    # which the tractions on these very elements feel, and nothing else.
    return Case(
        value,
        baseline.scene,
        levels=levels,
        precision=1e-6,
        deviation_limit=1e-6 if value >= _REFERENCE_GRADING else np.inf,
    )


def degenerate_diameters(mesh: BoundaryMesh, material: Material) -> FloatArray:
    """Return the two diameters [m], ascending, at which the kernel with log|r| of plain numbers has no inverse.

    The mesh may be that of a body of any size.

    Notes
    -----
    With lengths measured by the diameter d the operator V is positive definite. A body of the same shape and the
    diameter d has ``V - c log(d) m m^T``, c = (3 - 4 nu) / (8 pi mu (1 - nu)), where the two columns of m integrate
    tractions to forces; by the matrix determinant lemma that is singular if ``1 / (c log d)`` is an eigenvalue of
    ``m^T V^-1 m``. bemkit itself never meets these sizes, because it measures lengths by the diameter.
    """
    space = ConstantSpace(mesh.unit)
    # the operator measures lengths by the diameter of its mesh, which is one here
    v = single_layer(space, space, material).matrix()
    to_force = np.kron(mesh.unit.lengths[:, None], np.eye(2))
    nu = material.effective_poisson_ratio
    factor = (3.0 - 4.0 * nu) / (8.0 * np.pi * material.shear_modulus * (1.0 - nu))
    eigenvalues = np.linalg.eigvalsh(to_force.T @ np.linalg.solve(v, to_force))
    return np.sort(np.exp(1.0 / (factor * eigenvalues)))


def _reason_against(table: Mapping[str, Any], scene: Scene) -> str:
    """Return why the axis of a table does not apply to a scene; empty if it does."""
    about = table.get("about", "")
    if about and about != ("several bodies" if scene.bodies else "one body"):
        return f"it is about {about}"
    if scene.bodies:
        return _without_similar(scene, **table["similar"]) if "similar" in table else ""
    surface = scene.only.shape.outline().surface
    if surface is None:
        return ""
    return str(table.get("half_planes", table.get("periodic", "") if surface.is_periodic else ""))


def _without_similar(scene: Scene, turn: float = 0.0, shift: Sequence[float] = (0.0, 0.0)) -> str:
    """Return why a scene of bodies has no similar one that is moved; empty if it has."""
    x, y = shift
    try:
        Similarity(turn=turn, shift=(x, y)).apply(scene)
    except InputError as error:
        return str(error)
    return ""


_MAKERS: Mapping[str, Callable[[Solution, float], Case]] = MappingProxyType(
    {
        "youngs-modulus": _similar("modulus"),
        "load": _similar("stress"),
        "size": _similar("length"),
        "position": _moved,
        "degenerate-size": _degenerate,
        "poisson-ratio": _poisson,
        "friction": _friction,
        "gap": _gap,
        "load-direction": _turned,
        "sliding": _pushed,
        "aspect-ratio": _stretched,
        "rho-newton": _penalised(lambda rho: SemismoothNewton(rho=rho)),
        "rho-augmented": _penalised(lambda rho: AugmentedLagrangian(rho_n=rho, rho_t=rho)),
        "elements": _elements,
        "grading": _graded,
        "stress": _similar("modulus", "stress"),
        "turn": _similar("turn"),
        "stiffness": _stiffened,
    }
)


def _read_axes() -> tuple[Axis, ...]:
    """Return the axes of ``axes.toml`` with the functions that make their cases."""
    text = (resources.files("bemkit") / "studies" / "stability" / "axes.toml").read_text("utf-8")
    return tuple(
        Axis(
            name,
            *(table["label"], table["promise"], tuple(table["values"]), _MAKERS[name]),
            reference=table.get("reference"),
            reason_against=partial(_reason_against, table),
        )
        for name, table in tomllib.loads(text).items()
    )


AXES: tuple[Axis, ...] = _read_axes()
"""Every axis, in the order of the report; an axis that does not apply to a scene gives the reason."""
