"""One elastic body among several, and the factors that all copies of one shape share."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from bemkit.arrays import FloatArray, IntArray, read_only
from bemkit.errors import InputError

_MOTIONS_ARE_FREE = 1e-6
"""Largest forces of free rigid motions, relative to the largest entry of the stiffness: errors of quadrature are
smaller, forces of supports larger."""
_LARGEST_CONDITION = 1e13
"""Condition number of a held stiffness that counts as singular."""


@dataclass(frozen=True, eq=False)
class Member:
    """One elastic body among several, condensed to the displacement components of its contact sides.

    Parameters
    ----------
    stiffness : (n, n) array [Pa]
        In weak form: ``force = stiffness @ u - load``. Copies of one shape share one array object, and so share what is
        factored of it. A turned copy has its components in the axes of the original.
    load : (n,) array [N/m]
    motions : (k, n) array [-]
        Rigid motions that no support of the member resists, linearly independent; k = 0 ... 3.
    modulus : float [Pa]
        E' of the material.
    name : str, optional
        For messages.
    n_pressures : int
        Number of pressures, the last components, that belong to the volume of an incompressible body; see
        `bemkit.operators.steklov_poincare.CondensedMap`. No contact concerns them.
    bulk_modulus : float [Pa]
        Pressure by unit of dilatation; zero if the body keeps its volume.

    Raises
    ------
    InputError
        If shapes do not fit, entries are not finite, the modulus is not positive, or if the stiffness resists a motion.
    """

    stiffness: FloatArray
    load: FloatArray
    motions: FloatArray
    modulus: float
    name: str = ""
    n_pressures: int = 0
    bulk_modulus: float = 0.0

    def __post_init__(self) -> None:
        n = len(self.load)
        for word, shape in (("stiffness", (n, n)), ("load", (n,)), ("motions", (len(self.motions), n))):
            array = getattr(self, word)
            if np.shape(array) != shape:
                raise InputError(f"{self.title}: {word} has the shape {np.shape(array)}; {n} components need {shape}")
            if not np.isfinite(array).all():
                raise InputError(f"{self.title}: {word} contains {array[~np.isfinite(array)][0]}; give finite numbers")
        if len(self.motions) > 3:
            raise InputError(f"{self.title}: motions holds {len(self.motions)} motions; a plane body has three at most")
        if not (math.isfinite(self.modulus) and self.modulus > 0.0):
            raise InputError(f"{self.title}: modulus = {self.modulus:g}; give the E' of the material")

    @property
    def n_components(self) -> int:
        """Number of displacement components."""
        return len(self.load)

    @property
    def title(self) -> str:
        """Name in messages."""
        return f"body {self.name!r}" if self.name else "a body without a name"


@dataclass(frozen=True, eq=False)
class Shape:
    """Rigid motions and flexibility that all copies of one member share.

    Parameters
    ----------
    member : Member
        One of the copies.
    numbers : tuple of int
        Which of the members are copies.
    rows : (n_copies, n) array
        Numbers of their components among those of all members; none of bodies that touch nothing.
    """

    member: Member
    numbers: tuple[int, ...]
    rows: IntArray

    @cached_property
    def motions(self) -> FloatArray:
        """(n, k) array: the rigid motions as orthonormal columns.

        Raises
        ------
        InputError
            If the motions are linearly dependent, or the stiffness resists them.
        """
        basis, sizes, _ = np.linalg.svd(self.member.motions.T, full_matrices=False)
        if sizes.size and sizes[-1] < 1e-9 * sizes[0]:
            raise InputError(f"{self.member.title}: motions are linearly dependent; remove those that are combinations")
        stiffness = self.member.stiffness
        if np.abs(stiffness @ basis).max(initial=0.0) > _MOTIONS_ARE_FREE * np.abs(stiffness).max(initial=0.0):
            raise InputError(f"{self.member.title}: the stiffness resists the rigid motions: check them, or supports")
        return np.asarray(basis)

    @cached_property
    def flexibility(self) -> FloatArray:
        """(n, n) array [1/Pa]: inverse of the stiffness, with springs on the rigid motions.

        Forces in equilibrium put nothing on the springs, so that these change no deformation.

        Raises
        ------
        InputError
            If the stiffness leaves further motions free.
        """
        stiffness, motions = self.member.stiffness, self.motions
        if not self.member.n_components:
            return stiffness
        spring = float(np.trace(stiffness)) / len(stiffness) or self.member.modulus
        held = stiffness + spring * motions @ motions.T
        try:
            flexibility = np.linalg.inv(held)
        except np.linalg.LinAlgError:
            flexibility = np.full_like(held, np.inf)
        condition = float(np.abs(held).sum(axis=1).max() * np.abs(flexibility).sum(axis=1).max())
        if not condition < _LARGEST_CONDITION:
            raise InputError(
                f"{self.member.title}: its stiffness leaves it free to move in more ways than its "
                f"{motions.shape[1]} rigid motions (condition number {condition:.1e}): give all of them in motions"
            )
        is_symmetric = np.array_equal(stiffness, stiffness.T)
        flexibility = 0.5 * (flexibility + flexibility.T) if is_symmetric else flexibility
        return read_only(np.asarray(flexibility))

    @cached_property
    def column_sizes(self) -> FloatArray:
        """(n,) array [Pa]: sum of the sizes of all forces that a unit displacement of each component causes."""
        return np.asarray(np.abs(self.member.stiffness).sum(axis=0))


def shapes_of(members: Sequence[Member]) -> tuple[Shape, ...]:
    """Return the different shapes of members, each with its copies."""
    first = np.cumsum([0, *(member.n_components for member in members)])
    copies: dict[tuple[int, int], list[int]] = {}
    for number, member in enumerate(members):
        copies.setdefault((id(member.stiffness), id(member.motions)), []).append(number)
    return tuple(
        Shape(
            members[numbers[0]], tuple(numbers), first[numbers][:, None] + np.arange(members[numbers[0]].n_components)
        )
        for numbers in copies.values()
    )


def blocks_of_members(shapes: Sequence[Shape], block: Callable[[Shape], FloatArray]) -> sparse.csr_array:
    """Return the sparse matrix with the block of its shape for each member along the diagonal."""
    of_member = {number: array for shape in shapes for array in [block(shape)] for number in shape.numbers}
    return diagonal_blocks(of_member[number] for number in sorted(of_member))


def deformation(shapes: Sequence[Shape], forces: FloatArray) -> FloatArray:
    """Return the displacements (n, ...) of all members under forces (n, ...), with springs on the rigid motions."""
    displacement = np.empty_like(forces)
    for shape in shapes:
        on_copies = forces[shape.rows]
        if forces.ndim == 1:
            displacement[shape.rows] = on_copies @ shape.flexibility.T
        else:
            displacement[shape.rows] = shape.flexibility @ on_copies
    return displacement


def diagonal_blocks(blocks: Iterable[FloatArray | sparse.csr_array]) -> sparse.csr_array:
    """Return a sparse array with blocks (m, n) of any shapes along its diagonal, zero elsewhere."""
    return sparse.csr_array(sparse.block_diag([sparse.coo_array(block) for block in blocks], format="csr"))
