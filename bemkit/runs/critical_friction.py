"""Critical friction of a scene: the coefficient above which a sliding solution may not be unique."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bemkit.arrays import BoolArray
from bemkit.contact.body import SingularResponse
from bemkit.contact.critical_friction import critical_coefficient, sliding_response
from bemkit.contact.laws import LawError
from bemkit.contact.problem import ContactProblem
from bemkit.errors import InputError, NoResultError
from bemkit.results.solution import Solution
from bemkit.runs.run import on_its_meshes
from bemkit.runs.solution_of import solution_of, with_missed_contact_named
from bemkit.runs.steps import UnsolvableSceneError, built, checked, planned
from bemkit.scene.load_history import load_steps
from bemkit.scene.scene import Scene, check_scene
from bemkit.solvers.active_sets import NodeStatus
from bemkit.solvers.base import ContactSolution, solve
from bemkit.threads import blas_threads_for


@dataclass(frozen=True)
class CriticalFriction:
    """Smallest friction coefficients above which sliding states may not be unique; infinite if there are none.

    Parameters
    ----------
    forward, backward : float
        All nodes in contact slide along their tangents, or against them.
    present : float
        Nodes that slip in the solution of the scene slide on in their directions, those that stick stay.
    n_contact, n_slipping : int
        Nodes in contact, and those of them that slip in the solution.
    """

    forward: float
    backward: float
    present: float
    n_contact: int
    n_slipping: int

    @property
    def smallest(self) -> float:
        """The smallest of the three."""
        return min(self.forward, self.backward, self.present)

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers by their names; None for infinite ones."""
        numbers = {"smallest": self.smallest} | asdict(self)
        return {name: None if math.isinf(value) else value for name, value in numbers.items()}


def critical_friction(scene: Scene) -> CriticalFriction:
    """Return the friction coefficients above which sliding states of a scene may not be unique.

    Parameters
    ----------
    scene : Scene
        With a law under which friction grows with the pressure, and a single load. Which nodes are in contact, and
        which of them slip, is taken from its solution under its own law; one coefficient is then asked for that all
        sliding nodes have in common.

    Raises
    ------
    InputError
        If no part is in contact, or there are several load factors.
    LawError
        If there is no friction, or none that grows with the pressure: then there is no such coefficient.
    UnsolvableSceneError
        If nothing but friction keeps a body from sliding: it does so at any coefficient.
    NoResultError
        If no solution is found, no node is in contact, or the accuracy is not reached.

    Notes
    -----
    The statement is one about rates [Klarbring1990], which for states that slide as a whole is Hild's about solutions
    [Hild2004]. Let all nodes of a set slide in given directions and stay in contact, let the others in contact stick,
    or have no friction, and let all others stay open. At a coefficient s at which
    ``tangential v = s diag(direction) normal v`` has a solution (see `bemkit.contact.critical_friction`), the motion v
    can be added to any such state, or none exists: the rate problem cannot be solved uniquely. Past the smallest such s
    there are loads under which the scene has several solutions or none; ``bemkit study solutions`` looks for them.

    This is not a bound below which solutions are unique: other sets of nodes have coefficients of their own. Nor does
    it say that the load of the scene is one of those loads. The stiffness is that of the mesh, and scenes with symmetry
    lines slide symmetrically.
    """
    problem, statuses = _solved(scene)
    slope = problem.friction_slope(np.full(problem.n_contact, -1.0))
    is_closed = statuses != NodeStatus.SEPARATED
    has_friction = (slope < 0.0) & ~problem.body.tangent_follows
    if not has_friction.any():
        raise LawError("friction does not grow with the pressure: choose Coulomb's law, or one like it")
    if not (is_closed & has_friction).any():
        raise NoResultError("no node with friction is in contact under this load: press the sides together")
    return _coefficients(problem, statuses, is_closed, is_closed & has_friction)


def _coefficients(
    problem: ContactProblem,
    statuses: np.ndarray[tuple[int], np.dtype[np.intp]],
    is_closed: BoolArray,
    slides: BoolArray,
) -> CriticalFriction:
    try:
        normal, tangential = sliding_response(problem.body, is_closed, slides)
    except SingularResponse as error:
        raise UnsolvableSceneError(f"{error}, at any coefficient: add a support") from error
    own = statuses[slides]
    signs = (own == NodeStatus.SLIP_FORWARD) * 1.0 - (own == NodeStatus.SLIP_BACKWARD)
    slipping = np.flatnonzero(signs)
    part = np.ix_(slipping, slipping)
    ones = np.ones(len(own))
    return CriticalFriction(
        forward=critical_coefficient(normal, tangential, ones),
        backward=critical_coefficient(normal, tangential, -ones),
        present=critical_coefficient(normal[part], tangential[part], signs[slipping]),
        n_contact=int(slides.sum()),
        n_slipping=len(slipping),
    )


def _solved(scene: Scene) -> tuple[ContactProblem, np.ndarray[tuple[int], np.dtype[np.intp]]]:
    """Return the contact problem of a scene, on the mesh that its accuracy needs, and the statuses of its nodes."""
    check_scene(scene)
    if scene.n_steps > 1:
        raise InputError(f"a load history of {scene.n_steps} steps has no single state: give one load")
    if not scene.has_contact:
        raise InputError("no part is in contact: nothing slides")
    scene, mesh = on_its_meshes(scene)
    (prepared,), plan, clock = planned(load_steps(scene), mesh)
    if not (prepared.n_contact or any(body.scene.contact_parts for body in prepared.bodies)):
        raise InputError("no two bodies are in contact: nothing slides")
    with blas_threads_for(prepared.largest_matrix):
        model, clock = built(prepared, clock)
        result = checked(model, solve(model.problem, scene.solver, throw=False))
        found: ContactSolution | Solution = result
        if result.is_converged:
            found = with_missed_contact_named(solution_of(model, result, plan, clock))
    if not found.is_converged:
        raise NoResultError(f"the scene has no solution to begin with: {found.message}")
    return model.problem, result.node_status
