"""Predicted costs of a Steklov-Poincare operator: plan items, counts, memory and operations.

Counts are exact. Memory is the sum of the matrices that exist at the same time and the buffers of assembly. The buffers
of collocation and the evaluations of integrals were fitted to runs of the shipped scenes with 50 to 800 elements.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.counts import Entries, Factorisation, FactorKind, OperationCounts
from bemkit.operators.linear_solvers import ChosenLinearSolver
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import admissible_modes
from bemkit.operators.steklov_poincare.nodal_conditions import SLIDES, GivenData, NodalConditions
from bemkit.operators.threads import n_threads

_BYTES = 8
CONTACT_STEPS = 8
"""Newton steps of a contact problem; they hardly depend on its size."""
_SECONDS_PER_EVALUATION, _SECONDS_PER_FLOP = 2e-8, 1e-10
"""Time of a closed-form integral, and of a flop of a factorisation, on a common computer [s]."""
CHUNK_PAIRS = 32768
"""Pairs of a midpoint and an element that each thread of collocation evaluates at a time."""
_OWN_SOLVER = ChosenLinearSolver("the map has a linear solver of its own")


@dataclass(frozen=True)
class PlanItem:
    """One operator, matrix or library that a scene needs or skips, and why.

    Parameters
    ----------
    name : str
    is_needed : bool
    reason : str
    """

    name: str
    is_needed: bool
    reason: str

    def as_dict(self) -> dict[str, str | bool]:
        """Return the item as a JSON object."""
        return {"name": self.name, "needed": self.is_needed, "reason": self.reason}


@dataclass(frozen=True, eq=False)
class BodyCase:
    """A body whose map is planned.

    Parameters
    ----------
    mesh : BoundaryMesh
        In any units.
    material : Material
    conditions : NodalConditions
        Directions of contact nodes are retained.
    loads : tuple of GivenData
        Given forces and displacements of each load step.
    linear_solver : ChosenLinearSolver, optional
        Solver of a symmetric map; collocation uses its own.
    is_condensed : bool
        Whether the contact problem uses the stiffness of the body even if its equations are compressed over a tree.
    """

    mesh: BoundaryMesh
    material: Material
    conditions: NodalConditions
    loads: tuple[GivenData, ...]
    linear_solver: ChosenLinearSolver = _OWN_SOLVER
    is_condensed: bool = False

    @property
    def n_displacements(self) -> int:
        """Number of displacement components."""
        return self.conditions.is_fixed.size

    @property
    def n_fixed(self) -> int:
        """Number of components that supports prescribe."""
        return int(np.count_nonzero(self.conditions.is_fixed))

    @property
    def n_free(self) -> int:
        """Number of components with a given force."""
        return int(np.count_nonzero(self.conditions.is_free))

    @property
    def n_retained(self) -> int:
        """Number of components that contact determines."""
        return int(np.count_nonzero(self.conditions.is_retained))

    @property
    def is_enclosed(self) -> bool:
        """Whether only contact determines the pressure in a nearly incompressible body of constant elements.

        See `bemkit.operators.steklov_poincare.volume_constraint.Volume.retained_pressure`.
        """
        if self.mesh.is_exterior or not self.material.is_nearly_incompressible:
            return False
        is_changing = np.abs(self.conditions.in_frames(self.mesh.normals)) > SLIDES
        return not bool(np.any(is_changing & self.conditions.is_free))

    @property
    def n_curved(self) -> int:
        """Number of curved elements."""
        return int(np.count_nonzero(~self.mesh.is_straight))


@dataclass(frozen=True)
class BodyCost:
    """Costs of the condensation of a body.

    Parameters
    ----------
    items : tuple of PlanItem
    work : OperationCounts
        Predicted `CondensedMap.work` after the last load step.
    memory : int [bytes]
        Largest memory at one time.
    kept : int [bytes]
        Memory that is kept while the contact problem is solved.
    evaluations : float
        Closed-form integrals, each at one point for one element, on each thread.
    flops : float
        Flops of dense linear algebra.
    is_matrix_free : bool
        Whether the contact problem forms no matrix either; its work and memory are then counted here.
    """

    items: tuple[PlanItem, ...] = ()
    work: OperationCounts = field(default_factory=OperationCounts)
    memory: int = 0
    kept: int = 0
    evaluations: float = 0.0
    flops: float = 0.0
    is_matrix_free: bool = False

    @property
    def seconds(self) -> float:
        """Run time on a common computer [s]."""
        return seconds_of(self.evaluations, self.flops)


def seconds_of(evaluations: float, flops: float) -> float:
    """Return the run time of closed-form integrals and flops on a common computer [s]."""
    return _SECONDS_PER_EVALUATION * evaluations + _SECONDS_PER_FLOP * flops


def galerkin_cost(case: BodyCase, n_tractions: int, degree: int) -> BodyCost:
    """Return the costs of a symmetric Galerkin map.

    Parameters
    ----------
    case : BodyCase
    n_tractions : int
        Number of traction components.
    degree : int
        Degree of the displacements.
    """
    from bemkit.operators.integrals.pairs import Degrees
    from bemkit.operators.integrals.sweep import sweep_memory

    t, u, f, r = n_tractions, case.n_displacements, case.n_free, case.n_retained
    mesh = case.mesh
    assembled, is_curved = t * t + t * u + u * u, case.n_curved > 0
    is_bounded = not mesh.is_exterior
    n_pressures = len(mesh.loops) if case.material.is_incompressible else int(is_bounded)
    # right-hand sides with V: resultants and pressures; with the body: its volume
    n_columns = len(admissible_modes(mesh)) + n_pressures + int(is_bounded) + r + len(case.loads) + u
    factorisations = Factorisation(FactorKind.CHOLESKY, t), Factorisation(FactorKind.CHOLESKY, f)
    # factor of V, K twice, W and two copies of the sum; with curved elements four copies of W
    largest = t * t + max(2 * t * u + 3 * u * u, t * u + 4 * u * u if is_curved else 0)
    of_condensation = f * f + 2 * f * r + u * case.n_fixed
    largest, kept = max(largest, assembled + 2 * u * u + of_condensation + r * r), assembled + of_condensation
    flops = 2.0 * (t**3 / 3.0 + t * t * u + t * u * u) + 2.0 * (f**3 / 3.0 + 2.0 * f * f * r + 2.0 * f * r * r)
    work = OperationCounts(
        element_pairs=mesh.n_elements * mesh.whole.n_elements,
        single_layer=Entries.full(t, t),
        double_layer=Entries.full(t, u),
        hypersingular=Entries.full(u, u),
        factorisations=factorisations,
        right_hand_sides=n_columns,
    )
    degrees, n_sources = Degrees(log=(degree - 1, degree - 1), double=(degree - 1, degree)), mesh.whole.n_elements
    threads = n_threads(mesh.n_elements * n_sources * degrees.n_products)
    buffers = sweep_memory(degrees, mesh.n_elements, n_sources, threads, is_curved=is_curved)
    memory = max(_BYTES * assembled + buffers, _BYTES * largest)
    straight, curved = ((15.0, 18e3), (20.0, 35e3)) if degree < 2 else ((40.0, 30e3), (100.0, 55e3))
    evaluations = _evaluations(case, straight, curved) / threads
    return BodyCost(_galerkin_items(case, n_tractions), work, memory, _BYTES * kept, evaluations, flops)


def _galerkin_items(case: BodyCase, n_tractions: int) -> tuple[PlanItem, ...]:
    t, u, choice = n_tractions, case.n_displacements, case.linear_solver
    inverse = f"V^-1 by Cholesky, because V is symmetric and positive definite; order {t}"
    is_incompressible = case.material.is_incompressible and not case.mesh.is_exterior
    volume = "Poisson's ratio is 1/2" if is_incompressible else "the body is compressible"
    return (
        PlanItem("single layer V", True, f"maps tractions to displacements; symmetric; {t} x {t}"),
        PlanItem("double layer K", True, f"maps displacements to displacements; {t} x {u}"),
        PlanItem("adjoint double layer K'", False, "it is the transpose of K"),
        PlanItem("hypersingular operator W", True, f"makes the Steklov-Poincare map symmetric; {u} x {u}"),
        PlanItem("Steklov-Poincare map", True, inverse),
        PlanItem("linear solver of the body", True, f"{choice.reason}; order {case.n_free}"),
        PlanItem("algebraic multigrid (pyamg)", False, "the linear solver is direct"),
        PlanItem("pressure that keeps the volume", is_incompressible, volume),
    )


def collocation_cost(case: BodyCase, *, takes_slopes: bool) -> BodyCost:
    """Return the costs of direct collocation.

    Parameters
    ----------
    case : BodyCase
    takes_slopes : bool
        Whether the displacements of the double layer vary linearly on each element.
    """
    u, r, mesh = case.n_displacements, case.n_retained, case.mesh
    n_single, n_double = case.n_fixed + r, case.n_free + r
    sweeps = _different_loads(case)
    n_loaded, n_moved = sum(data.n_loaded for data in sweeps), sum(data.n_moved for data in sweeps)
    order = u + len(admissible_modes(mesh)) + len(mesh.loops)
    n_elements = mesh.n_elements  # the first sweep takes all elements, later ones may take only loaded ones
    for later in sweeps[1:]:
        n_elements += mesh.n_elements if later.n_moved else int(np.count_nonzero(later.force.any(axis=1)))
    work = OperationCounts(
        element_pairs=n_elements * mesh.whole.n_elements,
        single_layer=Entries.full(u, n_single) + Entries(u * n_loaded),
        double_layer=Entries.full(u, n_double) + Entries(u * n_moved),
        factorisations=(Factorisation(FactorKind.LU, order),),
        right_hand_sides=r + int(case.is_enclosed) + len(sweeps),
    )
    # the system, its right-hand sides, and the copies of LU
    system = (u + len(admissible_modes(mesh))) ** 2
    memory = _BYTES * (system + u * r) + int(max(195.0 * _pairs_in_chunks(mesh), _BYTES * 3.0 * u * r))
    evaluations = _evaluations(case, (12.0, 500.0), (15.0, 9500.0)) * n_elements / mesh.n_elements
    evaluations /= n_threads(mesh.n_elements * mesh.whole.n_elements)
    flops = 2.0 * (2.0 / 3.0 * order**3 + 2.0 * order**2 * r)
    items = _collocation_items(case, order, n_loaded, n_moved, takes_slopes)
    return BodyCost(items, work, memory, _BYTES * (system + u * r), evaluations, flops)


def _different_loads(case: BodyCase) -> list[GivenData]:
    """Return the given data of the load steps that are no multiples of the data before."""
    different: list[GivenData] = []
    for data in case.loads:
        if not different or data.factor_of(different[-1]) is None:
            different.append(data)
    return different


NO_HYPERSINGULAR = PlanItem("hypersingular operator W", False, "collocation takes only the displacement equation")
"""Item of all collocation maps."""


def slopes_item(takes_slopes: bool) -> PlanItem:
    """Return the item of slopes between constant elements, of all collocation maps."""
    reason = "rotations then cause no tractions" if takes_slopes else "the method of the source paper"
    return PlanItem("slopes between constant elements", takes_slopes, reason)


def _collocation_items(
    case: BodyCase, order: int, n_loaded: int, n_moved: int, takes_slopes: bool
) -> tuple[PlanItem, ...]:
    u, n_single, n_double = case.n_displacements, case.n_fixed + case.n_retained, case.n_free + case.n_retained
    n_given = n_loaded + n_moved
    given = f"{n_given} columns are multiplied by given data at once" if n_given else "all given data are zero"
    volume = "collocation has it among the tractions" if case.material.is_incompressible else "the body is compressible"
    return (
        PlanItem("single layer V", True, f"unknown tractions: held and retained directions; {u} x {n_single}"),
        _zero_columns("columns of V on the free surface", "the traction is zero there", u - n_single - n_loaded, u),
        PlanItem("double layer K", True, f"unknown displacements: free and retained directions; {u} x {n_double}"),
        _zero_columns("columns of K where supports hold", "the displacement is zero there", u - n_double - n_moved, u),
        PlanItem("storage of columns under given data", False, given),
        slopes_item(takes_slopes),
        PlanItem("adjoint double layer K'", False, NO_HYPERSINGULAR.reason),
        NO_HYPERSINGULAR,
        PlanItem(
            "linear solver of the body",
            True,
            f"LU, because the equations of collocation are not symmetric; order {order}; {case.linear_solver.reason}",
        ),
        PlanItem("algebraic multigrid (pyamg)", False, "the linear solver is direct"),
        PlanItem("pressure that keeps the volume", False, volume),
    )


def _zero_columns(name: str, reason: str, n_columns: int, n_all: int) -> PlanItem:
    if n_columns <= 0:
        return PlanItem(name, True, "no column can be skipped")
    return PlanItem(name, False, f"{reason}; {n_columns} of {n_all} columns")


def _pairs_in_chunks(mesh: BoundaryMesh) -> int:
    """Return the number of element pairs that are evaluated at the same time."""
    n_pairs = mesh.n_elements * mesh.whole.n_elements
    return min(n_pairs, n_threads(n_pairs) * CHUNK_PAIRS)


def _evaluations(case: BodyCase, straight: tuple[float, float], curved: tuple[float, float]) -> float:
    """Return the evaluations of one sweep, from those of each far pair and of the near pairs of each element."""
    mesh, share = case.mesh, case.n_curved / case.mesh.n_elements
    far, near = ((1.0 - share) * flat + share * bent for flat, bent in zip(straight, curved, strict=True))
    n_sources = mesh.whole.n_elements
    return mesh.n_elements * (n_sources * far + near)


def physical_memory() -> float:
    """Return the memory of this computer, or the rest of the limit `ulimit -v` if that is smaller [bytes].

    It is infinite on systems that report neither.
    """
    try:
        page = float(os.sysconf("SC_PAGE_SIZE"))
        memory = page * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return float("inf")
    try:
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit == resource.RLIM_INFINITY:
            return memory
        taken = page * int(Path("/proc/self/statm").read_text().split()[0])
    except (ImportError, OSError):  # not a system of the Linux family
        return memory
    return min(memory, max(limit - taken, 0.0))
