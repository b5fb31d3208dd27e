"""Semismooth Newton on contact and friction together."""

from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import TYPE_CHECKING

from bemkit.contact.problem import ContactProblem, ContactState
from bemkit.solvers.active_sets import ActiveSets, ProjectionEquations, Residual
from bemkit.solvers.base import Iterate, Status, check_count, check_max_steps, check_rho
from bemkit.solvers.newton import WEAKEST_AFTER, carried_on, merit, negligible, respond

if TYPE_CHECKING:
    from bemkit.solvers.homotopy import PathEnd

PATH_MESSAGE, SPRINGS_MESSAGE = "path of", "springs of"
"""How the messages of steps begin that follow a path of solutions, and that hold all bodies by springs."""
_MOST_PATHS = 5
"""Paths followed to their ends before giving up. One is enough for bounds that are affine in the pressure; for others
each path starts from the tangent at the end of the last."""

_FRICTION_DECREASE, _MOST_DECREASES = 0.25, 4
"""Factor of the friction from one step under weaker friction to the next, and the number of such steps."""

_SHORT_PIECES = 20
"""Pieces of a short path, besides one for eight nodes; the whole path has one or two for each node."""

_COSTLY_PIECES = 80
"""Pieces of a short path where responses are costly: after springs, packings of 200 discs took 37."""

_WEAKER_FULL = 12
"""Full steps under weaker friction."""

_COSTLY_FULL, _COSTLY_DAMPED = 20, 5
"""Full steps and steps with line search at most where responses are costly: jumps of walls of 200 blocks to 98 % of
their collapse load take 15 full steps."""

_FIRST_SPRING, _SPRING_DECREASE, _LAST_SPRING = 3e-2, 0.25, 1e-5
"""Springs of the phase SPRINGS in units of the stiffness scale: the first, the factor to the next, and the weakest."""

_MOST_WITH_SPRINGS = 90
"""Steps of that phase; packings of 200 discs take 50 to 70."""

_MOTIONS_OF_ONE_BODY = 3
"""Rigid motions of a single body."""

_MOST_HELD = 8
"""Full steps with springs after which many costly bodies are held by springs throughout; a wall that leans to 98 % of
its limit takes five."""


class Phase(Enum):
    """What the next step does; see the notes of `SemismoothNewton`."""

    FULL = auto()
    SHORT_PATH = auto()
    DAMPED = auto()
    WEAKER_FRICTION = auto()
    PATH = auto()
    SPRINGS = auto()

    @property
    def fallbacks(self) -> tuple["Phase", ...]:
        """The phases to try when this one has failed, in order."""
        phases = tuple(Phase)
        return phases[phases.index(self) + 1 :]


@dataclass(frozen=True, eq=False, kw_only=True)
class NewtonIterate(Iterate):
    """Iterate of `SemismoothNewton`.

    Parameters
    ----------
    residual : Residual
        The projections at the state.
    sets : ActiveSets
        Sets of the next Newton matrix.
    merit : float
        Size of the residual at the state; see `bemkit.solvers.newton.merit`.
    best : tuple of float and Residual
        The smallest merit since the phase FULL began, and the residual there.
    visited : frozenset of bytes
        Keys of all sets since then.
    phase : Phase
    n_in_phase : int
        Steps taken in this phase.
    n_regularised : int
        Steps in a row, up to this one, that needed springs and kept the sets.
    n_paths : int
        Paths followed to their ends so far.
    n_held : int
        Full steps since the start that needed springs.
    spring : float
        Stiffness of the springs of the phase SPRINGS [Pa/m]; zero before this phase.
    anchor : ContactState or None
        Where these springs are without force.
    """

    residual: Residual
    sets: ActiveSets
    merit: float
    best: tuple[float, Residual]
    visited: frozenset[bytes]
    phase: Phase = Phase.FULL
    n_in_phase: int = 0
    n_regularised: int = 0
    n_paths: int = 0
    n_held: int = 0
    spring: float = 0.0
    anchor: ContactState | None = None


