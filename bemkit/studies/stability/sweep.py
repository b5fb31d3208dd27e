"""Run the cases of the axes and judge each by two independent pieces of evidence."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import BemkitError, InputError
from bemkit.model.contact_model import build_model
from bemkit.operators.linear.threads import blas_threads_for
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.scene.scene import Scene
from bemkit.studies.stability.cases import Axis, Case, Similarity
from bemkit.studies.stability.evidence import examine

TWIN = Similarity(length=3.7e-3, modulus=7.3e5, stress=1.9e-2)
"""Every case is solved a second time in these units. No factor is a power of two, so all round-off differs."""

REFUSED = "refused"
"""Status of a scene that is refused by a named error before any step."""


class Verdict(Enum):
    """What a row shows."""

    RIGHT = "right"
    """Called converged; the independent check and the similar twin agree, and so does the reference where it must."""
    COARSE = "coarse"
    """The same, but the mesh is so coarse that tractions and displacements hardly belong together."""
    AMBIGUOUS = "ambiguous"
    """The case and its twin each pass the independent check, and differ: nothing decides between several solutions."""
    NAMED = "named"
    """No answer, but a named status or error, and the same for the twin."""
    WRONG = "wrong"
    """Called converged against the evidence, refused although solvable, or an answer that the twin does not share."""


@dataclass(frozen=True)
class Row:
    """One line of the tables.

    Parameters
    ----------
    axis : str
    value : float
    verdict, status : str
        Values of `Verdict`; name of the solver's status in small letters, or `REFUSED`.
    linear_solves : int
    certificate : float
        Worst entry, as the driver says.
    check : float
        Worst entry of the independent check, see `Evidence`.
    reciprocity : float
        Of the independent check: elasticity itself, up to the discretisation error.
    condition : float
        2-norm condition number of the contact stiffness with unit diagonal, free rigid motions left out.
    drift : float
        Largest difference to the reference, scaled back, relative to its largest displacement and traction.
    twin : float
        The same between the case and its similar twin: nothing but amplified round-off.
    seconds : float [s]
    message : str
        The remark of the solver or the text of the error; what speaks against the row if it is wrong.
    """

    axis: str
    value: float
    verdict: str
    status: str
    linear_solves: int
    certificate: float
    check: float
    reciprocity: float
    condition: float
    drift: float
    twin: float
    seconds: float
    message: str


class StabilityError(InputError):
    """A sweep that cannot begin."""


class Attempt(NamedTuple):
    """A solution, or why there is none."""

    solution: Solution | None
    message: str
    seconds: float

    @property
    def status(self) -> str:
        """The status in small letters."""
        return REFUSED if self.solution is None else self.solution.status.name.lower()

    @property
    def is_converged(self) -> bool:
        """Whether the solver vouches for a solution."""
        return self.solution is not None and self.solution.is_converged

    @property
    def is_certified(self) -> bool:
        """Whether there is a solution that is certified, be it as accurate as was wished or not."""
        return self.solution is not None and self.solution.is_certified


def sweep(
    scene: Scene,
    axes: Sequence[Axis],
    *,
    finished: Mapping[tuple[str, float], Row] | None = None,
    begins: Callable[[Axis, float], None] | None = None,
) -> Iterator[Row]:
    """Compute the rows of some axes, one after the other.

    Parameters
    ----------
    scene : Scene
        The baseline.
    axes : sequence of Axis
    finished : mapping of (axis, value) to Row, optional
        Rows of an earlier sweep, which are handed on instead of computed again.
    begins : callable, optional
        Called with axis and value before each row that is computed.

    Yields
    ------
    Row

    Raises
    ------
    StabilityError
        If the scene itself has no converged solution, or no contact.
    """
    finished = {} if finished is None else finished
    if not scene.contact_parts:
        raise StabilityError("the scene has no contact, which this suite is about: give one that has")
    baseline = attempt(scene)
    if baseline.solution is None or not baseline.is_converged:
        raise StabilityError(f"the scene itself has no converged solution ({baseline.message}): give one that has")
    for axis in axes:
        reference = None
        for value in axis.values:
            row = finished.get((axis.name, value))
            if row is None:
                if begins is not None:
                    begins(axis, value)
                if reference is None:
                    reference = _reference(axis, baseline.solution)
                row = compute(axis.name, axis.make(baseline.solution, value), reference)
            yield row


def attempt(scene: Scene, case: Case | None = None) -> Attempt:
    """Solve a scene on the mesh of its case; errors that bemkit names are answers too."""
    begin = time.perf_counter()
    try:
        solution = run(scene, mesh=None if case is None else case.mesh(scene))
    except BemkitError as error:
        return Attempt(None, str(error), time.perf_counter() - begin)
    return Attempt(solution, solution.message, time.perf_counter() - begin)


def compute(axis: str, case: Case, reference: Solution | None) -> Row:
    """Solve a case and its twin, and judge them.

    Parameters
    ----------
    axis : str
        Name of the axis, for the row.
    case : Case
    reference : Solution or None
        What the drift is measured against; None if the reference itself has no solution.

    Returns
    -------
    Row
    """
    twin_scene = TWIN.apply(case.scene)
    first, second = attempt(case.scene, case), attempt(twin_scene, case)
    solution = first.solution
    drift = twin = math.nan
    evidence = None
    if solution is not None:
        evidence = examine(solution)
        if reference is not None:
            drift = difference(reference, solution, case.similarity)
        if second.solution is not None:
            twin = difference(solution, second.solution, TWIN, in_mean=case.levels > 0)
    verdict, objection = _judge(case, reference, first, second, drift, twin)
    return Row(
        axis=axis,
        value=case.value,
        verdict=verdict.value,
        status=first.status,
        linear_solves=0 if solution is None else solution.linear_solves,
        certificate=math.nan if solution is None else solution.certificate.worst,
        check=math.nan if evidence is None else evidence.worst,
        reciprocity=math.nan if evidence is None else evidence.reciprocity,
        condition=math.nan if solution is None else condition_number(twin_scene, case),
        drift=drift,
        twin=twin,
        seconds=first.seconds,
        message=objection or ("" if first.is_converged else first.message),
    )


def difference(reference: Solution, solution: Solution, similarity: Similarity, *, in_mean: bool = False) -> float:
    """Return the largest difference of two contact tables after scaling the second back.

    Parameters
    ----------
    reference, solution : Solution
    similarity : Similarity
        Leads from the reference to the solution.
    in_mean : bool
        Take the mean along each contact part instead of the largest entry; always on other meshes,
        because single nodes at corners see singular tractions.

    Returns
    -------
    float
        Of clearances and tangential displacements relative to the largest displacement, of tractions relative to the
        largest traction of the reference. On different meshes the coarser one is interpolated to the finer one.
    """
    one, other = reference.contact, solution.contact
    unit = max(float(np.abs(one.u_n).max()), float(np.abs(one.u_t).max())) or 1.0
    stress = max(float(np.abs(one.sigma_n).max()), float(np.abs(one.sigma_t).max())) or 1.0
    is_same_mesh = one.n_contact == other.n_contact
    worst = 0.0
    for part in dict.fromkeys(one.part):
        rows, others = (np.array([name == part for name in table.part]) for table in (one, other))
        if not others.any():
            return math.inf
        places, scaled_places = one.s[rows], other.s[others] / similarity.length
        is_finer = bool(others.sum() > rows.sum())
        weight = other.weight[others] if is_finer else one.weight[rows]
        for name in ("clearance", "u_t", "sigma_n", "sigma_t"):
            is_stress = name.startswith("sigma")
            before = getattr(one, name)[rows]
            scaled = getattr(other, name)[others] / (similarity.stress if is_stress else similarity.displacement)
            if not is_same_mesh and is_finer:
                before = np.interp(scaled_places, places, before)
            elif not is_same_mesh:
                scaled = np.interp(places, scaled_places, scaled)
            gone = _apart(before, scaled)
            size = gone.max() if is_same_mesh and not in_mean else weight @ gone / weight.sum()
            worst = max(worst, float(size) / (stress if is_stress else unit))
    return worst


def _apart(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return the distances of two columns; infinite clearances agree with each other only."""
    known = np.isfinite(before) | np.isfinite(after)
    return np.asarray(np.abs(np.where(known, after, 0.0) - np.where(known, before, 0.0)))


