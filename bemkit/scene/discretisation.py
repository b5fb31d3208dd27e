"""How a scene is discretised: spaces of displacements and tractions, and the division of boundaries into elements."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from numbers import Real
from typing import Protocol

import numpy as np

from bemkit.arrays import IntArray
from bemkit.errors import GeometryError, InputError, ResultWarning
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.discretise import Grading, Uniform
from bemkit.geometry.neighbours import break_nodes, thicknesses
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, LagrangeSpace, check_degree
from bemkit.operators.linear_solvers import LinearSolver
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare import SteklovPoincare

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


class Discretisation(Protocol):
    """Spaces of displacements and tractions, and the map between them; a frozen dataclass without a mesh.

    A discretisation of your own derives from this class and writes the members without a default;
    `bemkit.testing.check_discretisation` tests it.
    """

    @property
    def method(self) -> str:
        """Name of the method in messages; by default that of the class."""
        return type(self).__name__

    @property
    def estimates_error(self) -> bool:
        """Whether its error can be estimated, so that meshes can follow an accuracy.

        Displacements must then be continuous, of degree p >= 1, and tractions of degree p - 1.
        """
        return False

    @abstractmethod
    def displacement_space(self, mesh: BoundaryMesh) -> BoundarySpace:
        """Return the space of the displacements; its nodes carry the contact conditions."""

    @abstractmethod
    def traction_space(self, mesh: BoundaryMesh) -> BoundarySpace:
        """Return the space of the tractions."""

    @abstractmethod
    def elastic_map(self, mesh: BoundaryMesh, material: Material, linear_solver: LinearSolver) -> SteklovPoincare:
        """Return the map from the displacements to the forces of a body; nothing is assembled yet.

        Parameters
        ----------
        mesh : BoundaryMesh
        material : Material
        linear_solver : LinearSolver
            For a symmetric map.
        """


@dataclass(frozen=True)
class Galerkin(Discretisation):
    """Symmetric Galerkin: displacements continuous and of degree p, tractions of degree p - 1 on each element.

    Tractions are constant on each element for p = 1, else continuous except at corners and at ends of boundary parts.
    Half-planes, whose tractions displace their surface in closed form, take only p = 1.
    Contact conditions hold at the nodes of the displacements, the Gauss-Lobatto points of each element.

    Parameters
    ----------
    degree : int or sequence of int
        p, from 1 to 12, of all elements or of each one. High degrees are efficient for smooth fields, and on meshes
        that are graded towards corners and transitions, as for an accuracy. Where degrees
        differ, elements share the node between them, and tractions are of degree 1 where displacements are.

    Raises
    ------
    GeometryError
        If a degree is not a whole number from 1 to 12; on a mesh, if there is not one for each element.
    """

    degree: int | tuple[int, ...]

    def __post_init__(self) -> None:
        if isinstance(self.degree, Sequence) and not isinstance(self.degree, str):
            if not self.degree:
                raise GeometryError("degree has no entries: give one whole number, or one for each element")
            object.__setattr__(self, "degree", tuple(self.degree))
        for degree in self._degrees:
            check_degree(degree)

    @property
    def _degrees(self) -> tuple[int, ...]:
        """The degrees given."""
        return self.degree if isinstance(self.degree, tuple) else (self.degree,)

    @property
    def largest_degree(self) -> int:
        """The largest degree of an element."""
        return max(self._degrees)

    @property
    def method(self) -> str:
        """Galerkin, from degree 3 on with the degree."""
        if min(self._degrees) < self.largest_degree:
            return f"Galerkin of degrees {min(self._degrees)} to {self.largest_degree}"
        return "Galerkin" if self.largest_degree <= 2 else f"Galerkin of degree {self.largest_degree}"

    @property
    def estimates_error(self) -> bool:
        """True, except for elements of degree 1 among others: there is no estimate for them."""
        return len(set(self._degrees)) == 1 or min(self._degrees) > 1

    def displacement_space(self, mesh: BoundaryMesh) -> BoundarySpace:
        """Return the continuous functions of the degree; the nodes of the mesh are their first dofs.

        On the surface of a half-plane only tractions are unknown functions, and displacements their means on elements.
        """
        return _galerkin_displacements(self, mesh) if mesh.surface is None else ConstantSpace(mesh)

    def traction_space(self, mesh: BoundaryMesh) -> BoundarySpace:
        """Return functions of one degree less, which may jump at corners and at ends of parts, or constants."""
        return _galerkin_tractions(self, mesh)

    def elastic_map(self, mesh: BoundaryMesh, material: Material, linear_solver: LinearSolver) -> SteklovPoincare:
        """Return the Galerkin map of the two spaces; of a half-plane the one of its surface."""
        if mesh.surface is not None:
            from bemkit.operators.half_plane.elasticity import half_plane_map

            return half_plane_map(mesh, material)
        from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity

        displacements, tractions = self.displacement_space(mesh), self.traction_space(mesh)
        return GalerkinElasticity(mesh, material, displacements, tractions, linear_solver)

    def degrees_on(self, mesh: BoundaryMesh) -> IntArray | None:
        """Return the degrees (n_elements,) of the elements of a mesh; None if all are equal."""
        if not isinstance(self.degree, tuple):
            return None
        degrees = np.array(self.degree)
        if degrees.size != mesh.n_elements:
            raise GeometryError(
                f"degree has {degrees.size} entries, but the mesh has {mesh.n_elements} elements: give one degree for "
                "each element, or a single one"
            )
        return None if (degrees == degrees[0]).all() else degrees


def on_whole_body(discretisation: Discretisation, mesh: BoundaryMesh) -> Discretisation:
    """Return the discretisation of the whole body of a mesh with symmetry: images repeat the degrees of elements."""
    if isinstance(discretisation, Galerkin) and isinstance(discretisation.degree, tuple):
        return Galerkin(discretisation.degree * (mesh.whole.n_elements // mesh.n_elements))
    return discretisation


@lru_cache(maxsize=4)  # a space keeps what it has computed, so that equal ones should be the same object
def _galerkin_displacements(galerkin: Galerkin, mesh: BoundaryMesh) -> BoundarySpace:
    return LagrangeSpace(mesh, degree=galerkin.largest_degree, element_degrees=galerkin.degrees_on(mesh))


@lru_cache(maxsize=4)
def _galerkin_tractions(galerkin: Galerkin, mesh: BoundaryMesh) -> BoundarySpace:
    if galerkin.largest_degree == 1:
        return ConstantSpace(mesh)
    lower = None if (degrees := galerkin.degrees_on(mesh)) is None else np.maximum(degrees - 1, 1)
    return LagrangeSpace(mesh, break_nodes(mesh), degree=galerkin.largest_degree - 1, element_degrees=lower)


@dataclass(frozen=True)
class ConstantCollocation(Discretisation):
    """Direct collocation with displacements and tractions constant on each element.

    Parameters
    ----------
    slopes : bool
        Whether the double layer includes the slope of the displacement between neighbouring elements. Rotations then
        cause no forces, and displacements and energies converge with second order. Without slopes this is the method of
        the paper, which has first order.
    """

    slopes: bool = True

    @property
    def method(self) -> str:
        """Collocation."""
        return "collocation"

    def displacement_space(self, mesh: BoundaryMesh) -> BoundarySpace:
        """Return the constants on elements; their nodes are the centres."""
        return ConstantSpace(mesh)

    def traction_space(self, mesh: BoundaryMesh) -> BoundarySpace:
        """Return the constants on elements."""
        return ConstantSpace(mesh)

    def elastic_map(self, mesh: BoundaryMesh, material: Material, linear_solver: LinearSolver) -> SteklovPoincare:
        """Return the collocation map, which has a linear solver of its own."""
        from bemkit.operators.steklov_poincare.collocation import CollocationElasticity

        return CollocationElasticity(mesh, material, slopes=self.slopes)


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
        for name in ("elements", "accuracy", "most_elements", "most_seconds"):
            if not isinstance(value := getattr(self, name), Real | None):
                raise InputError(f"{name} is {value!r}: give a number")
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
