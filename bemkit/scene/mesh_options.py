"""How the boundary of a scene is divided into elements, and whether a body is too thin for them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.discretise import Grading, Uniform
from bemkit.result_warning import ResultWarning

DEFAULT_ELEMENTS = 320
"""Default number of elements."""
FIRST_ELEMENTS = 40
"""Approximate number of elements of the first mesh for an accuracy."""
SMALLEST_ACCURACY = 1e-10
"""Smallest accuracy that round-off allows."""
MOST_ELEMENTS = 1500
"""Default of the largest number of elements for an accuracy."""
_LONGEST = 0.75
"""Length of elements, in thicknesses, at which the energy of a pinched ring has an error of 2 per cent, which grows
with the third power of the length."""
_SHARE = 0.25
"""Share of the boundary that must be thin for a warning: more than the tip of a wedge or the strip beside a hole."""
_FACING = -0.5
_ROWS, _FEW = 4096, 1024
"""Number of elements whose neighbours are searched at a time. For few elements all distances take less time than
loading a tree (measured)."""


@dataclass(frozen=True)
class MeshOptions:
    """How the boundary is divided: into a number of elements, or until an accuracy is reached.

    Parameters
    ----------
    elements : int, optional
        Number of boundary elements in total; 320 if neither this nor an accuracy is given. Of a scene with a symmetry
        these are the elements of the whole body, of which a half or a quarter carries unknowns.
    grading : Grading
        Distribution along each piece between corners and ends of parts.
    density : mapping of str to float
        How densely sides are divided compared with the others, by the name of the side; by default 1.
    accuracy : float, optional
        Wanted error relative to the solution, instead of a number of elements, at least 1e-10: in the energy norm, and
        of degree 3 and more (or rising) of contact tractions in L2, too, on half-planes of all tractions in the mean
        and, down to 1e-3, element by element (`Solution.estimated_local_traction_error`).
        Meshes then follow the solution: see `bemkit.runs.adaptive.run_adaptive`.
    most_elements : int, optional
        Largest number of elements of a mesh on the way to the accuracy, except the first; default 1500. Elements of
        high degree count as the quadratic ones with as many nodes. Of a scene with a symmetry only elements with
        unknowns count.
    most_seconds : float, optional [s]
        Time for all meshes: no mesh is begun that would exceed it. No limit by default.
    rising_degrees : bool
        Whether the degree of Galerkin elements rises from mesh to mesh, from 2 on, until the accuracy is reached
        (hp-adaptivity); the scene of a result has the degrees of its mesh. In scene files ``discretisation = "hp"``.

    Raises
    ------
    ValueError
        If a number is out of range, or one is given that does not go with the others.
    """

    elements: int | None = None
    grading: Grading = field(default_factory=Uniform)
    density: Mapping[str, float] = field(default_factory=dict)
    accuracy: float | None = None
    most_elements: int | None = None
    most_seconds: float | None = None
    rising_degrees: bool = False

    def __post_init__(self) -> None:
        if self.accuracy is None:
            self._check_without_accuracy()
            return
        if self.elements is not None:
            raise InputError(
                f"elements is {self.elements} and accuracy is {self.accuracy}: give one of them, the other follows"
            )
        if self.grading != Uniform() or self.density:
            raise InputError(f"accuracy is {self.accuracy}: remove grading and density, they follow the solution")
        if not 0.0 < self.accuracy < 1.0:
            raise InputError(f"accuracy is {self.accuracy}: give a relative error between 0 and 1, such as 1e-3")
        if self.accuracy < SMALLEST_ACCURACY:
            raise InputError(
                f"accuracy is {self.accuracy}: round-off leaves about ten digits of a solution: give at least "
                f"{SMALLEST_ACCURACY:g}"
            )
        if self.most_elements is not None and not FIRST_ELEMENTS <= self.most_elements <= 1_000_000:
            raise InputError(f"most_elements is {self.most_elements}: give a number from {FIRST_ELEMENTS} to 1000000")
        if self.most_seconds is not None and not self.most_seconds > 0.0:
            raise InputError(f"most_seconds is {self.most_seconds}: give a positive time")

    def _check_without_accuracy(self) -> None:
        if self.rising_degrees:
            raise InputError(
                "rising_degrees is True (discretisation 'hp'): degrees rise until an accuracy is reached: give "
                "mesh.accuracy, such as 1e-6, or a fixed degree"
            )
        for name in ("most_elements", "most_seconds"):
            if getattr(self, name) is not None:
                raise InputError(f"{name} is {getattr(self, name)}: it limits an accuracy, which is not given")
        if self.elements is None:
            object.__setattr__(self, "elements", DEFAULT_ELEMENTS)
        elif not 3 <= self.elements <= 1_000_000:
            raise InputError(f"elements is {self.elements}: give a number from 3 to 1000000")

    @property
    def n_elements(self) -> int:
        """Number of elements to begin with: `elements`, or those of the first mesh if the accuracy decides."""
        return FIRST_ELEMENTS if self.elements is None else self.elements


@lru_cache(maxsize=4)  # the plan and the choice of a linear solver ask for it, and it takes a while on large meshes
def thinness_warnings(mesh: BoundaryMesh, method: str) -> tuple[ResultWarning, ...]:
    """Warn if elements of a method such as collocation are too long for the thickness of the body."""
    if mesh.is_exterior:
        return ()
    longest = mesh.lengths / thicknesses(mesh, mesh.lengths / _LONGEST)
    is_thin = longest > _LONGEST
    if mesh.lengths[is_thin].sum() <= _SHARE * mesh.lengths.sum():
        return ()
    factor = float(np.median(longest[is_thin])) / _LONGEST
    text = (
        f"{method}: on {int(np.count_nonzero(is_thin))} of {mesh.n_elements} elements the body is thinner than the "
        f"elements are long, and bends too stiffly: take {factor:.1f} times as many elements, or quadratic Galerkin"
    )
    return (ResultWarning("thin body", "", text, factor),)


def thicknesses(mesh: BoundaryMesh, reach: FloatArray | float = np.inf) -> FloatArray:
    """Return the distance (n_elements,) [m] across the body to the nearest element that faces the other way.

    Elements face each other if their normals are opposite to within 60 degrees and the line between their middles is
    within 45 degrees of the normal; infinite where no element within `reach` [m] does.
    """
    whole, result = mesh.whole, np.full(mesh.n_elements, np.inf)
    farthest = np.minimum(reach, 4.0 * whole.diameter) + np.zeros(mesh.n_elements)
    for first, second in _near_pairs(mesh, farthest):
        arm = whole.centres[second] - whole.centres[first]
        across, distance = -np.sum(arm * whole.normals[first], axis=1), np.hypot(arm[:, 0], arm[:, 1])
        cosine = np.sum(whole.normals[first] * whole.normals[second], axis=1)
        faces = (distance <= farthest[first]) & (cosine < _FACING) & (across > np.sqrt(0.5) * distance)
        np.minimum.at(result, first[faces], distance[faces])
    return result


def _near_pairs(mesh: BoundaryMesh, farthest: FloatArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield pairs of an element and an element of the whole body within the distance `farthest` of the first."""
    whole, elements = mesh.whole, np.arange(mesh.n_elements)
    if whole.n_elements <= _FEW:
        arms = whole.centres - mesh.centres[:, None]
        first, second = np.nonzero(np.hypot(arms[:, :, 0], arms[:, :, 1]) <= farthest[:, None])
        yield first, second
        return
    from scipy.spatial import KDTree

    tree = KDTree(whole.centres)
    for rows in np.split(elements, range(_ROWS, mesh.n_elements, _ROWS)):
        near = tree.query_ball_point(mesh.centres[rows], farthest[rows], return_sorted=False)
        counts = np.fromiter(map(len, near), np.intp, len(near))
        yield np.repeat(rows, counts), np.fromiter(itertools.chain.from_iterable(near), np.intp, counts.sum())