def condition_number(scene: Scene, case: Case) -> float:
    """Return the condition number of the contact stiffness of a scene; see `Row`."""
    mesh = case.mesh(scene)
    with blas_threads_for(2 * mesh.n_elements):
        body = build_model(scene, mesh).body
        diagonal = np.abs(np.diagonal(body.stiffness))
        scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        singular = np.linalg.svd(scale[:, None] * body.stiffness * scale, compute_uv=False)
    smallest = float(singular[max(singular.size - 1 - len(body.rigid_motions()), 0)])
    return float(singular[0]) / smallest if smallest > 0.0 else math.inf


def _reference(axis: Axis, baseline: Solution) -> Solution | None:
    if axis.reference is None:
        return baseline
    case = axis.make(baseline, axis.reference)
    found = attempt(case.scene, case)
    return found.solution if found.is_converged else None


def _judge(
    case: Case, reference: Solution | None, first: Attempt, second: Attempt, drift: float, twin: float
) -> tuple[Verdict, str]:
    """Return the verdict and what speaks against the row, if anything does."""
    if first.status != second.status:
        return Verdict.WRONG, f"{first.status}, but its similar twin: {second.status} ({second.message})"
    if not first.is_converged or first.solution is None or second.solution is None:
        if case.is_solvable or case.keeps_steps:
            return Verdict.WRONG, f"solvable, but: {first.message}"
        return Verdict.NAMED, ""
    evidence, other = examine(first.solution), examine(second.solution)
    objections = {
        "no solution exists": case.is_solvable is False,
        f"the independent check finds {evidence.worst:.1e}": not evidence.is_good,
        "drifts from the reference": math.isfinite(case.drift_limit) and not drift <= case.drift_limit,
    }
    if case.keeps_steps and reference is not None:
        objections["other active sets"] = not np.array_equal(first.solution.contact.status, reference.contact.status)
        objections["other linear solves"] = first.solution.linear_solves != reference.linear_solves
    differs = not twin <= case.precision
    is_free = math.isinf(case.drift_limit) and other.is_good
    objections["the similar twin differs"] = differs and not is_free
    found = [text for text, speaks_against in objections.items() if speaks_against]
    if found:
        return Verdict.WRONG, "; ".join(found)
    if differs:
        return Verdict.AMBIGUOUS, "the similar twin is another solution by the independent check"
    if evidence.is_coarse:
        return Verdict.COARSE, f"Betti's theorem is missed by {evidence.reciprocity:.0%}: use more elements"
    return Verdict.RIGHT, ""
