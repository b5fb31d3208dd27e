"""The contact problem: a body, a gap and a friction law."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, read_only
from bemkit.contact.body import ClosedVolume, ContactState, LinearBody, SingularResponse, separated, stick
from bemkit.contact.laws import FrictionLaw, LawError
from bemkit.errors import InputError
from bemkit.operators.boundary_equations import LinearConditions

Result = TypeVar("Result")

_RESTS = 1e-9
"""Largest slip relative to the largest displacement that is round-off of the frames of contact and support."""


@dataclass(frozen=True, eq=False)
class ContactProblem:
    """Find ``u_n <= g``, ``sigma_n <= 0``, ``sigma_n (u_n - g) = 0`` with friction for one loaded body.

    Parameters
    ----------
    body : LinearBody
    gap : (n_contact,) array [m]
        Distance to the obstacle along the normal; negative where body and obstacle overlap initially, ``inf`` where the
        node can never touch.
    law : FrictionLaw
    reference_slip : (n_contact,) array [m], optional
        Slip is ``u_t - reference_slip``. Zero, the default, gives the static law of the paper; the tangential
        displacement of the last load step gives the incremental law.

    Raises
    ------
    ValueError
        If a shape does not fit the body, or an entry is NaN.
    LawError
        If the law raises an error or returns bounds of another shape, negative or not finite.
    """

    body: LinearBody
    gap: FloatArray
    law: FrictionLaw
    reference_slip: FloatArray | None = None

    def __post_init__(self) -> None:
        _check_members(self.body, self.law)
        n_contact = self.body.n_contact
        slip = np.zeros(n_contact) if self.reference_slip is None else self.reference_slip
        for name, values in (("gap", self.gap), ("reference_slip", slip)):
            array = np.array(values, dtype=float)
            if array.shape != (n_contact,):
                raise InputError(f"{name} has the shape {array.shape}; the body has {n_contact} contact nodes")
            is_wrong = np.isnan(array) | (np.isneginf(array) if name == "gap" else np.isinf(array))
            if is_wrong.any():
                node = int(np.argmax(is_wrong))
                raise InputError(f"{name} is {array[node]} at contact node {node}; give a number")
            object.__setattr__(self, name, read_only(array))
        _ = self.cohesion  # call the law once, so that its errors surface here

    @property
    def n_contact(self) -> int:
        """Number of contact nodes."""
        return self.body.n_contact

    @property
    def slip_origin(self) -> FloatArray:
        """(n_contact,) array [m], the reference slip (zeros for the static law)."""
        return np.zeros(self.n_contact) if self.reference_slip is None else self.reference_slip

    @cached_property
    def sticking_state(self) -> ContactState:
        """Response with all nodes sticking and none overlapping: the cold start, and the scale of the load.

        Nodes are held at ``u_n = min(g, 0)`` and ``u_t = reference_slip``. Nodes whose tangent follows have
        ``sigma_t = 0``, as do frictionless nodes unless the body could then move. Springs hold an incompressible body
        that is in contact all around, because it cannot follow any displacement of its boundary.
        """
        return self.for_all_laws("sticking_state", self._sticking)

    def _sticking(self) -> ContactState:
        sticking = stick(np.minimum(self.gap, 0.0), self.slip_origin)
        none, pressed = np.zeros(self.n_contact), np.full(self.n_contact, -self.modulus)
        is_smooth = (self.friction_bound(none) == 0.0) & (self.friction_bound(pressed) == 0.0)
        if is_smooth.any():
            rows = np.stack([np.zeros_like(is_smooth), is_smooth], axis=1)
            with suppress(SingularResponse):
                return self.respond(sticking.replaced(rows, separated(self.n_contact)))
        return self.respond_with_room(sticking)

    @cached_property
    def modulus(self) -> float:
        """Nodal force per displacement of a typical node [Pa]: about E' of the material."""
        return self.body.stiffness_scale * float(np.median(self.body.weights))

    def for_all_laws(self, name: str, compute: Callable[[], Result]) -> Result:
        """Return a result that does not depend on the law; problems from `with_law` share it."""
        if name not in self._law_independent:
            self._law_independent[name] = compute()
        result: Result = self._law_independent[name]
        return result

    @cached_property
    def _law_independent(self) -> dict[str, Any]:
        return {}

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return the response of the body; conditions on tangents that follow are replaced by ``sigma_t = 0``.

        Solvers call this instead of `LinearBody.respond`, and need not know which tangents follow.

        Raises
        ------
        SingularResponse
            If the conditions do not determine the response.
        """
        return self.body.respond(self.possible(conditions))

    def respond_with_room(self, conditions: LinearConditions) -> ContactState:
        """Return the response, on springs if the conditions leave an incompressible body no room.

        The springs hold all displacements that conditions prescribe. If all nodes press on them, no displacements
        within these keep the volume.
        """
        try:
            return self.respond(conditions)
        except ClosedVolume:
            return self.respond(conditions.softened(self.body.stiffness_scale))

    def possible(self, conditions: LinearConditions) -> LinearConditions:
        """Return the conditions with ``sigma_t = 0`` in place of those on tangential displacements that follow."""
        rows = self.body.tangent_follows & conditions.on_displacement[:, 1].any(axis=1)
        if not rows.any():
            return conditions
        return conditions.replaced(np.stack([np.zeros_like(rows), rows], axis=1), separated(self.n_contact))

    def given_direction(self, state: ContactState) -> FloatArray:
        """Return the slip direction (n_contact,), +1, -1 or 0, of nodes whose tangent follows; 0 for other nodes."""
        slip = np.where(self.body.tangent_follows, state.u_t - self.slip_origin, 0.0)
        return np.where(np.abs(slip) > _RESTS * np.abs(state.displacement).max(), np.sign(slip), 0.0)

    def with_law(self, law: FrictionLaw) -> "ContactProblem":
        """Return the problem with another law; it keeps results that do not depend on the law."""
        other = replace(self, law=law)
        other.__dict__["_law_independent"] = self._law_independent
        return other

    @cached_property
    def cohesion(self) -> FloatArray:
        """(n_contact,) array [Pa]: friction bound at zero pressure."""
        return self.friction_bound(np.zeros(self.n_contact))

    def friction_bound(self, sigma_n: FloatArray, is_closed: BoolArray | None = None) -> FloatArray:
        """Return the bound of the tangential traction at each node.

        Parameters
        ----------
        sigma_n : (n_contact,) array [Pa]
            Normal tractions; tension counts as zero.
        is_closed : (n_contact,) bool array, optional
            Open nodes have the bound zero, unless the law acts across the gap. By default all nodes are closed.

        Returns
        -------
        (n_contact,) array [Pa]

        Raises
        ------
        LawError
            If the law raises an error, or returns a wrong shape or negative or non-finite bounds.
        """
        bound = self._ask_law("bound", np.minimum(sigma_n, 0.0))
        if np.any(bound < 0.0):
            node = int(np.argmin(bound))
            raise LawError(
                f"friction law {_name(self.law)}.bound is {bound[node]:g} at contact node {node} "
                f"(sigma_n = {sigma_n[node]:g}); a bound is zero or positive"
            )
        return self._where_acting(bound, is_closed)

    def friction_slope(self, sigma_n: FloatArray, is_closed: BoolArray | None = None) -> FloatArray:
        """Return the derivative of the bound with respect to the normal traction; see `friction_bound`."""
        return self._where_acting(self._ask_law("bound_derivative", np.minimum(sigma_n, 0.0)), is_closed)

    def _where_acting(self, values: FloatArray, is_closed: BoolArray | None) -> FloatArray:
        if is_closed is None:
            return values
        return np.where(is_closed | np.asarray(self.law.acts_across_gap), values, 0.0)

    def _ask_law(self, method: str, sigma_n: FloatArray) -> FloatArray:
        try:
            values = np.asarray(getattr(self.law, method)(sigma_n), dtype=float)
        except Exception as error:  # add the name of the law to any error
            raise LawError(f"{self._name(method)} failed: {type(error).__name__}: {error}") from error
        if values.shape != sigma_n.shape:
            shapes = f"the shape {values.shape} for {sigma_n.shape}"
            raise LawError(f"{self._name(method)} returned {shapes}; give one value for each node")
        # finite tractions must give finite bounds; the solver reports states that are not finite
        if not np.isfinite(values).all() and np.isfinite(sigma_n).all():
            node = int(np.argmin(np.isfinite(values)))
            at = f"at contact node {node} (sigma_n = {sigma_n[node]:g})"
            raise LawError(f"{self._name(method)} is {values[node]} {at}")
        return values

    def _name(self, method: str) -> str:
        return f"friction law {_name(self.law)}.{method}"


def _check_members(body: LinearBody, law: FrictionLaw) -> None:
    """Refuse a body or a law without the members that solvers use."""
    absent = [name for name in _BODY_MEMBERS if not hasattr(body, name)]
    if absent:
        raise InputError(
            f"body {type(body).__name__} has no {', '.join(absent)}; "
            "derive it from bemkit.contact.body.LinearBody and implement weights, stiffness_scale and respond"
        )
    absent = [name for name in _LAW_MEMBERS if not hasattr(law, name)]
    if absent:
        raise LawError(
            f"friction law {_name(law)} has no {', '.join(absent)}; "
            "derive it from bemkit.contact.laws.FrictionLaw and implement bound and bound_derivative"
        )


_BODY_MEMBERS = (
    *("weights", "n_contact", "stiffness_scale", "accuracy", "responses_are_expensive", "tangent_follows"),
    *("respond", "rigid_motions", "rigid_load", "moving_bodies", "partners_of", "lacks_room", "shares", "imbalance"),
)
_LAW_MEMBERS = ("bound", "bound_derivative", "is_frictionless", "acts_across_gap", "scaled")


def _name(law: FrictionLaw) -> str:
    from bemkit.contact.further_laws import law_name

    return law_name(law)
