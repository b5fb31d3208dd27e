"""Items of a plan: needed and skipped parts of a scene, with reasons, and the numbers of elements and unknowns."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bemkit.contact.laws import FrictionLaw
from bemkit.errors import counted
from bemkit.model.placed import PlacedBody, groups
from bemkit.model.prepared import Prepared
from bemkit.operators.counts import Entries
from bemkit.operators.linear_solvers import MatrixFree, Tag
from bemkit.operators.rigid_modes import admissible_modes
from bemkit.plan.costs import HALF_PLANE_OVER_TREE, BodyCase, cost_of, rates_of
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.registry import BODY_FORCES
from bemkit.scene.scene import Scene

if TYPE_CHECKING:
    from bemkit.geometry.symmetry.lines import Symmetry

_MOST_NAMED = 12
"""Largest number of different bodies that have a line each."""
_DEGREES = ("constant", "linear", "quadratic")


@dataclass(frozen=True)
class PlanItem:
    """One operator, matrix or library that a scene needs or skips, and why."""

    name: str
    is_needed: bool
    reason: str

    def as_dict(self) -> dict[str, str | bool]:
        """Return the item as a JSON object."""
        return {"name": self.name, "needed": self.is_needed, "reason": self.reason}


_NO_MULTIGRID = PlanItem("algebraic multigrid (pyamg)", False, "the linear solver is direct")
_NO_HYPERSINGULAR = PlanItem("hypersingular operator W", False, "collocation takes only the displacement equation")


@dataclass(frozen=True)
class Sizes:
    """Numbers of elements and unknowns.

    Parameters
    ----------
    n_elements, n_curved, n_loops : int
        Elements, those of them that are curved, and closed curves of the boundary.
    n_sources : int
        Elements of the whole body, images by symmetry included.
    displacement_degree, traction_degree : int
        Of the polynomials on each element.
    n_displacements, n_tractions : int
        Components at all nodes of the two spaces.
    n_fixed, n_free, n_open : int
        Displacement components that supports prescribe, that carry a known force, and that contact decides.
    n_contact, n_contact_unknowns : int
        Contact nodes, and the order of their system.
    n_motions, n_free_motions : int
        Rigid motions that cause no traction (3, or none on an exterior), and those of them that no support holds.
    """

    n_elements: int
    n_curved: int
    n_loops: int
    n_sources: int
    displacement_degree: int
    traction_degree: int
    n_displacements: int
    n_tractions: int
    n_fixed: int
    n_free: int
    n_open: int
    n_contact: int
    n_contact_unknowns: int
    n_motions: int
    n_free_motions: int


def find_sizes(prepared: Prepared) -> Sizes:
    """Count the elements and unknowns of all bodies."""
    bodies, n_driven = prepared.bodies, n_load_controlled(prepared.scene)
    return Sizes(
        n_elements=sum(body.mesh.n_elements for body in bodies),
        n_curved=sum(int(np.count_nonzero(~body.mesh.is_straight)) for body in bodies),
        n_loops=sum(len(body.mesh.loops) for body in bodies),
        n_sources=sum(body.mesh.whole.n_elements for body in bodies),
        displacement_degree=max(body.space.degree for body in bodies),
        traction_degree=max(body.traction_space.degree for body in bodies),
        n_displacements=sum(body.space.n_dofs for body in bodies),
        n_tractions=sum(body.traction_space.n_dofs for body in bodies),
        n_fixed=sum(body.conditions.n_fixed for body in bodies),
        n_free=sum(body.conditions.n_free for body in bodies),
        n_open=sum(body.conditions.n_retained for body in bodies),
        n_contact=prepared.n_contact,
        n_contact_unknowns=2 * prepared.n_contact - int(np.count_nonzero(prepared.tangent_follows)),
        n_motions=sum(len(admissible_modes(body.mesh)) for body in bodies) + 3 * len(prepared.scene.rigid),
        n_free_motions=n_driven + sum(len(body.free_modes) for body in bodies),
    )


def items_of_one(
    scene: BodyScene, sizes: Sizes, case: BodyCase, n_steps: int, proposal: Symmetry | None = None
) -> tuple[PlanItem, ...]:
    """Return the needed and skipped items of a scene of one body, in the order of their use.

    They include items of the elastic map, the number of load steps, and a symmetry that the scene has but does not use.
    """
    return (
        *_mesh_items(scene, sizes, proposal),
        *_items_of_body(case),
        _body_force_item(scene),
        *_contact_items(scene, sizes, n_steps),
        *_last_items(n_steps, "displacement inside the body", "stress inside the body"),
    )


def _items_of_body(case: BodyCase) -> Iterator[PlanItem]:
    """Yield what the elastic map of a body needs."""
    if case.mesh.surface is not None:
        yield from _half_plane_items(case)
    elif case.chosen.hierarchical is not None:
        yield from _compressed_items(case)
    elif Tag.SYMMETRIC in case.elastic.tags:
        yield from _galerkin_items(case)
    elif case.work.element_pairs:
        yield from _collocation_items(case)


def _galerkin_items(case: BodyCase) -> Iterator[PlanItem]:
    t, u = case.elastic.traction_space.n_dofs, case.elastic.displacement_space.n_dofs
    yield PlanItem("single layer V", True, f"maps tractions to displacements; symmetric; {t} x {t}")
    yield PlanItem("double layer K", True, f"maps displacements to displacements; {t} x {u}")
    yield PlanItem("adjoint double layer K'", False, "it is the transpose of K")
    yield PlanItem("hypersingular operator W", True, f"makes the Steklov-Poincare map symmetric; {u} x {u}")
    inverse = f"V^-1 by Cholesky, because V is symmetric and positive definite; order {t}"
    yield PlanItem("Steklov-Poincare map", True, inverse)
    solver = f"{case.chosen.reason}; order {case.conditions.n_free}"
    yield PlanItem("linear solver of the body", True, solver)
    yield _NO_MULTIGRID
    is_incompressible = case.elastic.material.is_incompressible and not case.mesh.is_exterior
    volume = "Poisson's ratio is 1/2" if is_incompressible else "the body is compressible"
    yield PlanItem("pressure that keeps the volume", is_incompressible, volume)


def _collocation_items(case: BodyCase) -> Iterator[PlanItem]:
    work, conditions, u = case.work, case.conditions, case.conditions.is_fixed.size
    single, double, n_retained = work.single_layer, work.double_layer, conditions.n_retained
    n_single, n_double = conditions.n_fixed + n_retained, conditions.n_free + n_retained
    yield PlanItem("single layer V", True, f"unknown tractions: held and retained directions; {u} x {n_single}")
    yield _zero_columns("columns of V on the free surface", "the traction is zero there", single, u)
    yield PlanItem("double layer K", True, f"unknown displacements: free and retained directions; {u} x {n_double}")
    yield _zero_columns("columns of K where supports hold", "the displacement is zero there", double, u)
    n_given = (single.computed - single.stored + double.computed - double.stored) // u
    given = f"{n_given} columns are multiplied by given data at once" if n_given else "all given data are zero"
    yield PlanItem("storage of columns under given data", False, given)
    yield from _slopes_items(case)
    yield PlanItem("adjoint double layer K'", False, _NO_HYPERSINGULAR.reason)
    yield _NO_HYPERSINGULAR
    order = max((factorisation.order for factorisation in work.factorisations), default=0)
    solver = f"LU, because the equations of collocation are not symmetric; order {order}; {case.chosen.reason}"
    yield PlanItem("linear solver of the body", True, solver)
    yield _NO_MULTIGRID
    is_incompressible = case.elastic.material.is_incompressible
    volume = "collocation has it among the tractions" if is_incompressible else "the body is compressible"
    yield PlanItem("pressure that keeps the volume", False, volume)


def _zero_columns(name: str, reason: str, operator: Entries, n_dofs: int) -> PlanItem:
    n_zero = n_dofs - operator.computed // n_dofs
    if n_zero <= 0:
        return PlanItem(name, True, "no column can be skipped")
    return PlanItem(name, False, f"{reason}; {n_zero} of {n_dofs} columns")


def _slopes_items(case: BodyCase) -> Iterator[PlanItem]:
    from bemkit.operators.steklov_poincare.collocation import CollocationElasticity

    if isinstance(case.elastic, CollocationElasticity):
        slopes = case.elastic.slopes
        reason = "rotations then cause no tractions" if slopes else "the method of the source paper"
        yield PlanItem("slopes between constant elements", slopes, reason)


def _compressed_items(case: BodyCase) -> Iterator[PlanItem]:
    """Yield what equations need that are compressed over a tree, or not stored."""
    from bemkit.operators.collocation import compiled

    options, (is_compiled, why) = case.chosen.hierarchical, compiled.expected(case.mesh.n_elements)
    assert options is not None
    is_free = isinstance(options, MatrixFree)
    compressed = f"single and double layer, compressed over a tree to {options.tolerance:g}"
    form = "products by the fast multipole method" if is_free else compressed
    yield PlanItem("boundary equations", True, f"{form}: {case.chosen.reason}")
    yield from _slopes_items(case)
    yield _NO_HYPERSINGULAR
    iteration = f"GMRES to {options.tolerance:g}, about 17 steps from cold"
    solver = iteration if is_free else "LU of the clusters of the tree; no matrix of the whole body"
    yield PlanItem("linear solver of the body", True, solver)
    chosen, other = (cost_of(case, is_compiled=choice).seconds for choice in (is_compiled, not is_compiled))
    others = "numpy" if is_compiled else "compiled ones"
    reason = f"{why}; {others} would take about {other:.3g} s instead of {chosen:.3g} s"
    yield PlanItem("compiled kernels (numba)", is_compiled, reason)
    hierarchy = PlanItem("algebraic multigrid (pyamg)", True, "its hierarchy inverts the single layer between elements")
    yield hierarchy if is_free else _NO_MULTIGRID


def _half_plane_items(case: BodyCase) -> Iterator[PlanItem]:
    n, surface, conditions = case.mesh.n_elements, case.mesh.surface, case.conditions
    is_periodic = surface is not None and surface.is_periodic
    form = f"closed form: {n} x {n} means of logarithms"
    if is_periodic:
        form = f"one number for each of {n} waves, by Fourier transforms"
    yield PlanItem("flexibility of the surface", True, form)
    around = "waves die out below the surface" if is_periodic else "the surface beyond the strip is free"
    yield PlanItem("elements inside, around or below", False, f"{around} in closed form")
    if is_periodic:
        reason = f"each response is found by GMRES, with 120 vectors of {conditions.n_retained} numbers"
        yield PlanItem("matrices", False, reason)
    else:
        yield PlanItem("double layer, hypersingular operator", False, "they vanish on a straight free surface")
    yield PlanItem("supports", conditions.n_fixed > 0, "the half-plane is held or driven far away")
    if rates_of(case) is HALF_PLANE_OVER_TREE:
        yield PlanItem("tree of clusters", True, f"{n} elements are many: one factor over them")


def _further_meshes(accuracy: float | None, given: str, first: str) -> PlanItem:
    """Return the item on whether meshes follow the solution, with its reasons."""
    reason = given
    if accuracy is not None:
        reason = f"until the estimated error is below {accuracy:g}; this plan is for the {first}"
    return PlanItem("further meshes", accuracy is not None, reason)


def _friction_item(laws: Iterable[FrictionLaw], kind: str = "") -> PlanItem:
    """Say which laws there are."""
    names = ", ".join(dict.fromkeys(type(law).__name__ for law in laws if not law.is_frictionless))
    return PlanItem("friction", bool(names), f"law {names}{kind}" if names else "the law allows no tangential traction")


def _last_items(n_steps: int, *inside: str) -> Iterator[PlanItem]:
    """Yield what follows the contact system; fields inside by the names they have."""
    history = f"{n_steps} load steps; slip counts from the end of the step before"
    yield PlanItem("load history", n_steps > 1, history if n_steps > 1 else "the whole load comes in one step")
    yield PlanItem("fields on the boundary", True, "part of every result")
    for name in inside:
        yield PlanItem(name, False, "not asked for; see interior_fields")
    yield PlanItem("result file (h5py)", False, "no part of the solve; loaded and written after it where asked for")
    yield PlanItem("figures (matplotlib)", False, "no part of the solve; loaded and drawn after it where asked for")


def _mesh_items(scene: BodyScene, sizes: Sizes, proposal: Symmetry | None) -> Iterator[PlanItem]:
    """Yield what elements, symmetry and spaces need."""
    n, n_curved = sizes.n_elements, sizes.n_curved
    outline = scene.shape.outline()
    if outline.drawing is not None:
        read = "; ".join(outline.drawing.notes) or "taken as it is"
        yield PlanItem("drawn outline", True, f"{counted(len(outline.sides), 'side')}; {read}")
    yield PlanItem("elements", True, f"{n} on {counted(sizes.n_loops, 'closed curve')}")
    yield _further_meshes(scene.mesh.accuracy, "the number of elements is given", "first mesh")
    curved = f"{n_curved} of {n} elements are curved" if n_curved else "all elements are straight"
    yield PlanItem("quadrature on curved elements", n_curved > 0, curved)
    if not sizes.n_motions and scene.symmetry is None:
        where = "outside of the boundary" if outline.surface is None else "half-plane below its surface"
        yield PlanItem("exterior domain", True, f"the body fills the {where}")
    reason = "not asked for"
    if scene.symmetry is not None:
        reason = f"about {scene.symmetry}: {n} of {sizes.n_sources} elements carry unknowns"
    elif proposal is not None:
        share = "half" if proposal.n_images == 2 else "a quarter"
        reason = f"proposed: the scene is symmetric about {proposal}, and {share} of its unknowns would do"
    yield PlanItem("symmetry", scene.symmetry is not None, reason)
    displacements, tractions = (
        _DEGREES[degree] if degree < len(_DEGREES) else f"degree {degree}"
        for degree in (sizes.displacement_degree, sizes.traction_degree)
    )
    reason = (
        f"{scene.discretisation.method}: {sizes.n_displacements} displacements and {sizes.n_tractions} tractions, "
        f"{sizes.n_fixed} of the displacements held, {sizes.n_open} retained for contact"
    )
    yield PlanItem(f"{displacements} displacements, {tractions} tractions", True, reason)


def _body_force_item(scene: BodyScene) -> PlanItem:
    kinds = ", ".join(dict.fromkeys(BODY_FORCES.kind_of(force) for force in scene.body_forces))
    reason = f"{kinds}, in closed form: no elements inside the body" if kinds else "nothing acts inside the body"
    return PlanItem("particular solution", bool(kinds), reason)


def _contact_items(scene: BodyScene, sizes: Sizes, n_steps: int) -> Iterator[PlanItem]:
    """Yield what contact needs."""
    c, n, n_free = sizes.n_contact_unknowns, sizes.n_contact, sizes.n_free_motions
    if not scene.contact_parts:
        yield PlanItem("contact system", False, "no part may touch an obstacle: the body is solved at once")
        return
    yield PlanItem("contact system", True, f"{n} nodes may touch; every contact step solves for {c} unknowns")
    yield PlanItem("second elastic body", False, "the obstacles are rigid")
    yield _friction_item(scene.laws.values(), ", static" if n_steps == 1 else ", incremental")
    tangential = f"{c - n} of {counted(n, 'contact node')}" if c > n else "supports give all of them"
    yield PlanItem("tangential unknowns", c > n, tangential)
    modes = "the supports hold all rigid motions"
    if n_free:
        modes = f"{n_free} of {sizes.n_motions} rigid motions {'is' if n_free == 1 else 'are'} held only by contact"
    yield PlanItem("rigid motions as unknowns", n_free > 0, modes)


def items_of_several(prepared: Prepared, sizes: Sizes, n_steps: int, *, is_dense: bool) -> Iterator[PlanItem]:
    """Return the needed and skipped items of several bodies, or of one with rigid bodies or contacts of its own."""
    scene = prepared.scene
    shapes = [[prepared.bodies[number] for number in group] for group in groups(prepared.bodies)]
    n_bodies = len(prepared.bodies)
    yield PlanItem("bodies", True, f"{n_bodies}, of {len(shapes)} that are assembled and factored")
    shared = n_bodies - len(shapes)
    reason = f"{shared} bodies share what another one has" if shared else "every body differs, or is held by supports"
    yield PlanItem("copies", shared > 0, reason)
    for bodies in shapes[:_MOST_NAMED]:
        yield PlanItem(f"body {_names(bodies)}", True, _body_line(bodies[0]))
    if len(shapes) > _MOST_NAMED:
        yield PlanItem(f"{len(shapes) - _MOST_NAMED} bodies more", True, "of the same kinds")
    yield _further_meshes(scene.mesh.accuracy, "the numbers of elements are given", "first meshes")
    n_pairs = len(scene.elastic_contacts)
    n_fixed = sum(rows.other < 0 for rows in prepared.rows)
    yield PlanItem("contacts between bodies", n_pairs > 0, f"{n_pairs}, coupled by mortar integrals")
    yield PlanItem(
        "rigid obstacles", n_fixed > 0, f"faced by {counted(n_fixed, 'part')}" if n_fixed else "no part faces one"
    )
    n_rigid = len(scene.rigid)
    moving = (
        f"{n_rigid} in {counted(len(scene.contacts) - n_pairs, 'contact')}, "
        f"{counted(n_load_controlled(scene), 'motion')} driven by loads"
    )
    yield PlanItem("rigid bodies", n_rigid > 0, moving if n_rigid else "there are none")
    yield _friction_item(rows.law for rows in prepared.rows)
    form = "one dense matrix of relative displacements"
    if not is_dense:
        from bemkit.contact.joined.sparse_form import sparse_solver_name

        form = f"a sparse system, factored in every step by {sparse_solver_name()}"
    yield PlanItem("contact system", True, f"{sizes.n_contact} nodes, {sizes.n_contact_unknowns} unknowns: {form}")
    modes = "supports hold all bodies"
    if sizes.n_free_motions:
        modes = f"{sizes.n_free_motions} of {sizes.n_motions} rigid motions are held only by contact"
    yield PlanItem("rigid motions as unknowns", sizes.n_free_motions > 0, modes)
    yield from _last_items(n_steps, "fields inside the bodies")


def n_load_controlled(scene: Scene) -> int:
    """Return how many motions of rigid bodies are unknown."""
    return sum(int(np.count_nonzero(body.is_load_controlled)) for body in scene.rigid)


def _names(bodies: Sequence[PlacedBody]) -> str:
    return bodies[0].name if len(bodies) == 1 else f"{bodies[0].name} and {len(bodies) - 1} like it"


def _body_line(body: PlacedBody) -> str:
    method, mesh = body.scene.discretisation.method, body.own_mesh
    return f"{mesh.n_elements} elements, {body.space.n_dofs} displacements ({method})"
