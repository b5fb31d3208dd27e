"""Scenes for tests, known answers to some of them, and the true error of a solution in the energy norm."""

from __future__ import annotations

import dataclasses
import itertools
import json
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import bemkit as bk
from bemkit.geometry.curves import Arc, Segment
from bemkit.geometry.local_values import values_on_elements
from bemkit.geometry.outline import Outline, Side
from bemkit.model.prepared import prepare
from bemkit.operators.boundary import SteklovPoincareOperator
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity

REFERENCE = Path(__file__).parent / "reference" / "data"


@dataclass(frozen=True)
class QuarterDisk:
    """The quarter x > 0, y < 0 of a disc around the origin."""

    radius: float = 1.0

    def outline(self) -> Outline:
        """Return the arc and two radii."""
        r = self.radius
        arc = Side("arc", Arc((0.0, 0.0), r, -0.5 * np.pi, 0.0))
        top, left = Side("top", Segment((r, 0.0), (0.0, 0.0))), Side("left", Segment((0.0, 0.0), (0.0, -r)))
        return Outline(((arc, top, left),))


@dataclass(frozen=True)
class Perforated:
    """A plate of width and height 2 about the origin with rows of round holes."""

    n_x: int
    n_y: int

    def outline(self) -> Outline:
        """Return the sides and two arcs for each hole."""
        return self._checked

    @cached_property
    def _checked(self) -> Outline:
        corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        names = ("bottom", "right", "top", "left")
        sides = [Side(name, Segment(corners[k - 4], corners[k - 3])) for k, name in enumerate(names)]
        loops = [tuple(sides)]
        for i, j in itertools.product(range(self.n_x), range(self.n_y)):
            centre = 2.0 * (i + 0.5) / self.n_x - 1.0, 2.0 * (j + 0.5) / self.n_y - 1.0
            ends = (0.0, -np.pi, -2.0 * np.pi)
            arcs = (Arc(centre, 0.6 / max(self.n_x, self.n_y), *pair) for pair in itertools.pairwise(ends))
            loops.append(tuple(Side(f"hole-{i}-{j}-{k}", arc) for k, arc in enumerate(arcs)))
        return Outline(tuple(loops))


def paper(example: int, discretisation: Any = None, mesh: bk.MeshOptions | None = None) -> bk.Scene:
    """One of the paper's examples."""
    scene = bk.load_scene(f"paper-{example}")
    discretisation = bk.Galerkin(2) if discretisation is None else discretisation
    return dataclasses.replace(scene, discretisation=discretisation, mesh=scene.mesh if mesh is None else mesh)


def wavy() -> bk.Scene:
    """A block pressed onto waves (Westergaard): contact up to a = 0.25, peak pressure 0.048824."""
    gap = bk.Gap(bk.Expression("0.01 * (1 - cos(2 * pi * x))"))
    return bk.Scene(
        title="wavy obstacle",
        shape=bk.Rectangle(0.5, 1.5),
        material=bk.Material(1.0, 0.3),
        parts=(
            bk.Part("foundation", bk.Contact(gap), sides=("bottom",)),
            bk.Part("left", bk.Roller(), sides=("left",)),
            bk.Part("right", bk.Roller(), sides=("right",)),
            bk.Part("load", bk.Pressure(0.0172616), sides=("top",)),
        ),
        discretisation=bk.Galerkin(2),
    )


def disc(approach: float = 0.0160341) -> bk.Scene:
    """A quarter of a disc between rigid plates, E' = 1: half-angle 0.100134, peak pressure 0.050235."""
    floor = bk.Contact(bk.RigidHalfPlane((0.0, approach - 1.0), (0.0, 1.0)))
    return bk.Scene(
        title="disc between plates",
        shape=QuarterDisk(),
        material=bk.Material(1.0 - 0.3**2, 0.3),
        parts=(
            bk.Part("foundation", floor, sides=("arc",), where=bk.Expression("y < -0.5")),
            bk.Part("top", bk.Roller(), sides=("top",)),
            bk.Part("left", bk.Roller(), sides=("left",)),
        ),
        discretisation=bk.Galerkin(2),
    )


