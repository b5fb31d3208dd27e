"""Exact responses of bodies that the conditions at their contact nodes leave free to move."""

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.conditions import LinearConditions, separated, stick
from bemkit.contact.problem import ContactState, LinearBody, SingularResponse

_BALANCED = 1e-12
"""Imbalance, beyond what round-off may leave, below which nothing is left that could move a body. A certificate asks
for 1e-9, but a load of 1e-10 may still carry a body to an obstacle."""


@dataclass(frozen=True, eq=False)
class FloatingResponse:
    """Forces in balance without help from the obstacle, and a body that may be anywhere along its free motions.

    Parameters
    ----------
    state : ContactState
        One of its positions.
    free_motions : (n_free, n_contact, 2) array
        Rigid motions that change no condition.
    """

    state: ContactState
    free_motions: FloatArray

    def nearest(self, displacement: FloatArray) -> ContactState:
        """Return the position nearest to some displacements, by least squares over all contact nodes.

        Parameters
        ----------
        displacement : (n_contact, 2) array [m]

        Returns
        -------
        ContactState
        """
        motions = self.free_motions.reshape(len(self.free_motions), -1)
        way = (displacement - self.state.displacement).ravel()
        shift = np.linalg.lstsq(motions.T, way, rcond=None)[0] @ motions
        return ContactState(self.state.displacement + shift.reshape(-1, 2), self.state.traction)


def unheld_response(body: LinearBody) -> FloatingResponse | None:
    """Return the response without any contact, if the body floats and the load on it balances.

    Then no load pushes it anywhere, whatever round-off supports leave that carry it along.
    """
    return floating_response(body, separated(body.n_contact))


def floating_response(body: LinearBody, conditions: LinearConditions) -> FloatingResponse | None:
    """Return the response under conditions that leave rigid motions free, if the forces along these balance.

    Parameters
    ----------
    body : LinearBody
    conditions : LinearConditions

    Returns
    -------
    FloatingResponse or None
        None also if the conditions leave no motion free.

    Notes
    -----
    Where only tractions are prescribed, as many displacements are held as there are free motions: just enough to
    determine the response, so that their reactions are what is out of balance. If that is round-off, the prescribed
    tractions take their place. The result carries them to the last digit; weak springs would leave a little
    everywhere, which a condition such as "friction only where something presses" cannot tell from contact.
    """
    free = conditions.free_motions(body.rigid_motions())
    gives_traction = ~np.any(conditions.on_displacement != 0.0, axis=2)
    gives_traction[:, 1] &= ~body.tangent_is_free  # whose displacement cannot be held
    if not len(free) or np.count_nonzero(gives_traction) < len(free):
        return None
    pins = _determinate(free, gives_traction)
    held = conditions.replaced(pins, stick(np.zeros(body.n_contact), np.zeros(body.n_contact)))
    try:
        response = body.respond(held)
    except SingularResponse:
        return None
    traction = response.traction.copy()
    own = np.einsum("nii->ni", conditions.on_traction)
    other = np.stack([conditions.on_traction[:, 0, 1], conditions.on_traction[:, 1, 0]], axis=1)
    for row in (0, 1):  # the friction of a slipping node follows its pressure
        node = np.flatnonzero(pins[:, row])
        rest = conditions.value[node, row] - other[node, row] * traction[node, 1 - row]
        traction[node, row] = rest / own[node, row]
    state = ContactState(response.displacement, traction)
    return FloatingResponse(state, free) if body.imbalance(state).is_below(_BALANCED) else None


def _determinate(free: FloatArray, allowed: BoolArray) -> BoolArray:
    """Return (n_contact, 2) bool: as many of the allowed displacements as there are free motions, and independent."""
    from scipy.linalg import qr

    candidates = np.flatnonzero(allowed)
    _, order = qr(free.reshape(len(free), -1)[:, candidates], mode="r", pivoting=True)
    pins = np.zeros(allowed.shape, dtype=bool)
    pins.flat[candidates[order[: len(free)]]] = True
    return pins