@dataclass(frozen=True)
class SemismoothNewton:
    """Newton's method on the projection equations (15), (16), the friction bound differentiated with them.

    Parameters
    ----------
    rho : float, optional
        Ratio of traction to displacement in the projections [Pa/m]. By default the stiffness scale of the body. After
        a full step it matters only at nodes that change from slip to slip, or from open to closed.
    max_steps : int
        Steps allowed; a path counts as one.
    full_steps : int
        Full steps allowed before the line search begins; it begins earlier if active sets come back. At most 20 where
        the responses of the body are costly, unless springs have held it in the steps before.
    damped_steps : int
        Steps with line search allowed before the path is followed; zero leaves the line search out. At most 5 where
        responses are costly: load steps closer to each other help more.
    follows_path : bool
        Whether to follow the path of solutions when all else fails; see `bemkit.solvers.homotopy`.

    Notes
    -----
    A node reverses its slip only by way of stick. For Coulomb's law the equations are piecewise linear, so a full step
    that reproduces its active sets has found an exact solution. Phases follow each other as far as they are needed:

    1. FULL: full Newton steps until active sets come back. They suffice nearly always, 5 to 10 for any friction.
    2. SHORT_PATH: of the sets that come back most nodes are right. On the path of solutions from them to the problem
       itself one node changes at a time, by two linear solves for each that is wrong.
    3. DAMPED: Newton steps with a line search on the residual, from the state where it was smallest.
    4. WEAKER_FRICTION: full steps under a share of the friction, and a short path from there to all of it.
    5. PATH: the whole path of solutions under an extra pressure that decreases: a few linear solves for each node.
    6. SPRINGS, for many bodies that contact alone can hold: full steps with springs on all of them, which become weaker
       as the sets settle, each without force where the last one has led (the proximal point method).

    In the other phases weak springs help only in single steps, whose sets do not hold the body.

    References
    ----------
    [HintermuellerItoKunisch2002], [HueeberStadlerWohlmuth2008]; the linearised bound after [ChristensenEtAl1998];
    springs after [Rockafellar1976].
    """

    rho: float | None = None
    max_steps: int = 100
    full_steps: int = 30
    damped_steps: int = 15
    follows_path: bool = True

    def __post_init__(self) -> None:
        check_rho("rho", self.rho)
        check_max_steps(self.max_steps)
        check_count("full_steps", self.full_steps)
        check_count("damped_steps", self.damped_steps)

    def init(self, problem: ContactProblem, start: ContactState) -> NewtonIterate:
        """Start from the active sets of a response."""
        return self._iterate_at(problem, start)

    def step(self, problem: ContactProblem, iterate: Iterate) -> NewtonIterate:
        """Take one step of the phase that the iterate is in."""
        if not isinstance(iterate, NewtonIterate):
            raise TypeError(f"iterate is a {type(iterate).__name__}; give what init or step of this driver returned")
        if iterate.phase is Phase.FULL:
            return self._full_step(problem, iterate)
        if iterate.phase is Phase.DAMPED:
            return self._damped_step(problem, iterate)
        if iterate.phase is Phase.WEAKER_FRICTION:
            return self._weaker_friction_step(problem, iterate)
        if iterate.phase is Phase.SPRINGS:
            return self._spring_step(problem, iterate)
        return self._path_step(problem, iterate)

    def _equations(self, problem: ContactProblem) -> ProjectionEquations:
        rho = problem.body.stiffness_scale if self.rho is None else self.rho
        return ProjectionEquations(problem, rho, rho)

    def _iterate_at(self, problem: ContactProblem, state: ContactState) -> NewtonIterate:
        residual = self._equations(problem).evaluate(state)
        size = merit(problem, residual)
        return NewtonIterate(
            state=state,
            residual=residual,
            sets=residual.sets,
            merit=size,
            best=(size, residual),
            visited=frozenset([residual.sets.key]),
        )

    def _full_step(self, problem: ContactProblem, iterate: NewtonIterate) -> NewtonIterate:
        equations = self._equations(problem)
        response = respond(equations, iterate.residual, iterate.sets, iterate.n_regularised)
        state = response.state
        if response.is_regularised and iterate.n_regularised >= WEAKEST_AFTER:
            state = carried_on(problem, iterate.state, state)
        residual = equations.evaluate(state)
        sets = equations.through_stick(residual, iterate.sets)
        size = merit(problem, residual)
        keeps_sets = sets.key == iterate.sets.key
        following = replace(
            iterate,
            state=residual.state,
            linear_solves=iterate.linear_solves + response.linear_solves,
            message="held by springs" if response.is_regularised else "",
            residual=residual,
            sets=sets,
            merit=size,
            best=(size, residual) if size < iterate.best[0] else iterate.best,
            visited=iterate.visited | {sets.key},
            n_in_phase=iterate.n_in_phase + 1,
            n_held=iterate.n_held + response.is_regularised,
            n_regularised=iterate.n_regularised + 1 if response.is_regularised and keeps_sets else 0,
        )
        # Equal sets give equal steps, unless springs or a nonlinear law remember the state.
        is_new = sets.key not in iterate.visited
        repeats = not is_new and not response.is_regularised and following.merit >= 0.5 * iterate.merit
        if repeats and size <= negligible(problem.body):
            reason = "contact and friction are satisfied, the rest of the certificate is beyond this driver"
            return replace(following, ended=Status.STALLED, message=reason)
        if repeats:
            return self._next_phase(problem, following, Status.CYCLING, "the active sets come back")
        is_first_try = problem.body.is_costly and following.spring == 0.0
        most = min(self.full_steps, _COSTLY_FULL) if is_first_try else self.full_steps
        if following.n_in_phase >= most:
            reason = f"{most} full steps have not settled the active sets"
            return self._next_phase(problem, following, Status.STALLED, reason)
        if problem.body.is_costly and following.n_held >= _MOST_HELD and _may_use_springs(problem, following):
            return _begin_springs(problem, following, f"springs held the bodies in {_MOST_HELD} steps")
        return following

    def _damped_step(self, problem: ContactProblem, iterate: NewtonIterate) -> NewtonIterate:
        equations = self._equations(problem)
        response = respond(equations, iterate.residual, iterate.residual.sets)
        residuals = [equations.evaluate(iterate.state.blended(response.state, 0.5**halvings)) for halvings in range(9)]
        size, residual = min(((merit(problem, residual), residual) for residual in residuals), key=lambda pair: pair[0])
        following = replace(
            iterate,
            linear_solves=iterate.linear_solves + response.linear_solves,
            message="line search",
            n_in_phase=iterate.n_in_phase + 1,
        )
        if size > (1.0 - 1e-3) * iterate.merit:
            return self._next_phase(problem, following, Status.STALLED, "no Newton step reduces the residual")
        following = replace(following, state=residual.state, residual=residual, sets=residual.sets, merit=size)
        most = min(self.damped_steps, _COSTLY_DAMPED) if problem.body.is_costly else self.damped_steps
        if following.n_in_phase >= most:
            return self._next_phase(problem, following, Status.STALLED, "the line search takes too many steps")
        return following

    def _next_phase(
        self, problem: ContactProblem, iterate: NewtonIterate, status: Status, reason: str
    ) -> NewtonIterate:
        """Return the iterate at the start of the next phase that may help, or ended with `status` if none may."""
        from bemkit.solvers.homotopy import why_no_path

        hindrance = why_no_path(problem) if self.follows_path else ""
        # springs that have become weaker leave few nodes wrong, whose path is short even where responses are costly
        hindrance_if_short = why_no_path(problem, is_short=iterate.spring > 0.0)
        may_follow = self.follows_path and iterate.n_paths < _MOST_PATHS
        for phase in iterate.phase.fallbacks:
            if phase is Phase.DAMPED and self.damped_steps > 0:
                return _begin_line_search(replace(iterate, message=f"{reason}; line search begins"))
            if phase is Phase.SPRINGS and _may_use_springs(problem, iterate):
                return _begin_springs(problem, iterate, reason)
            is_hindered = hindrance_if_short if phase is Phase.SHORT_PATH else hindrance
            if phase not in (Phase.DAMPED, Phase.SPRINGS) and may_follow and not is_hindered:
                return replace(iterate, phase=phase, n_in_phase=0, message=f"{reason}; the path is followed next")
        return replace(iterate, ended=status, message="; ".join(filter(None, (reason, hindrance))))

    def _path_step(self, problem: ContactProblem, iterate: NewtonIterate) -> NewtonIterate:
        end = _path_from(problem, iterate.state, None if iterate.phase is Phase.PATH else iterate.sets)
        following = replace(iterate, linear_solves=iterate.linear_solves + end.linear_solves)
        if end.state is None:
            return self._next_phase(problem, following, Status.STALLED, end.reason)
        return self._after_path(problem, following, end.state, f"{PATH_MESSAGE} {end.n_pieces} pieces")

    def _weaker_friction_step(self, problem: ContactProblem, iterate: NewtonIterate) -> NewtonIterate:
        share = _FRICTION_DECREASE ** (iterate.n_in_phase + 1)
        weaker = replace(self._equations(problem), friction_share=share)
        residual, sets, linear_solves = _full_steps_under(weaker, problem.sticking_state)
        end = _path_from(problem, residual.state, sets)
        following = replace(
            iterate,
            linear_solves=iterate.linear_solves + linear_solves + end.linear_solves,
            n_in_phase=iterate.n_in_phase + 1,
            message=f"from {share:.2g} of the friction: {end.reason}",
        )
        if end.state is not None:
            words = f"{PATH_MESSAGE} {end.n_pieces} pieces from {share:.2g} of the friction"
            return self._after_path(problem, following, end.state, words)
        if following.n_in_phase >= _MOST_DECREASES:
            return self._next_phase(problem, following, Status.STALLED, end.reason)
        return following

    def _spring_step(self, problem: ContactProblem, iterate: NewtonIterate) -> NewtonIterate:
        equations = self._equations(problem)
        start = iterate if iterate.anchor is not None else self._iterate_at(problem, problem.sticking_state)
        anchor = problem.sticking_state if iterate.anchor is None else iterate.anchor
        linear = equations.linearised(start.residual, start.sets).regularised(anchor.displacement, iterate.spring)
        residual = equations.evaluate(problem.respond(linear))
        sets = equations.through_stick(residual, start.sets)
        following = replace(
            iterate,
            state=residual.state,
            linear_solves=iterate.linear_solves + 1,
            message=f"{SPRINGS_MESSAGE} {iterate.spring / problem.body.stiffness_scale:.1e}",
            residual=residual,
            sets=sets,
            merit=merit(problem, residual),
            n_in_phase=iterate.n_in_phase + 1,
            anchor=anchor,
        )
        if sets.n_changed(start.sets) <= problem.n_contact // 100:
            following = replace(following, spring=_SPRING_DECREASE * iterate.spring, anchor=residual.state)
            if following.spring < _LAST_SPRING * problem.body.stiffness_scale:
                kept = {name: getattr(following, name) for name in ("linear_solves", "n_paths", "message", "spring")}
                return replace(self._iterate_at(problem, residual.state), **kept)
        if following.n_in_phase >= _MOST_WITH_SPRINGS:
            return replace(following, ended=Status.STALLED, message="the active sets do not settle with springs either")
        return following

    def _after_path(
        self, problem: ContactProblem, iterate: NewtonIterate, state: ContactState, message: str
    ) -> NewtonIterate:
        """Return the iterate at the end of a path, from where full steps begin again."""
        kept = {name: getattr(iterate, name) for name in ("linear_solves", "n_held", "spring")}
        return replace(self._iterate_at(problem, state), n_paths=iterate.n_paths + 1, message=message, **kept)