def angle() -> bk.Scene:
    """An L clamped at its back and pushed down at its end: a re-entrant corner with the exponent 0.54."""
    corners = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.5, 0.5), (0.5, 1.0), (0.0, 1.0))
    return bk.Scene(
        title="L",
        shape=bk.Polygon(corners, ("foundation", "end", "step", "inner", "top", "back")),
        material=bk.Material(1.0, 0.3),
        parts=(
            bk.Part("foundation", bk.Contact(bk.RigidHalfPlane()), sides=("foundation",)),
            bk.Part("wall", bk.Clamped(), sides=("back",)),
            bk.Part("load", bk.Traction(y=-1e-3), sides=("end",)),
        ),
        discretisation=bk.Galerkin(2),
    )


def true_error(solution: bk.Solution, n_bisections: int = 2) -> float:
    """Return the relative error in the energy norm against the solution on the same mesh with all elements bisected."""
    scene, mesh = solution.scene, solution.mesh
    for _ in range(n_bisections):
        mesh = mesh.refined(np.arange(mesh.n_elements))
    space = scene.discretisation.displacement_space(solution.mesh)
    scene = dataclasses.replace(scene, discretisation=bk.Galerkin(space.degree))
    fine, fine_space = bk.run(scene, mesh=mesh).boundary.displacement, scene.discretisation.displacement_space(mesh)
    n_parts = 2**n_bisections
    own = np.arange(mesh.n_elements)
    xi = (2.0 * (own % n_parts)[:, None] + 1.0 + fine_space.local_nodes) / n_parts - 1.0
    inherited = np.empty_like(fine)
    for local, dofs in enumerate(fine_space.element_dofs.T):
        at_dofs = values_on_elements(space, solution.boundary.displacement, own // n_parts)
        inherited[dofs] = np.einsum("pe,epc->ec", space.basis(xi[:, local]), at_dofs)
    prepared = prepare(scene, mesh)
    tractions = scene.discretisation.traction_space(mesh.unit)
    body = prepared.only
    stiffness = SteklovPoincareOperator(
        GalerkinElasticity(mesh.unit, prepared.material_of(body), body.own_space, tractions)
    ).matrix()
    error = (fine - inherited).ravel()
    return float(np.sqrt(error @ stiffness @ error / (fine.ravel() @ stiffness @ fine.ravel())))


@lru_cache
def reference_table(example: int) -> Any:
    """Return the columns x, u_n, u_t, sigma_n, sigma_t of the independent reference."""
    return np.genfromtxt(REFERENCE / f"paper-{example}.csv", delimiter=",", names=True)


@lru_cache
def reference_data(example: int) -> Any:
    """Return scalars and transitions of the independent reference, each with its error."""
    return json.loads((REFERENCE / f"paper-{example}.json").read_text())


@lru_cache
def reference_values(example: int) -> tuple[dict[str, float], list[float]]:
    """Return the scalars and the transition points of the independent reference."""
    data = reference_data(example)
    return {name: entry["value"] for name, entry in data["scalars"].items()}, [t["x"] for t in data["transitions"]]


def contact_error(solution: bk.Solution, example: int, *names: str) -> float:
    """Return the relative L2 error of columns of the contact table on the contact side, evaluated by the elements."""
    return table_error(example, {name: contact_values(solution, example, name) for name in names})


def table_error(example: int, fields: dict[str, Any]) -> float:
    """Return the relative L2 error on the contact side of some fields at the points of the reference, together."""
    table = reference_table(example)
    weights = np.gradient(table["x"])
    miss = sum(float(weights @ (values - table[name]) ** 2) for name, values in fields.items())
    return float(np.sqrt(miss / sum(float(weights @ table[name] ** 2) for name in fields)))


def contact_values(solution: bk.Solution, example: int, name: str) -> Any:
    """Return a column of the contact table at the points of the reference, interpolated by the displacement space."""
    x, mesh = reference_table(example)["x"], solution.mesh
    space = solution.scene.discretisation.displacement_space(mesh)
    elements = mesh.part("foundation")  # in order of x on the bottom side
    ends = mesh.end[elements, 0]
    own = elements[np.minimum(np.searchsorted(ends, x - 1e-14), elements.size - 1)]
    start, end = mesh.start[own, 0], mesh.end[own, 0]
    xi = np.clip((2.0 * x - start - end) / (end - start), -1.0, 1.0)
    chain = space.element_dofs[elements].ravel()
    chain = chain[np.sort(np.unique(chain, return_index=True)[1])]
    at_dofs = np.zeros(space.n_dofs // 2)
    at_dofs[chain] = getattr(solution.contact, name)
    return np.einsum("pn,np->n", space.basis(xi), at_dofs[space.element_dofs[own]])


DISCRETISATIONS = (bk.Galerkin(1), bk.Galerkin(2), bk.ConstantCollocation())


def square(**changes: object) -> bk.Scene:
    """Return the whole body of the paper's Example 2."""
    parts = (
        bk.Part("foundation", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("top load", bk.Traction(y=bk.Expression("-x**2 * (1 - x)**2")), sides=("top",)),
        bk.Part("left load", bk.Traction(x=bk.Expression("2 * y**2 * (1 - y)**2")), sides=("left",)),
        bk.Part("right load", bk.Traction(x=bk.Expression("-2 * y**2 * (1 - y)**2")), sides=("right",)),
    )
    defaults = {
        "title": "Whole square",
        "shape": bk.Rectangle(1.0, 1.0),
        "material": bk.Material(1e4, 0.3),
        "law": bk.Coulomb(0.1),
        "mesh": bk.MeshOptions(elements=40),
    }
    return bk.Scene(parts=parts, **(defaults | changes))  # type: ignore[arg-type]


def squeezed(shape: bk.Disk | bk.Ring | bk.PlateWithHole | bk.Rectangle, **changes: object) -> bk.Scene:
    """Return a body of height 2 about the origin, squeezed between two frictional plates."""
    outside = tuple(side.name for side in shape.outline().loops[0])
    defaults = {"title": "Squeezed", "material": bk.Material(1.0, 0.3), "law": bk.Coulomb(0.2)}
    parts = tuple(
        bk.Part(
            name,
            bk.Contact(bk.RigidHalfPlane((0.0, sign * 0.97), (0.0, -sign))),
            sides=outside,
            where=bk.Expression(f"{sign} * y > 0.5 and abs(x) < 0.8"),
        )
        for name, sign in (("below", -1.0), ("above", 1.0))
    )
    return bk.Scene(shape=shape, parts=parts, **(defaults | {"mesh": bk.MeshOptions(elements=40)} | changes))  # type: ignore[arg-type]


def whole_mesh(scene: bk.Scene, half: bk.BoundaryMesh) -> bk.BoundaryMesh:
    """Return the mesh of the whole body that a halved one stands for, with the parts of the scene."""
    whole, centres = half.whole, half.whole.centres
    names = np.full(whole.n_elements, "", dtype=object)
    for part in scene.parts:
        owner = whole if part.name in whole.parts else None
        members = np.arange(whole.n_elements) if owner is None else whole.part(part.name)
        keeps = part.where(*centres[members].T) if part.where is not None else _on_sides(part.sides, centres[members])
        names[members[np.broadcast_to(keeps, members.shape)]] = part.name
    parts = {part.name: np.flatnonzero(names == part.name) for part in scene.parts}
    return bk.BoundaryMesh(whole.nodes, whole.elements, parts, whole.curves, whole.element_curve, whole.element_span)


def _on_sides(sides: tuple[str, ...], centres: np.ndarray) -> np.ndarray:
    """Tell which points lie on the named sides of the unit square."""
    x, y = centres.T
    places = {"left": x == 0.0, "right": x == 1.0, "bottom": y == 0.0, "top": y == 1.0}
    return np.any([places[side] for side in sides], axis=0)


@dataclass(frozen=True)
class EccentricRing:
    """A disk with a round hole away from its middle."""

    centre: tuple[float, float]

    def outline(self) -> Outline:
        """Return the outer circle and the hole."""
        hole = bk.Ring(0.1, 0.2, self.centre).outline().loops[1]
        return Outline((bk.Disk(1.0).outline().loops[0], hole))


LINEAR, CONSTANT = bk.Galerkin(1), bk.ConstantCollocation()
FLOOR = bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",))


def block(*parts: bk.Part, **options: object) -> bk.Scene:
    """Unit square, E = 1 and nu = 0.3 unless said otherwise, contact with the given parts."""
    defaults: dict[str, object] = {
        "title": "block",
        "shape": bk.Rectangle(1.0, 1.0),
        "material": bk.Material(1.0, 0.3),
        "law": bk.Coulomb(0.3),
        "mesh": bk.MeshOptions(48),
    }
    return bk.Scene(parts=parts, **(defaults | options))  # type: ignore[arg-type]


def small_paper_scene(number: int, elements: int = 64, **changes: object) -> bk.Scene:
    """Return example 1 or 2 of the paper on a coarse mesh."""
    scene = bk.load_scene(f"paper-{number}")
    return dataclasses.replace(scene, mesh=dataclasses.replace(scene.mesh, elements=elements), **changes)  # type: ignore[arg-type]
