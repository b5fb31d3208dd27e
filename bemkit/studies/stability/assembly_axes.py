"""The axes of the stability sweeps of several bodies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from bemkit.errors import InputError
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.scene.assembly import Assembly
from bemkit.scene.body import Body
from bemkit.scene.mesh_options import MeshOptions
from bemkit.studies.stability.axes import Axis, changed, friction, moved, similar
from bemkit.studies.stability.case import PRECISION, Case
from bemkit.studies.stability.random_assemblies.similar import AssemblySimilarity

_SIMILAR = "results equal to 1e-9 after scaling"
_FREE = "right answer or named error"


def _against(similarity: AssemblySimilarity) -> Callable[[Assembly], str]:
    """Return what says why an assembly has no similar one."""

    def reason(assembly: Assembly) -> str:
        try:
            similarity.apply(assembly)
        except InputError as error:
            return str(error)
        return ""

    return reason


def _stiffened(baseline: AssemblySolution, value: float) -> Case:
    def stiffened(assembly: Assembly) -> Assembly:
        first, *others = assembly.bodies
        material = replace(first.material, youngs_modulus=value * first.material.youngs_modulus)
        return replace(assembly, bodies=(replace(first, material=material), *others))

    # displacements of the soft bodies hold eps of themselves, forces of stiff pairs as much times the ratio
    precision = PRECISION * max(1.0, value, 1.0 / value) ** 0.5
    return Case(value, changed(baseline, stiffened), precision=precision)


def _elements(baseline: AssemblySolution, value: float) -> Case:
    common = baseline.assembly.mesh

    def divided(body: Body) -> Body:
        options = common if body.mesh is None else body.mesh
        n_elements = baseline.bodies[next(iter(body.copied())).name].mesh.whole.n_elements
        return replace(body, mesh=MeshOptions(max(3, round(value * n_elements)), options.grading))

    mesh = replace(common, accuracy=None)

    def of_step(assembly: Assembly) -> Assembly:
        return replace(assembly, mesh=mesh, bodies=tuple(divided(body) for body in assembly.bodies))

    return Case(value, changed(baseline, of_step))


_DECADES = tuple(10.0**k for k in (-9, -6, -3, 3, 6, 9))

ASSEMBLY_AXES: tuple[Axis[AssemblySolution], ...] = (
    Axis("stress", "factor of all moduli and loads", _SIMILAR, _DECADES, similar(AssemblySimilarity, "stress")),
    Axis("size", "factor of all lengths", _SIMILAR, _DECADES, similar(AssemblySimilarity, "length")),
    Axis(
        "turn",
        "turn of everything [degrees]",
        _SIMILAR,
        (30.0, 45.0, 90.0, 137.0, 180.0),
        similar(AssemblySimilarity, "turn"),
        reason_against=_against(AssemblySimilarity(turn=30.0)),
    ),
    Axis(
        "position",
        "distance from the origin / diameter",
        "results equal up to the round-off of gaps, 4 eps distance; refused beyond 1e7",
        (1.0, 1e2, 1e4, 1e6, 1e8, 1e12),
        moved(AssemblySimilarity),
        reason_against=_against(AssemblySimilarity(shift=(1.0, 0.0))),
    ),
    Axis("stiffness", "factor of Young's modulus of the first body", _FREE, (*_DECADES[1:-1], 1e-8, 1e8), _stiffened),
    Axis("friction", "friction coefficient", _FREE, (0.0, 0.01, 0.1, 0.3, 0.5, 1.0, 3.0, 10.0, 100.0), friction),
    Axis(
        "elements",
        "number of elements / that of the scene",
        "right answer; drift is the discretisation error",
        (0.25, 0.5, 1.0, 2.0),
        _elements,
    ),
)
"""Every axis of several bodies, in the order of the report."""