def _may_use_springs(problem: ContactProblem, iterate: NewtonIterate) -> bool:
    """Tell whether springs had to hold many bodies in single steps, and the phase SPRINGS is still to come."""
    is_many = problem.body.rigid_motions().shape[0] > _MOTIONS_OF_ONE_BODY
    return is_many and iterate.n_held > 0 and iterate.spring == 0.0


def _begin_springs(problem: ContactProblem, iterate: NewtonIterate, reason: str) -> NewtonIterate:
    """Return the iterate at the start of the phase SPRINGS."""
    return replace(
        iterate,
        phase=Phase.SPRINGS,
        n_in_phase=0,
        spring=_FIRST_SPRING * problem.body.stiffness_scale,
        message=f"{reason}; springs hold the bodies from now on",
    )


def _few_pieces(problem: ContactProblem) -> int:
    return _COSTLY_PIECES if problem.body.is_costly else _SHORT_PIECES + problem.n_contact // 8


def _path_from(problem: ContactProblem, state: ContactState, sets: ActiveSets | None) -> "PathEnd":
    """Follow the path of solutions under the tangent of the law at a state; from given statuses a short way."""
    from bemkit.solvers.homotopy import AffineBound, follow_path

    most = None if sets is None else _few_pieces(problem)
    return follow_path(problem, AffineBound.tangent(problem, state.sigma_n), sets, max_pieces=most)


def _full_steps_under(equations: ProjectionEquations, start: ContactState) -> tuple[Residual, ActiveSets, int]:
    """Take full Newton steps until active sets come back; return residual, sets and the number of linear solves."""
    residual = equations.evaluate(start)
    sets, linear_solves, visited = residual.sets, 0, set[bytes]()
    while sets.key not in visited and len(visited) < _WEAKER_FULL:
        visited.add(sets.key)
        response = respond(equations, residual, sets)
        residual, linear_solves = equations.evaluate(response.state), linear_solves + response.linear_solves
        sets = equations.through_stick(residual, sets)
    return residual, sets, linear_solves


def _begin_line_search(iterate: NewtonIterate) -> NewtonIterate:
    """Return the iterate at the start of the phase DAMPED, where the residual was smallest."""
    size, residual = iterate.best
    return replace(
        iterate,
        state=residual.state,
        residual=residual,
        sets=residual.sets,
        merit=size,
        phase=Phase.DAMPED,
        n_in_phase=0,
    )
