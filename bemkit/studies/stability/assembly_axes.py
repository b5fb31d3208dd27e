"""The axes of the stability sweeps of several bodies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from bemkit.contact.laws import Coulomb
from bemkit.errors import InputError
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.scene.assembly import Assembly
from bemkit.scene.body import Body
from bemkit.scene.load_history import with_changed_steps
from bemkit.scene.mesh_options import MeshOptions
from bemkit.studies.stability.axes import Axis
from bemkit.studies.stability.case import PRECISION, Case, precision_elsewhere, without_own_laws
from bemkit.studies.stability.random_assemblies.similar import AssemblySimilarity

_SIMILAR = "results equal to 1e-9 after scaling"
_FREE = "right answer or named error"


def _similar(baseline: AssemblySolution, value: float, *, factor: str) -> Case:
    similarity = replace(AssemblySimilarity(), **{factor: value})  # type: ignore[arg-type]  # one of its numbers
    return _similar_case(baseline, value, similarity, PRECISION)


def _moved(baseline: AssemblySolution, value: float) -> Case:
    distance = value * max(body.mesh.diameter for body in baseline.solved_bodies)
    precision = precision_elsewhere(baseline, distance)
    return _similar_case(baseline, value, AssemblySimilarity(shift=(0.8 * distance, -0.6 * distance)), precision)


def _similar_case(baseline: AssemblySolution, value: float, similarity: AssemblySimilarity, precision: float) -> Case:
    scene = _changed(baseline, similarity.apply)
    return Case(value, scene, similarity, precision=precision, drift_limit=precision)


def _changed(baseline: AssemblySolution, change: Callable[[Assembly], Assembly]) -> Assembly:
    """Return what was asked, all its steps with the contacts that were found, after a change of each step."""
    contacts = baseline.assembly.contacts
    return with_changed_steps(
        baseline.stated, lambda step: change(step.with_contacts(contacts) if step.touching else step)
    )


def _against(assembly: Assembly, *, similarity: AssemblySimilarity) -> str:
    """Return why an assembly has no similar one; empty if it has."""
    try:
        similarity.apply(assembly)
    except InputError as error:
        return str(error)
    return ""


def _stiffened(baseline: AssemblySolution, value: float) -> Case:
    def stiffened(assembly: Assembly) -> Assembly:
        first, *others = assembly.bodies
        material = replace(first.material, youngs_modulus=value * first.material.youngs_modulus)
        return replace(assembly, bodies=(replace(first, material=material), *others))

    # displacements of the soft bodies hold eps of themselves, forces of stiff pairs as much times the ratio
    precision = PRECISION * max(1.0, value, 1.0 / value) ** 0.5
    return Case(value, _changed(baseline, stiffened), precision=precision)


def _friction(baseline: AssemblySolution, value: float) -> Case:
    def rubbed(assembly: Assembly) -> Assembly:
        return replace(
            assembly,
            bodies=tuple(replace(body, parts=without_own_laws(body.parts)) for body in assembly.bodies),
            contacts=tuple(replace(pair, law=None) for pair in assembly.contacts),
            law=Coulomb(value),
        )

    return Case(value, _changed(baseline, rubbed))


def _elements(baseline: AssemblySolution, value: float) -> Case:
    common = baseline.assembly.mesh

    def divided(body: Body) -> Body:
        options = common if body.mesh is None else body.mesh
        n_elements = baseline.bodies[next(iter(body.copied())).name].mesh.whole.n_elements
        return replace(body, mesh=MeshOptions(max(3, round(value * n_elements)), options.grading))

    mesh = replace(common, accuracy=None)

    def of_step(assembly: Assembly) -> Assembly:
        return replace(assembly, mesh=mesh, bodies=tuple(divided(body) for body in assembly.bodies))

    return Case(value, _changed(baseline, of_step))


_DECADES = tuple(10.0**k for k in (-9, -6, -3, 3, 6, 9))

ASSEMBLY_AXES: tuple[Axis[AssemblySolution], ...] = (
    Axis("stress", "factor of all moduli and loads", _SIMILAR, _DECADES, partial(_similar, factor="stress")),
    Axis("size", "factor of all lengths", _SIMILAR, _DECADES, partial(_similar, factor="length")),
    Axis(
        "turn",
        "turn of everything [degrees]",
        _SIMILAR,
        (30.0, 45.0, 90.0, 137.0, 180.0),
        partial(_similar, factor="turn"),
        against_assembly=partial(_against, similarity=AssemblySimilarity(turn=30.0)),
    ),
    Axis(
        "position",
        "distance from the origin / diameter",
        "results equal up to the round-off of gaps, 4 eps distance; refused beyond 1e7",
        (1.0, 1e2, 1e4, 1e6, 1e8, 1e12),
        _moved,
        against_assembly=partial(_against, similarity=AssemblySimilarity(shift=(1.0, 0.0))),
    ),
    Axis("stiffness", "factor of Young's modulus of the first body", _FREE, (*_DECADES[1:-1], 1e-8, 1e8), _stiffened),
    Axis("friction", "friction coefficient", _FREE, (0.0, 0.01, 0.1, 0.3, 0.5, 1.0, 3.0, 10.0, 100.0), _friction),
    Axis(
        "elements",
        "number of elements / that of the scene",
        "right answer; drift is the discretisation error",
        (0.25, 0.5, 1.0, 2.0),
        _elements,
    ),
)
"""Every axis of several bodies, in the order of the report."""
