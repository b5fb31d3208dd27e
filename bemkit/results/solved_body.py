"""Fields on the boundary of a solved body, and the errors estimated from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from bemkit.arrays import BoolArray, FloatArray, read_only
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import ConstantSpace
from bemkit.operators.linear_solvers import DenseCholesky, Tag
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.conditions import Clamped, Load, PrescribedDisplacement, Roller

if TYPE_CHECKING:
    from bemkit.model.particular import ParticularFields
    from bemkit.results.boundary_stress import BoundaryStress
    from bemkit.results.coefficient_decay import CoefficientErrors
    from bemkit.results.part_forces import PartForce
    from bemkit.results.side_stress import LargestStress
    from bemkit.results.surface_errors import SurfaceErrors
    from bemkit.table import Table


@dataclass(frozen=True, eq=False)
class BoundaryFields:
    """Displacement and traction on the whole boundary.

    Parameters
    ----------
    points : (n_points, 2) array [m]
        Where the displacement is known: the nodes of the displacement space of the scene's discretisation.
    displacement : (n_points, 2) array [m]
    centres : (n_elements, 2) array [m]
    traction : (n_elements, 2) array [Pa]
        Mean of each element.
    traction_dofs : (n_elements * n_local, 2) array [Pa]
        Values at the local nodes of the traction space of the discretisation, element by element: loads may jump
        anywhere; see `ElementwiseSpace`.
    reaction : (n_points, 2) array [N/m]
        Forces of supports at the points, with which the body is in equilibrium to round-off; tractions there are so but
        for their error.

    Raises
    ------
    ValueError
        If the shapes do not fit together.
    """

    points: FloatArray
    displacement: FloatArray
    centres: FloatArray
    traction: FloatArray
    traction_dofs: FloatArray
    reaction: FloatArray

    def __post_init__(self) -> None:
        for place, value in (("points", "displacement"), ("points", "reaction"), ("centres", "traction")):
            shape = (len(getattr(self, place)), 2)
            for name in (place, value):
                array = getattr(self, name)
                if array.shape != shape:
                    raise InputError(f"{name} has the shape {array.shape}: give {shape} to match {place}")
                read_only(array)
        shape, n = self.traction_dofs.shape, len(self.traction)
        if len(shape) != 2 or shape[1] != 2 or shape[0] % max(n, 1):
            raise InputError(f"traction_dofs has the shape {shape}: give a multiple of {n} rows to match traction")
        read_only(self.traction_dofs)

    def __repr__(self) -> str:
        """Return one line."""
        return f"BoundaryFields({len(self.points)} points, {len(self.centres)} elements)"


class SideName(NamedTuple):
    """A side of an elastic body in a contact."""

    body: str
    part: str


_FREE_SHARE = 1e-16
"""Largest energy of a heated body that counts as free to expand, relative to the energy if it could not expand."""


_ROUND_OFF = 5e-14
"""Differences of displacements between neighbours that may be round-off, relative to the largest displacement: up to
3e-14 was measured on bodies in rigid motion, of up to 2000 graded elements."""


@dataclass(frozen=True, eq=False)
class SolvedBody:
    """One elastic body of a solution.

    Parameters
    ----------
    name : str
        Empty if the scene names no bodies.
    scene : BodyScene
        Its part of the scene, in the coordinates of its shape.
    mesh : BoundaryMesh
        In its place.
    boundary : BoundaryFields
    energy : float [J/m]
        Elastic energy: half the work of the stresses in the plane on the strains that they cause. In plane strain heat
        also compresses the body along its length, which costs E (alpha T)^2 / 2 per volume, not counted here.
    contact_forces : mapping of str to PartForce
        Forces of contacts on each part in contact; see `bemkit.results.part_forces.forces_on_parts`.
    """

    name: str
    scene: BodyScene
    mesh: BoundaryMesh
    boundary: BoundaryFields
    energy: float
    contact_forces: Mapping[str, PartForce]

    def __repr__(self) -> str:
        """Return one line; the fields hold thousands of numbers."""
        return f"SolvedBody({self.name!r}: {self.mesh.n_elements} elements)"

    @cached_property
    def map_tags(self) -> frozenset[Tag]:
        """Properties of its elastic map: whether it is symmetric, and which motions cause no forces."""
        return self.scene.discretisation.elastic_map(self.mesh, self.scene.material, DenseCholesky()).tags

    @cached_property
    def particular(self) -> ParticularFields | None:
        """The particular solution of the body forces, known in closed form; None without body forces."""
        if not self.scene.body_forces:
            return None
        from bemkit.model.particular import ParticularFields

        return ParticularFields.of(self.scene, self.mesh)

    @cached_property
    def boundary_stress(self) -> BoundaryStress:
        """Stress at local coordinates of elements of the whole boundary."""
        from bemkit.results.boundary_stress import BoundaryStress

        fields = self.map_boundary
        return BoundaryStress.from_half(
            self.mesh, self.scene, fields.displacement, fields.traction_dofs, self.particular
        )

    def stress(self, points: npt.ArrayLike, part: str | None = None) -> FloatArray:
        """Evaluate the stress inside the body and on its boundary.

        Parameters
        ----------
        points : (n, 2) array [m]
        part : str, optional
            With a part all points lie on it. At a corner the stress is that of this side; without a part it is the
            mean of both sides.

        Returns
        -------
        (n, 2, 2) array [Pa]

        Raises
        ------
        PointNotInsideError
            If a point lies outside of the body, or off the part.
        UnknownPartError

        Notes
        -----
        On the boundary the traction and the strain along it give the stress by Hooke's law, as accurate as both are;
        see `BoundaryStress`. Inside, see `bemkit.interior_fields`.
        """
        from bemkit.results.boundary_stress import stress_at

        return stress_at(self.boundary_stress, points, part)

    def displacement(self, points: npt.ArrayLike) -> FloatArray:
        """Evaluate the displacement (n, 2) [m] inside the body and on its boundary, at points (n, 2) [m].

        Raises
        ------
        PointNotInsideError
            If a point lies outside of the body.
        """
        from bemkit.results.boundary_stress import displacement_at

        return displacement_at(self.boundary_stress, points)

    def side_stress(self, part: str) -> Table:
        """Return the stress along a part: ``s``, ``x``, ``y``, ``sigma_n``, ``sigma_t``, ``hoop``, ``von_mises``.

        The hoop stress acts along the boundary. Constant and linear elements have a row each, for their centres.
        """
        from bemkit.results.side_stress import side_stress

        return side_stress(self.boundary_stress, self.mesh, part)

    def largest_stress(self, measure: str = "von-mises", part: str | None = None) -> LargestStress:
        """Return the stress of largest size on the boundary and where it is.

        Parameters
        ----------
        measure : str
            ``"hoop"``, the stress along the boundary, or the name of a picture of stresses, such as ``"von-mises"``.
        part : str, optional
            The whole boundary by default. Near singular corners the value depends on the mesh.

        Raises
        ------
        InputError
            If the measure is unknown.
        UnknownPartError
        """
        from bemkit.results.side_stress import largest_stress

        return largest_stress(self.boundary_stress, measure, part)

    def stress_concentration(self, nominal: float, measure: str = "hoop", part: str | None = None) -> float:
        """Return the largest stress on the boundary over a nominal stress [Pa]; see `largest_stress`."""
        if not (math.isfinite(nominal) and nominal):
            raise InputError(f"nominal is {nominal}: give a stress other than zero, such as the one far from a hole")
        return self.largest_stress(measure, part).value / nominal

    @cached_property
    def map_boundary(self) -> BoundaryFields:
        """The fields on the boundary without the particular solution, which has no discretisation error."""
        if self.particular is None:
            return self.boundary
        total, mesh = self.boundary, self.mesh.unit
        means = self.particular.tractions(ConstantSpace(mesh))[:, 0]
        dofs = self.particular.tractions(self.scene.discretisation.traction_space(mesh)).reshape(-1, 2)
        displacement = total.displacement - self.particular.displacement(total.points)
        return replace(
            total, displacement=displacement, traction=total.traction - means, traction_dofs=total.traction_dofs - dofs
        )

    @cached_property
    def coefficient_errors(self) -> CoefficientErrors | None:
        """Estimated errors of each element of degree 3 and more; None of other elements."""
        discretisation, mesh = self.scene.discretisation, self.mesh
        space = discretisation.displacement_space(mesh)
        if not discretisation.estimates_error or space.degree <= 2:
            return None
        from bemkit.results.coefficient_decay import coefficient_errors

        at_nodes = self.map_boundary.traction_dofs.reshape(mesh.n_elements, -1, 2)
        modulus, tractions = self.scene.material.plane_modulus, discretisation.traction_space(mesh)
        return coefficient_errors(space, tractions, self.map_boundary.displacement, at_nodes, modulus)

    @cached_property
    def element_errors(self) -> FloatArray | None:
        """(n_elements,) array [J/m]: estimated squared errors in the energy norm; None without an estimate."""
        if self.coefficient_errors is not None:
            return self.coefficient_errors.energy
        discretisation, modulus = self.scene.discretisation, self.scene.material.plane_modulus
        if not discretisation.estimates_error:
            return None
        from bemkit.results.error_indicators import squared_errors

        make_space = discretisation.displacement_space
        fields = self.map_boundary
        return squared_errors(self.mesh, make_space, fields.displacement, fields.traction, modulus)

    @cached_property
    def surface_errors(self) -> SurfaceErrors | None:
        """Estimated errors of the tractions of a half-plane; None of another body."""
        if self.mesh.surface is None:
            return None
        from bemkit.results.surface_errors import SurfaceErrors

        return SurfaceErrors.of(self.mesh, self.boundary.traction, self._is_loaded)

    @property
    def _is_loaded(self) -> BoolArray:
        loaded = np.zeros(self.mesh.n_elements, dtype=bool)
        for part in self.scene.parts:
            loaded[self.mesh.part(part.name)] = isinstance(part.condition, Load)
        return loaded

    @cached_property
    def part_forces(self) -> tuple[PartForce, ...]:
        """The resultants on each part: of contacts, of the reactions of a support, or of loads.

        All are sums of the nodal forces with which the body is in equilibrium to round-off.
        """
        from bemkit.results.part_forces import load_force, part_force, support_forces

        space = self.scene.discretisation.traction_space(self.mesh)
        load = self.scene.depth * self.boundary.traction_dofs.reshape(self.mesh.n_elements, -1, 2)
        moved = self.scene.discretisation.displacement_space(self.mesh)
        parts = self.mesh.parts.items()
        forces = {part: part_force(part, self.mesh, space, load, elements) for part, elements in parts}
        for part, elements in self.scene.parts_on(self.mesh):
            if isinstance(part.condition, Load):
                forces[part.name] = load_force(part.name, moved, elements, part.condition, self.scene.depth)
        held, fields = (Clamped, Roller, PrescribedDisplacement), self.boundary
        supports = [part.name for part in self.scene.parts if isinstance(part.condition, held) and part.name in forces]
        forces |= support_forces(supports, moved, space, load, fields.points, fields.reaction)
        return tuple({name: self.contact_forces.get(name, force) for name, force in forces.items()}.values())

    @property
    def error_unit(self) -> float:
        """Energy [J/m] to which squared errors are relative: a(u, u).

        At least a share of the energy that heat would cause if the body could not expand.
        """
        held = 0.0 if self.particular is None else _FREE_SHARE * self.particular.held_energy
        return 2.0 * max(self.energy / self.scene.depth, held)

    @property
    def energy_of_round_off(self) -> float:
        """Elastic energy [J/m] that may be round-off: of a rigid motion, and of tractions that strain nothing.

        A pressure all around an incompressible body is such.
        """
        modulus = self.scene.material.plane_modulus
        moved = float(np.abs(self.boundary.displacement).max(initial=0.0))
        pressed = float(np.abs(self.boundary.traction).max(initial=0.0)) * self.mesh.diameter / modulus
        return self.mesh.n_elements * modulus * (_ROUND_OFF * max(moved, pressed)) ** 2
