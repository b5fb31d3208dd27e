"""The contact problem: a body, a gap, a friction law."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, read_only
from bemkit.contact.body import ContactState, LinearBody, SingularResponse
from bemkit.contact.condensation.dense_body import DenseBody
from bemkit.contact.conditions import LinearConditions, separated, stick
from bemkit.contact.laws import FrictionLaw, LawError
from bemkit.contact.piecewise_law import law_name
from bemkit.errors import InputError

__all__ = ["ContactProblem", "ContactState", "DenseBody", "LawError", "LinearBody", "SingularResponse"]


@dataclass(frozen=True, eq=False)
class ContactProblem:
    """Find ``u_n <= g``, ``sigma_n <= 0``, ``sigma_n (u_n - g) = 0`` and friction by the law, for one loaded body.

    Parameters
    ----------
    body : LinearBody
    gap : (n_contact,) array [m]
        Distance to the obstacle along the normal; negative where body and obstacle overlap before the load acts,
        ``inf`` where the node can never touch.
    law : FrictionLaw
    reference_slip : (n_contact,) array [m], optional
        Slip is ``u_t - reference_slip``. Zero (the default) is the static law of the paper; the tangential
        displacement of the last load step gives the incremental law.

    Raises
    ------
    ValueError
        If a shape does not fit the body, or an entry is not a number.
    LawError
        If the law fails or returns bounds of another shape, negative or not finite.
    """

    body: LinearBody
    gap: FloatArray
    law: FrictionLaw
    reference_slip: FloatArray | None = None

    def __post_init__(self) -> None:
        _check_members(self.body, self.law)
        n_contact = self.body.n_contact
        slip = np.zeros(n_contact) if self.reference_slip is None else self.reference_slip
        for name, given in (("gap", self.gap), ("reference_slip", slip)):
            array = np.array(given, dtype=float)
            if array.shape != (n_contact,):
                raise InputError(f"{name} has the shape {array.shape}; the body has {n_contact} contact nodes")
            is_wrong = np.isnan(array) | (np.isneginf(array) if name == "gap" else np.isinf(array))
            if is_wrong.any():
                node = int(np.argmax(is_wrong))
                raise InputError(f"{name} is {array[node]} at contact node {node}; give a number")
            read_only(array)
            object.__setattr__(self, name, array)
        _ = self.cohesion  # a law that fails does so at once

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
        """Response with all nodes sticking and none overlapping: the cold start, and the measure of the load.

        Nodes are held at ``u_n = min(g, 0)`` and ``u_t = reference_slip``, or ``sigma_t = 0`` where the body has
        eliminated the tangent.
        """
        return self.respond(stick(np.minimum(self.gap, 0.0), self.slip_origin))

    @cached_property
    def of_body(self) -> dict[str, Any]:
        """What drivers have found out of the body and its load, to be kept under other laws; see `with_law`."""
        return {}

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return the response of the body; where it has eliminated the tangent, ``sigma_t = 0`` whatever is asked.

        Drivers ask this instead of the body itself, and need not know where there is no friction. Raises
        `SingularResponse` if the conditions do not determine the response.
        """
        return self.body.respond(self.without_eliminated(conditions))

    def without_eliminated(self, conditions: LinearConditions) -> LinearConditions:
        """Return the conditions with ``sigma_t = 0`` wherever the body has eliminated the tangent."""
        rows = self.body.tangent_is_eliminated
        if not rows.any():
            return conditions
        return conditions.replaced(np.stack([np.zeros_like(rows), rows], axis=1), separated(self.n_contact))

    def with_law(self, law: FrictionLaw) -> "ContactProblem":
        """Return the problem under another law."""
        other = replace(self, law=law)
        other.__dict__["of_body"] = self.of_body
        if "sticking_state" in self.__dict__:  # it does not depend on the law
            other.__dict__["sticking_state"] = self.sticking_state
        return other

    @cached_property
    def cohesion(self) -> FloatArray:
        """(n_contact,) array [Pa]: the friction bound without pressure."""
        return self.friction_bound(np.zeros(self.n_contact))

    def friction_bound(self, sigma_n: FloatArray, is_closed: BoolArray | None = None) -> FloatArray:
        """Return the bound of the tangential traction at every node.

        Parameters
        ----------
        sigma_n : (n_contact,) array [Pa]
            Normal tractions; tension is read as zero.
        is_closed : (n_contact,) bool array, optional
            Open nodes have the bound zero unless the law acts across the gap. All closed by default.

        Returns
        -------
        (n_contact,) array [Pa]

        Raises
        ------
        LawError
            If the law fails, or returns a wrong shape or negative or non-finite bounds.
        """
        bound = self._ask_law("bound", np.minimum(sigma_n, 0.0))
        if np.any(bound < 0.0):
            node = int(np.argmin(bound))
            raise LawError(
                f"friction law {law_name(self.law)}.bound is {bound[node]:g} at contact node {node} "
                f"(sigma_n = {sigma_n[node]:g}); a bound is zero or positive"
            )
        if np.any(bound[self.body.tangent_is_eliminated] > 0.0):
            node = int(np.flatnonzero(self.body.tangent_is_eliminated & (bound > 0.0))[0])
            raise LawError(
                f"friction law {law_name(self.law)} allows {bound[node]:g} at contact node {node}, where the body was "
                "condensed without friction: condense it again for this law"
            )
        return self._where_acting(bound, is_closed)

    def friction_slope(self, sigma_n: FloatArray, is_closed: BoolArray | None = None) -> FloatArray:
        """Return the derivative of the bound by the normal traction at every node; see `friction_bound`."""
        return self._where_acting(self._ask_law("bound_derivative", np.minimum(sigma_n, 0.0)), is_closed)

    def _where_acting(self, values: FloatArray, is_closed: BoolArray | None) -> FloatArray:
        if is_closed is None:
            return values
        return np.where(is_closed | np.asarray(self.law.acts_across_gap), values, 0.0)

    def _ask_law(self, method: str, sigma_n: FloatArray) -> FloatArray:
        try:
            values = np.asarray(getattr(self.law, method)(sigma_n), dtype=float)
        except Exception as error:  # whatever an own law raises must surface with the law's name
            raise LawError(f"{self._name(method)} failed: {type(error).__name__}: {error}") from error
        if values.shape != sigma_n.shape:
            shapes = f"the shape {values.shape} for {sigma_n.shape}"
            raise LawError(f"{self._name(method)} returned {shapes}; give one value a node")
        # A state that is not finite is the driver's to report; finite tractions must give finite bounds.
        if not np.isfinite(values).all() and np.isfinite(sigma_n).all():
            node = int(np.argmin(np.isfinite(values)))
            at = f"at contact node {node} (sigma_n = {sigma_n[node]:g})"
            raise LawError(f"{self._name(method)} is {values[node]} {at}")
        return values

    def _name(self, method: str) -> str:
        return f"friction law {law_name(self.law)}.{method}"


def _check_members(body: LinearBody, law: FrictionLaw) -> None:
    """Refuse a body or a law that lacks what drivers ask of it."""
    absent = [name for name in _BODY_MEMBERS if not hasattr(body, name)]
    if absent:
        raise InputError(
            f"body {type(body).__name__} has no {', '.join(absent)}; "
            "derive it from bemkit.contact.body.LinearBody and write weights, stiffness_scale and respond"
        )
    absent = [name for name in _LAW_MEMBERS if not hasattr(law, name)]
    if absent:
        raise LawError(
            f"friction law {law_name(law)} has no {', '.join(absent)}; "
            "derive it from bemkit.contact.laws.FrictionLaw and write bound and bound_derivative"
        )


_BODY_MEMBERS = (
    *("weights", "n_contact", "stiffness_scale", "accuracy", "is_costly", "tangent_is_eliminated"),
    *("respond", "rigid_motions", "rigid_load", "moving_bodies", "partners_of", "shares", "imbalance"),
)
_LAW_MEMBERS = ("bound", "bound_derivative", "is_frictionless", "acts_across_gap", "scaled")
