"""The axes of the stability sweeps of several bodies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from bemkit.errors import InputError
from bemkit.results.solution import Solution
from bemkit.scene.body import Body
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.scene import Scene
from bemkit.studies.stability.axes import Axis, changed, friction, moved, read_axes, similar
from bemkit.studies.stability.case import PRECISION, Case
from bemkit.studies.stability.similar_bodies import BodiesSimilarity


def _against(similarity: BodiesSimilarity) -> Callable[[Scene], str]:
    """Return what says why a scene has no similar one."""

    def reason(scene: Scene) -> str:
        try:
            similarity.apply(scene)
        except InputError as error:
            return str(error)
        return ""

    return reason


def _stiffened(baseline: Solution, value: float) -> Case:
    def stiffened(scene: Scene) -> Scene:
        first, *others = scene.bodies
        material = replace(first.material, youngs_modulus=value * first.material.youngs_modulus)
        return replace(scene, bodies=(replace(first, material=material), *others))

    # displacements of the soft bodies hold eps of themselves, forces of stiff pairs as much times the ratio
    precision = PRECISION * max(1.0, value, 1.0 / value) ** 0.5
    return Case(value, changed(baseline, stiffened), precision=precision)


def _elements(baseline: Solution, value: float) -> Case:
    common = baseline.scene.mesh

    def divided(body: Body) -> Body:
        options = common if body.mesh is None else body.mesh
        n_elements = baseline.bodies[next(iter(body.copied())).name].mesh.whole.n_elements
        return replace(body, mesh=MeshOptions(max(3, round(value * n_elements)), options.grading))

    mesh = replace(common, accuracy=None)

    def of_step(scene: Scene) -> Scene:
        return replace(scene, mesh=mesh, bodies=tuple(divided(body) for body in scene.bodies))

    return Case(value, changed(baseline, of_step))


AXES_OF_BODIES: tuple[Axis, ...] = read_axes(
    "several-bodies",
    {
        "stress": similar(BodiesSimilarity, "stress"),
        "size": similar(BodiesSimilarity, "length"),
        "turn": similar(BodiesSimilarity, "turn"),
        "position": moved(BodiesSimilarity),
        "stiffness": _stiffened,
        "friction": friction,
        "elements": _elements,
    },
    {
        "turn": _against(BodiesSimilarity(turn=30.0)),
        "position": _against(BodiesSimilarity(shift=(1.0, 0.0))),
    },
)
"""Every axis of several bodies, in the order of the report."""
