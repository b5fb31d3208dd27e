"""A body given by its dense stiffness matrix."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray, read_only
from bemkit.contact.body import ContactState, SingularResponse
from bemkit.contact.conditions import LinearConditions

_SMALLEST_RCOND = 1e-13
"""Below this reciprocal condition number of a row-scaled system its matrix counts as singular. A condensed stiffness
of a floating body leaves 1e-15 of its free motions; drivers that are refused without need only take a detour."""

FORGIVEN = 3e-6
"""Share of the forces up to which an imbalance may be put down to round-off; beyond, too few digits are left."""

_FREE_MOTION = 1e-9
"""A rigid motion that changes no condition by more than this (of unit motion) is not held by them. Boundary element
stiffnesses leave about 1e-11 on rigid motions; one held node out of a million gives 1e-3."""


@dataclass(frozen=True, eq=False)
class DenseBody:
    """Body with ``weights * t = stiffness @ u - load`` at its contact nodes; see `LinearBody`.

    Parameters
    ----------
    stiffness : (2 n_contact, 2 n_contact) array [Pa]
        Condensed stiffness, index ``2 node + component`` with component 0 = normal, 1 = tangential. It need not be
        symmetric.
    load : (2 n_contact,) array [N/m]
        Condensed load: the nodal forces that would act on the contact nodes of the clamped body, reversed.
    weights : (n_contact,) array [m]
        Length that belongs to each node.
    motions : (n_motions, n_contact, 2) array, optional
        Rigid motions that only contact holds; none by default.

    Raises
    ------
    ValueError
        If shapes do not fit or entries are not finite, or a weight is not positive.
    """

    stiffness: FloatArray
    load: FloatArray
    weights: FloatArray
    motions: FloatArray | None = None

    def __post_init__(self) -> None:
        n_contact = len(self.weights)
        motions = np.zeros((0, n_contact, 2)) if self.motions is None else self.motions
        shapes = {
            "weights": (n_contact,),
            "stiffness": (2 * n_contact, 2 * n_contact),
            "load": (2 * n_contact,),
            "motions": (len(motions), n_contact, 2),
        }
        for name, shape in shapes.items():
            array = np.array(motions if name == "motions" else getattr(self, name), dtype=float)
            if array.shape != shape:
                raise ValueError(f"{name} has the shape {array.shape}; {n_contact} contact nodes need {shape}")
            if not np.isfinite(array).all():
                raise ValueError(f"{name} contains {array[~np.isfinite(array)][0]}; give finite numbers")
            read_only(array)
            object.__setattr__(self, name, array)
        if n_contact == 0:
            raise ValueError("weights is empty; a body needs at least one contact node")
        if self.weights.min() <= 0.0:
            raise ValueError(f"weights has the entry {self.weights.min():g}; the length of a node is positive")

    @property
    def n_contact(self) -> int:
        """Number of contact nodes."""
        return len(self.weights)

    @cached_property
    def stiffness_scale(self) -> float:
        """Median of the diagonal normal stiffnesses per weight [Pa/m]."""
        diagonal = np.diagonal(self.stiffness)[0::2] / self.weights
        is_stiff = diagonal > 0.0
        if np.any(is_stiff):
            return float(np.median(diagonal[is_stiff]))
        largest = float(np.abs(self._traction_of_displacement).max())
        return largest if largest > 0.0 else 1.0

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return the response; one LU factorisation of a ``2 n_contact`` system, none if all displacements are given.

        Notes
        -----
        Prescribed displacements, zero tractions and slip tractions are met exactly, not just to round-off, so that
        ties such as ``|sigma_t| = s |sigma_n|`` are decided alike in all units.
        """
        own = [0, 1]
        acts_on_displacement = np.any(conditions.on_displacement != 0.0, axis=2)
        acts_on_traction = np.any(conditions.on_traction != 0.0, axis=2)
        couples = np.any(conditions.on_displacement[:, own, [1, 0]] != 0.0, axis=1)
        gives_displacement = acts_on_displacement & ~acts_on_traction & ~couples[:, None]
        gives_traction = acts_on_traction & ~acts_on_displacement

        displacement = np.zeros_like(conditions.value) if gives_displacement.all() else self._displacement(conditions)
        given = conditions.on_displacement[:, own, own]
        np.divide(conditions.value, given, out=displacement, where=gives_displacement)

        traction = (self._traction_of_displacement @ displacement.ravel()) - self._free_traction
        for row in own:
            rest = conditions.value[:, row] - conditions.on_traction[:, row, 1 - row] * traction[:, 1 - row]
            factor = conditions.on_traction[:, row, row]
            np.divide(rest, factor, out=traction[:, row], where=gives_traction[:, row] & (factor != 0.0))
        return ContactState(displacement, traction)

    def rigid_motions(self) -> FloatArray:
        """Return the motions given to the constructor."""
        return np.zeros((0, self.n_contact, 2)) if self.motions is None else self.motions

    def rigid_load(self) -> FloatArray:
        """Return the work of the load on these motions."""
        return self.rigid_motions().reshape(-1, 2 * self.n_contact) @ self.load

    def imbalance(self, state: ContactState) -> tuple[float, float]:
        """Return the largest nodal force out of balance, and the work of load and tractions on rigid motions.

        Notes
        -----
        The first number is the residual of ``weights * t = stiffness @ u - load``, so it also detects states that are
        no response of this body. It is relative to the largest nodal force (term of the sums), the second one to the
        largest load or contact force, beyond their round-off.
        """
        forces = (self.weights[:, None] * state.traction).ravel()
        terms = self.stiffness * state.displacement.ravel()
        largest = max(np.abs(forces).max(), np.abs(self.load).max(), np.abs(terms).max())
        if largest == 0.0:
            return 0.0, 0.0
        residual = np.abs(terms.sum(axis=1) - self.load - forces).max() / largest
        motions = self.rigid_motions().reshape(-1, 2 * self.n_contact)
        if not len(motions):
            return float(residual), 0.0
        # Not relative to the stiffness terms: a body on its way to infinity would balance any load by comparison.
        given = max(np.abs(forces).max(), np.abs(self.load).max()) or largest
        defect = self._motion_defect @ np.abs(state.displacement.ravel())
        round_off = min(defect + np.finfo(float).eps * np.abs(terms).sum(), FORGIVEN * given)
        work = np.abs(motions @ (self.load + forces)).max() / np.abs(motions).max()
        return float(residual), max(float(work - round_off), 0.0) / float(given)

    @cached_property
    def _motion_defect(self) -> FloatArray:
        """(2 n_contact,) array [Pa]: what round-off of the stiffness adds to the balance of forces."""
        motions = self.rigid_motions().reshape(-1, 2 * self.n_contact)
        return np.asarray(np.abs(motions @ self.stiffness).max(axis=0) / np.abs(motions).max())

    @cached_property
    def _traction_of_displacement(self) -> FloatArray:
        """(n_contact, 2, 2 n_contact) array [Pa/m]."""
        rows = self.stiffness.reshape(self.n_contact, 2, 2 * self.n_contact)
        return rows / self.weights[:, None, None]

    @cached_property
    def _free_traction(self) -> FloatArray:
        """(n_contact, 2) array [Pa], load per weight."""
        return self.load.reshape(-1, 2) / self.weights[:, None]

    @cached_property
    def _orthonormal_motions(self) -> FloatArray:
        """(2 n_contact, n_motions) array."""
        return np.asarray(np.linalg.qr(self.rigid_motions().reshape(-1, 2 * self.n_contact).T)[0])

    def _displacement(self, conditions: LinearConditions) -> FloatArray:
        """Solve ``(A_u + A_t T) u = c + A_t t_free`` with every row scaled to one."""
        n_contact = self.n_contact
        matrix = np.matmul(conditions.on_traction, self._traction_of_displacement)
        node = np.arange(n_contact)
        matrix.reshape(n_contact, 2, n_contact, 2)[node, :, node, :] += conditions.on_displacement
        matrix = matrix.reshape(2 * n_contact, 2 * n_contact)
        right_side = conditions.value + np.matmul(conditions.on_traction, self._free_traction[:, :, None])[:, :, 0]

        row_size = np.abs(matrix).max(axis=1)
        if not row_size.all():
            raise SingularResponse("a condition at a contact node involves neither displacement nor stiffness")
        matrix /= row_size[:, None]
        self._check_motions_are_held(matrix)
        right_sides = np.stack([right_side.ravel() / row_size, self._probe], axis=1)
        try:
            solution, probed = np.linalg.solve(matrix, right_sides).T
        except np.linalg.LinAlgError as error:
            raise SingularResponse("the contact conditions do not hold the body (a pivot is zero)") from error
        # One more right-hand side is a cheap estimate of the inverse. (LAPACK's own estimate is only in scipy, whose
        # BLAS threads and numpy's get in each other's way: factors of 10 to 100 in time for systems of this size.)
        rcond = 1.0 / (float(np.abs(matrix).sum(axis=1).max()) * float(np.abs(probed).max()))
        if rcond < _SMALLEST_RCOND:
            raise SingularResponse(f"the contact conditions do not hold the body (reciprocal condition {rcond:.1e})")
        return np.ascontiguousarray(solution).reshape(n_contact, 2)

    @cached_property
    def _probe(self) -> FloatArray:
        """(2 n_contact,) array around one: not orthogonal to rigid motions, and without any pattern."""
        multiples = np.arange(1, 2 * self.n_contact + 1) * 0.6180339887498949
        return np.asarray(0.5 + np.modf(multiples)[0])

    def _check_motions_are_held(self, matrix: FloatArray) -> None:
        if not self.rigid_motions().size:
            return
        held = float(np.linalg.svd(matrix @ self._orthonormal_motions, compute_uv=False)[-1])
        if held < _FREE_MOTION:
            raise SingularResponse(f"the contact conditions leave a rigid motion free (held by {held:.1e})")
