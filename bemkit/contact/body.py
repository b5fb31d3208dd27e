"""The elastic body as contact sees it."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.conditions import LinearConditions
from bemkit.errors import BemkitError, InputError
from bemkit.operators.equilibrium import Imbalance


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

    def blended(self, other: "ContactState", fraction: float) -> "ContactState":
        """Return the state the given fraction of the way to `other`.

        Two responses of one body blend into a response again, because the body is linear.

        Parameters
        ----------
        other : ContactState
        fraction : float
            Zero gives this state, one gives `other`.

        Returns
        -------
        ContactState
        """
        if fraction == 1.0:
            return other
        return ContactState(
            self.displacement + fraction * (other.displacement - self.displacement),
            self.traction + fraction * (other.traction - self.traction),
        )


class LinearBody(Protocol):
    """One or several elastic bodies under their loads, reduced to the contact nodes.

    Everything nonlinear in bemkit sees bodies through this protocol alone. A body never learns of friction; drivers
    never learn how the body finds its response.
    """

    @property
    def n_contact(self) -> int:
        """Number of contact nodes."""
        ...

    @property
    def weights(self) -> FloatArray:
        """(n_contact,) array [m], positive: nodal force = weight times traction."""
        ...

    @property
    def stiffness_scale(self) -> float:
        """Typical traction per displacement of a single contact node [Pa/m], positive; the unit of automatic rho.

        It comes from what the body is, E' per weight of a node: of a body on as few nodes as it has free motions
        nothing else is left.
        """
        ...

    @property
    def tangent_is_free(self) -> BoolArray:
        """(n_contact,) bool array: nodes without friction, whose tangential motion the body has eliminated.

        The only tangential condition there is ``sigma_t = 0``; `ContactProblem.respond` sees to it.
        """
        ...

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return displacement and traction of the loaded body under two conditions per contact node.

        Parameters
        ----------
        conditions : LinearConditions
            At nodes whose tangent is free the second one is ``sigma_t = 0``.

        Returns
        -------
        ContactState

        Raises
        ------
        SingularResponse
            If the conditions do not determine the response.
        ValueError
            If there is another tangential condition where the tangent is free.
        """
        ...

    def rigid_motions(self) -> FloatArray:
        """Return the motions of the body that only contact can hold.

        Returns
        -------
        (n_motions, n_contact, 2) array
            Normal and tangential components at the contact nodes; linearly independent.
        """
        ...

    def rigid_load(self) -> FloatArray:
        """Return the work of the given load on each of these motions.

        Returns
        -------
        (n_motions,) array [N]
            Per unit of thickness and of motion.
        """
        ...

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return how far load and contact tractions are from equilibrium.

        Parameters
        ----------
        state : ContactState

        Returns
        -------
        Imbalance
            Relative to the largest force (times the size of the body) at hand.
        """
        ...
