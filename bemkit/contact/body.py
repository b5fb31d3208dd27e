"""The elastic body as contact sees it: the state of its contact nodes, how they have slipped, how it responds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.conditions import LinearConditions, RigidMotions, as_rows, largest_components, separated, stick
from bemkit.contact.equilibrium import Imbalance
from bemkit.errors import BemkitError, InputError


class SingularResponse(BemkitError, ArithmeticError):  # noqa: N818 - a response, not a mistake of the caller
    """The conditions at the contact nodes leave the body free to move, or contradict each other."""


@dataclass(frozen=True, eq=False)
class ContactState:
    """Displacements and tractions at the contact nodes, in (n, t) components.

    Parameters
    ----------
    displacement : (n_contact, 2) array [m]
    traction : (n_contact, 2) array [Pa]
        What the obstacle does to the body; pressed nodes have a negative normal component.

    Raises
    ------
    ValueError
        If the shapes are not ``(n_contact, 2)``.
    """

    displacement: FloatArray
    traction: FloatArray

    def __post_init__(self) -> None:
        for name in ("displacement", "traction"):
            array = getattr(self, name)
            if array.ndim != 2 or array.shape != (len(self.displacement), 2):
                raise InputError(f"{name} has the shape {array.shape}; give ({len(self.displacement)}, 2)")

    @property
    def u_n(self) -> FloatArray:
        """(n_contact,) array [m], normal displacement."""
        return self.displacement[:, 0]

    @property
    def u_t(self) -> FloatArray:
        """(n_contact,) array [m], tangential displacement."""
        return self.displacement[:, 1]

    @property
    def sigma_n(self) -> FloatArray:
        """(n_contact,) array [Pa], normal traction."""
        return self.traction[:, 0]

    @property
    def sigma_t(self) -> FloatArray:
        """(n_contact,) array [Pa], tangential traction."""
        return self.traction[:, 1]

    @property
    def is_finite(self) -> bool:
        """Whether all entries are finite numbers."""
        return bool(np.isfinite(self.displacement).all() and np.isfinite(self.traction).all())

    def blended(self, other: ContactState, fraction: float) -> ContactState:
        """Return the state the given fraction of the way to `other`.

        Two responses of one body blend into a response again, because the body is linear.

        Parameters
        ----------
        other : ContactState
        fraction : float
            Zero gives this state, one gives `other`.
        """
        if fraction == 1.0:
            return other
        return ContactState(
            self.displacement + fraction * (other.displacement - self.displacement),
            self.traction + fraction * (other.traction - self.traction),
        )


@dataclass(frozen=True, eq=False)
class SlipHistory:
    """Time and slip at the end of an increment, in the units of the user.

    Parameters
    ----------
    time, time_step : float [s]
        Time at the end of the increment, and its duration.
    slip : (n_contact,) array [m]
        Length of the path that each node has slipped while it was closed, this increment included; never falls.
    last_slip : (n_contact,) array [m]
        Its part in this increment, not negative.
    """

    time: float
    time_step: float
    slip: FloatArray
    last_slip: FloatArray

    @classmethod
    def at_rest(cls, n_contact: int) -> SlipHistory:
        """Return the history before any load: time zero and no slip."""
        return cls(0.0, 0.0, np.zeros(n_contact), np.zeros(n_contact))

    @property
    def rate(self) -> FloatArray:
        """(n_contact,) array [m/s]: the speed of slip in this increment."""
        return self.last_slip / self.time_step if self.time_step > 0.0 else np.zeros_like(self.last_slip)

    def followed(self, time: float, slip: FloatArray, is_closed: BoolArray) -> SlipHistory:
        """Return the history after one more increment.

        Parameters
        ----------
        time : float [s]
            At the end of that increment.
        slip : (n_contact,) array [m]
            Slip of each node in it, of either sign; that of open nodes does not count.
        is_closed : (n_contact,) bool array
        """
        added = np.where(is_closed, np.abs(slip), 0.0)
        return SlipHistory(time, time - self.time, self.slip + added, added)

    def of(self, nodes: IntArray) -> SlipHistory:
        """Return the history of some of the nodes."""
        return SlipHistory(self.time, self.time_step, self.slip[nodes], self.last_slip[nodes])


class LinearBody(Protocol):
    """One or several elastic bodies under their loads, reduced to the contact nodes.

    All nonlinear code in bemkit sees bodies only through this protocol: a body never learns of friction, solvers
    never learn how it finds its response. Derive from this class and write `weights`, `stiffness_scale` and `respond`;
    a body that only contact can hold also writes `rigid_motions` and `rigid_load`. `bemkit.testing.check_body` tests
    everything said here.

    Attributes
    ----------
    weights : (n_contact,) array [m]
        Positive: nodal force = weight times traction.
    accuracy : float
        Relative error of the displacements and tractions of a response: 1e-14 (the default) for a direct solver, the
        tolerance at which it stops for an iterative one. Solvers take their tolerances from it.
    responses_are_expensive : bool
        Whether solvers should ask for tens of responses at most, rather than for several per contact node. False by
        default.
    """

    weights: FloatArray
    accuracy: float = 1e-14
    responses_are_expensive: bool = False

    @property
    def n_contact(self) -> int:
        """Number of contact nodes."""
        return len(self.weights)

    @property
    def stiffness_scale(self) -> float:
        """Typical traction per displacement of a single contact node [Pa/m], positive; the unit of automatic rho.

        For a material of plane modulus E' this is E' divided by the weight of a node, however the body is held.
        """
        ...

    @property
    def tangent_follows(self) -> BoolArray:
        """(n_contact,) bool array: nodes whose tangential displacement follows from normal ones; none by default.

        A support or two obstacles hold them, so that their tangential condition is one on tractions.
        `ContactProblem.respond` replaces others.
        """
        return np.zeros(self.n_contact, bool)

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return displacement and traction of the loaded body under two conditions per contact node.

        Parameters
        ----------
        conditions : LinearConditions
            At nodes whose tangent follows the second one is on tractions.

        Raises
        ------
        SingularResponse
            If the conditions do not determine the response.
        InputError
            If there is another tangential condition where the tangent follows.
        """
        ...

    def rigid_motions(self) -> RigidMotions:
        """Return the motions of the body that only contact can hold; by default there are none.

        Returns
        -------
        (n_motions, n_contact, 2) array, or sparse (n_motions, 2 n_contact) array
            Normal and tangential components at the contact nodes; linearly independent. Sparse, with index
            ``2 node + component``, if the body has many members, each with motions of its own.
        """
        return np.zeros((0, self.n_contact, 2))

    def rigid_load(self) -> FloatArray:
        """Return the work of the given load on each of these motions.

        Returns
        -------
        (n_motions,) array [N]
            Per unit of thickness and of motion.
        """
        return np.zeros(self.rigid_motions().shape[0])

    def moving_bodies(self, coefficients: FloatArray) -> str:
        """Name the bodies that a combination (n_motions,) of the rigid motions moves; messages go on with "moves"."""
        return "the body"

    def partners_of(self, coefficients: FloatArray) -> str:
        """Name what these bodies may touch; messages put "along" before it."""
        return "the obstacle"

    def shares(self, forces: FloatArray) -> FloatArray:
        """Return the share of the largest force that scales each node in the certificate; by default 1.

        With several bodies the scale of a node is the contact force of its own partners, not of all bodies.

        Parameters
        ----------
        forces : (n_contact,) array [N/m]
            Sizes of the nodal forces, some of them positive.

        Returns
        -------
        (n_contact,) array [-]
            Positive, at most one.
        """
        return np.ones(self.n_contact)

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return how far all forces on the body, those inside it included, are from equilibrium.

        Parameters
        ----------
        state : ContactState
            Of any origin: a state that is no response of this body is out of balance.

        Returns
        -------
        Imbalance
            Relative to the forces on the body, moments also to its size. By default `force` is the largest nodal force
            that is missing to hold the displacements of the state, which takes a response, and `moment` the work of
            load and tractions on the rigid motions, whose largest component is one; both relative to the largest nodal
            force of the state and of that response.
        """
        follows = self.tangent_follows
        held = np.stack([np.ones_like(follows), ~follows], axis=1)
        given = separated(self.n_contact)
        given.value[follows, 1] = state.sigma_t[follows]
        conditions = given.replaced(held, stick(state.u_n, state.u_t))
        response = self.respond(conditions)
        forces = self.weights[:, None] * np.stack([state.traction, response.traction])
        largest = float(np.abs(forces).max())
        if largest == 0.0:
            return Imbalance(0.0, 0.0)
        # displacements that the response does not reach count as the tractions that would cause them
        misfit = self.stiffness_scale * np.abs(response.displacement - state.displacement).max(axis=1)
        missing = max(float(np.abs(forces[0] - forces[1]).max()), float((self.weights * misfit).max()))
        motions = as_rows(self.rigid_motions())
        size = float(largest_components(motions).max(initial=0.0)) or 1.0
        work = float(np.max(np.abs(self.rigid_load() + motions @ forces[0].ravel()) / size, initial=0.0))
        # an error of the displacements causes tractions, too
        by_displacement = self.stiffness_scale * float((self.weights[:, None] * np.abs(state.displacement)).max())
        round_off = self.accuracy * max(largest, by_displacement) / largest
        return Imbalance(missing / largest, work / largest, round_off)
