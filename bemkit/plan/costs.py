"""Costs of each way to solve a body in one table, and the choice of a way.

Counts of operations are exact and come from the elastic maps. The table turns them into bytes and into seconds of a
common computer, for the largest arrays within a fifth, for times within a factor of three. Its numbers were fitted to
scenes with 50 to 800 elements (`benchmarks/plan.py`) and to a square with 1e3 to 1e6 elements (`benchmarks/large.py`,
`benchmarks/low_memory.py`).
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.counts import OperationCounts
from bemkit.operators.linear_solvers import (
    Automatic,
    DenseCholesky,
    Hierarchical,
    LinearSolver,
    LinearSolverChoice,
    MatrixFree,
    Tag,
)
from bemkit.operators.steklov_poincare import SteklovPoincare
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions
from bemkit.threads import n_threads

BYTES = 8
"""Memory of a number."""
SECONDS_PER_FLOP = 1e-10
"""Time of a flop of a factorisation."""
CONTACT_STEPS = 8
"""Newton steps of a contact problem; they hardly depend on its size."""
_CHUNK_PAIRS = 24_000
"""Pairs of elements that each thread integrates at a time."""


@dataclass(frozen=True)
class Rates:
    """Time [s] and memory [bytes] of one way to solve a body.

    Parameters
    ----------
    pair, element : (float, float) [s]
        Integrals of a pair of elements, and of the pairs near an element: straight, curved.
    contact, contact_fixed : float [s]
        Contact steps of a load step: for each element, and for any number of them.
    cube, square : float [s]
        Factorisations, by the cube of their orders; solutions, by the square of the number of displacements.
    closed, response : float [s]
        Factorisations in contact steps and responses, by the cube and the square of the number of retained directions.
    entry, factored : float [bytes]
        For each stored entry of the operators: while contact is solved, and while the body is factored.
    column : float [bytes]
        For each entry of the columns of retained directions, while the body is factored.
    chunk, near : float, (float, float) [bytes]
        Integrals: for each entry of the pairs of a chunk, and of the pairs near elements: straight, curved.
    retained : float [bytes]
        For each pair of retained directions.
    bytes_of_element, bytes_of_contact, bytes_fixed : float [bytes]
        For each element, for each element in contact besides, and for any number of elements.
    """

    pair: tuple[float, float] = (0.0, 0.0)
    element: tuple[float, float] = (0.0, 0.0)
    contact: float = 0.0
    contact_fixed: float = 0.0
    cube: float = 0.0
    square: float = 0.0
    closed: float = 0.0
    response: float = 0.0
    entry: float = 0.0
    factored: float = 0.0
    column: float = 0.0
    chunk: float = 0.0
    near: tuple[float, float] = (0.0, 0.0)
    retained: float = 0.0
    bytes_of_element: float = 0.0
    bytes_of_contact: float = 0.0
    bytes_fixed: float = 0.0


# fmt: off
COLLOCATION = Rates(
    pair=(2.4e-7, 3e-7), element=(1e-5, 1.9e-4), cube=1.33e-10, square=4e-10,
    entry=8, factored=8, column=24, chunk=35, near=(5e5, 5e5),
)
LINEAR_GALERKIN = Rates(
    pair=(3e-7, 4e-7), element=(3.6e-4, 7e-4), cube=0.67e-10, square=3e-10,
    entry=11, factored=16, chunk=17, near=(3.4e6, 8e6),
)
HIGHER_GALERKIN = Rates(
    pair=(8e-7, 2e-6), element=(6e-4, 1.1e-3), cube=0.67e-10, square=2.3e-10,
    entry=12.5, factored=20, chunk=11, near=(2.4e6, 5.5e6),
)
COMPRESSED = Rates(
    element=(1e-4, 1e-4), contact=2e-5, contact_fixed=0.16, response=2e-7,
    retained=40, bytes_of_element=8.6e3, bytes_of_contact=3.5e3, bytes_fixed=9e6,
)
COMPRESSED_IN_NUMPY = replace(COMPRESSED, element=(3.2e-4, 3.2e-4))
MATRIX_FREE = Rates(element=(1e-4, 1e-4), contact=5e-4, bytes_of_element=1.5e3, bytes_fixed=5e6)
MATRIX_FREE_IN_NUMPY = Rates(element=(1.5e-3, 1.5e-3), contact=7.5e-3, bytes_of_element=2.4e3, bytes_fixed=7e6)
HALF_PLANE = Rates(pair=(2e-8, 2e-8), closed=5.3e-10, entry=8, factored=32, retained=24)
HALF_PLANE_OVER_TREE = Rates(element=(6e-5, 6e-5), bytes_of_element=1e4)
PERIODIC_HALF_PLANE = Rates(element=(5.3e-5, 5.3e-5), bytes_of_contact=1.9e3)
JOINED_HALF_PLANE = Rates(pair=(8e-8, 8e-8), cube=1.33e-10, entry=64, factored=256, retained=16)
# fmt: on
_FLOPS_OF_LARGE = 0.2
"""Time of a flop in the factorisation of a large matrix relative to one on small blocks."""
_SHARE = 0.5
"""Largest predicted time, relative to that of dense equations, of compressed ones that are chosen automatically."""
_FEWEST_ELEMENTS = 200
"""Smallest number of elements of equations that are compressed or not stored."""
_MOST_LOOPS, _MOST_LOOPS_EVALUATED = 41, 20
"""Largest numbers of closed curves: each adds an equation that passes through the whole tree, or each product."""
_LEAST_COMPRESSIBILITY = 1e-8
"""Smallest 1/2 - nu of a body with holes in compressed equations."""


@dataclass(frozen=True)
class ChosenLinearSolver:
    """A linear solver and the reason for its choice.

    Parameters
    ----------
    reason : str
        Part of a sentence, for the plan.
    hierarchical : Hierarchical or MatrixFree, optional
        If given, the equations are compressed over a tree or not stored, and `solver` is not used.
    solver : LinearSolver
    """

    reason: str
    hierarchical: Hierarchical | MatrixFree | None = None
    solver: LinearSolver = field(default_factory=DenseCholesky)


@dataclass(frozen=True, eq=False)
class BodyCase:
    """A body and the way to solve it.

    Parameters
    ----------
    elastic : SteklovPoincare
        Its map, without forces inside.
    conditions : NodalConditions
        Directions of contact nodes are retained.
    loads : tuple of GivenData
        Given forces and displacements of each load step.
    is_condensed : bool
        Whether the contact problem uses the stiffness of the body even if its equations are compressed over a tree.
    chosen : ChosenLinearSolver, optional
        By default dense equations.
    """

    elastic: SteklovPoincare
    conditions: NodalConditions
    loads: tuple[GivenData, ...]
    is_condensed: bool
    chosen: ChosenLinearSolver = field(default_factory=lambda: ChosenLinearSolver("dense"))

    @property
    def mesh(self) -> BoundaryMesh:
        """The mesh of the map."""
        return self.elastic.displacement_space.mesh

    @property
    def n_curved(self) -> int:
        """Number of curved elements."""
        return int(np.count_nonzero(~self.mesh.is_straight))

    @property
    def forms_no_matrix(self) -> bool:
        """Whether the contact problem asks the body for responses and forms no matrix of its own."""
        return not self.is_condensed and (self.chosen.hierarchical is not None or self.mesh.surface is not None)

    @property
    def work(self) -> OperationCounts:
        """The operation counts of all load steps; those over a tree depend on ranks and are not predicted."""
        if self.chosen.hierarchical is not None:
            return OperationCounts()
        if self.forms_no_matrix and self.mesh.surface is not None:
            from bemkit.operators.half_plane.surface import SurfaceElasticity

            assert isinstance(self.elastic, SurfaceElasticity)
            return self.elastic.work
        return self.elastic.counts(self.conditions, self.loads)


@dataclass(frozen=True)
class BodyCost:
    """Counts, memory and time of a body.

    Parameters
    ----------
    work : OperationCounts
        Exact.
    memory, kept : int [bytes]
        Largest memory at one time, and what remains while contact is solved.
    integration, algebra : float [s]
        Times on a common computer.
    """

    work: OperationCounts
    memory: int
    kept: int
    integration: float
    algebra: float

    @property
    def seconds(self) -> float:
        """Run time on a common computer [s]."""
        return self.integration + self.algebra


def rates_of(case: BodyCase, *, is_compiled: bool | None = None) -> Rates:
    """Return the row of the table for a body; kernels are compiled or not, by default as they will be."""
    mesh, options = case.mesh, case.chosen.hierarchical
    if options is not None:
        if is_compiled is None:
            from bemkit.operators.collocation import compiled

            is_compiled, _ = compiled.expected(mesh.n_elements)
        if isinstance(options, MatrixFree):
            return MATRIX_FREE if is_compiled else MATRIX_FREE_IN_NUMPY
        return COMPRESSED if is_compiled else COMPRESSED_IN_NUMPY
    if mesh.surface is not None:
        return _rates_of_half_plane(case)
    if Tag.SYMMETRIC in case.elastic.tags:
        return LINEAR_GALERKIN if case.elastic.displacement_space.degree < 2 else HIGHER_GALERKIN
    return COLLOCATION


def _rates_of_half_plane(case: BodyCase) -> Rates:
    from bemkit.operators.half_plane.elasticity import LargeHalfPlane
    from bemkit.operators.half_plane.periodic import PeriodicElasticity

    if case.is_condensed:
        return JOINED_HALF_PLANE
    if isinstance(case.elastic, PeriodicElasticity):
        return PERIODIC_HALF_PLANE
    has_tree = isinstance(case.elastic, LargeHalfPlane) and not case.conditions.n_fixed
    return HALF_PLANE_OVER_TREE if has_tree else HALF_PLANE


def cost_of(case: BodyCase, *, is_compiled: bool | None = None) -> BodyCost:
    """Return the cost of a body; see `rates_of`."""
    rates, work, conditions, mesh = rates_of(case, is_compiled=is_compiled), case.work, case.conditions, case.mesh
    n, n_dofs, r = mesh.n_elements, conditions.is_fixed.size, conditions.n_retained
    n_pairs, n_contact = work.element_pairs, int(np.count_nonzero(conditions.is_retained.any(axis=1)))
    stored = sum(operator.stored for operator in (work.single_layer, work.double_layer, work.hypersingular))
    if mesh.surface is not None:  # forces are unknown where supports hold, too
        r += conditions.n_fixed
        n_pairs = stored = n * n if rates.entry else 0
    elif case.forms_no_matrix:
        r = 0
    # curved elements weigh by their share, compressed equations by the digits of their tolerance
    curved, threads, options = case.n_curved / n, n_threads(n_pairs), case.chosen.hierarchical
    pair, element, near = (
        (1.0 - curved) * straight + curved * bent for straight, bent in (rates.pair, rates.element, rates.near)
    )
    digits = -math.log10(options.tolerance) / 10.0 if isinstance(options, Hierarchical) else 1.0
    integration = (pair * n_pairs + element * n) / threads
    if n_contact:
        integration += len(case.loads) * (rates.contact * n + rates.contact_fixed)
    cubes = sum(float(factorisation.order) ** 3 for factorisation in work.factorisations)
    algebra = rates.cube * cubes + rates.square * float(n_dofs) ** 2 * work.right_hand_sides
    algebra += rates.closed * float(r) ** 3 + rates.response * r**2
    kept = digits * (rates.bytes_fixed + rates.bytes_of_element * n + rates.bytes_of_contact * n_contact)
    kept += rates.entry * stored + rates.retained * r**2
    # integrals of a chunk of pairs and copies of a factorisation exist one after the other
    of_chunk = near + rates.chunk * stored * min(1.0, threads * _CHUNK_PAIRS / (n * mesh.whole.n_elements))
    of_factor = (rates.factored - BYTES) * stored + rates.column * n_dofs * r
    memory = max(kept, BYTES * stored + max(of_chunk, of_factor))
    return BodyCost(work, int(memory), int(kept), digits * integration, algebra)


def choose(requested: LinearSolverChoice, case: BodyCase, method: str) -> ChosenLinearSolver:
    """Choose the linear solver of a body, and say why.

    Parameters
    ----------
    requested : LinearSolver, Hierarchical, MatrixFree or Automatic
    case : BodyCase
        With dense equations.
    method : str
        Name of the discretisation in messages.

    Raises
    ------
    InputError
        If compressed equations of Galerkin's method are requested: there are none.
    """
    if not isinstance(requested, Automatic | Hierarchical | MatrixFree):
        return ChosenLinearSolver("asked for", solver=requested)
    if Tag.SYMMETRIC not in case.elastic.tags:
        return _choose_for_collocation(requested, case, method)
    if isinstance(requested, Hierarchical) and case.mesh.surface is None:
        raise InputError(
            f"linear_solver is 'hierarchical', but discretisation {method} has dense equations only: "
            'take discretisation = "constant", whose equations are compressed, or hp with an accuracy and '
            'linear_solver = "automatic"'
        )
    without = {Automatic: "", Hierarchical: "not compressed over a tree, but ", MatrixFree: "not matrix-free, but "}
    return ChosenLinearSolver(f"{without[type(requested)]}Cholesky, because S is positive definite")


def _choose_for_collocation(
    requested: Automatic | Hierarchical | MatrixFree, case: BodyCase, method: str
) -> ChosenLinearSolver:
    """Take compressed equations if they are requested, twice as fast, or the only ones that fit into memory."""
    if isinstance(requested, MatrixFree):
        if not (stored := _hindrance(case, method, is_stored=False)):
            return ChosenLinearSolver("asked for", requested)
        other = _choose_for_collocation(Automatic(), case, method)
        return replace(other, reason=f"not matrix-free, because {stored}; {other.reason}")
    if hindrance := _hindrance(case, method, is_stored=True):
        return ChosenLinearSolver(f"the equations are not compressed, because {hindrance}")
    if isinstance(requested, Hierarchical):
        return ChosenLinearSolver("asked for", requested)
    return _compressed_if_cheaper(case)


def _compressed_if_cheaper(case: BodyCase) -> ChosenLinearSolver:
    options, dense, available = Hierarchical(), cost_of(case), physical_memory()
    compressed = cost_of(replace(case, chosen=ChosenLinearSolver("", options)))
    contact = SECONDS_PER_FLOP * CONTACT_STEPS * 2.0 / 3.0 * float(case.conditions.n_retained) ** 3
    share = compressed.seconds / (dense.integration + _FLOPS_OF_LARGE * (dense.algebra + contact))
    if share < _SHARE:
        return ChosenLinearSolver(f"about {share:.2g} of the time of dense equations", options)
    if compressed.memory < available < dense.memory:
        reason = f"dense ones need about {dense.memory / 1e9:.3g} GB, there are {available / 1e9:.3g} GB"
        return ChosenLinearSolver(reason, options)
    return ChosenLinearSolver(f"compressed over a tree they would take {share:.2g} times as long")


def _hindrance(case: BodyCase, method: str, *, is_stored: bool) -> str:
    """Return why equations cannot be compressed, or why they must be stored; empty if they can, or need not."""
    from bemkit.operators.steklov_poincare.collocation import CollocationElasticity, is_enclosed

    mesh, material = case.mesh, case.elastic.material
    n_loops, is_incompressible = len(mesh.loops), material.effective_poisson_ratio > 0.5 - _LEAST_COMPRESSIBILITY
    reasons = {
        # a map that derives from collocation may change what it condenses
        f"{method} has no such equations": type(case.elastic) is not CollocationElasticity,
        f"{mesh.n_elements} elements are few": mesh.n_elements < _FEWEST_ELEMENTS,
        f"the boundary has {n_loops} closed curves": n_loops > (_MOST_LOOPS if is_stored else _MOST_LOOPS_EVALUATED),
    }
    if is_stored:
        reasons |= {
            # clusters around holes are nearly singular, and do not determine the pressure of an enclosed body
            "the material is incompressible, and the body has holes": is_incompressible and n_loops > 1,
            "contact and supports take all of the boundary of the incompressible body": is_enclosed(
                mesh, material, case.conditions
            ),
        }
    else:
        reasons |= {
            f"{case.n_curved} elements are curved": case.n_curved > 0,
            "the body is divided along a line of symmetry": mesh.symmetry is not None,
            "contact sees the stiffness of the body": case.is_condensed,
        }
    return next((reason for reason, holds in reasons.items() if holds), "")


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
