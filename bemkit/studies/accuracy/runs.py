"""The runs of a study: element types times drivers times sequences of meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

from bemkit.errors import InputError
from bemkit.geometry.grading import Algebraic, Grading, Uniform
from bemkit.scene.discretisation import Discretisation
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.registry import DISCRETISATIONS, SOLVERS
from bemkit.scene.scene import Scene
from bemkit.solvers.base import ContactSolver
from bemkit.studies.engine import StudyError

ELEMENTS = (40, 80, 160, 320)
ACCURACIES = (1e-2, 1e-3, 1e-4)
MOST_ELEMENTS = 500


class MeshSequence(Protocol):
    """Meshes of growing size."""

    @property
    def name(self) -> str:
        """A word for tables and figures."""

    @property
    def sizes(self) -> tuple[float, ...]:
        """What tells the meshes apart, from coarse to fine: numbers of elements, or accuracies."""

    def options(self, scene: Scene, size: float) -> MeshOptions:
        """Return the mesh options of one size."""


@dataclass(frozen=True)
class GivenMeshes:
    """Meshes of given numbers of elements with one grading; densities of sides are those of the scene.

    Parameters
    ----------
    name : str
    grading : Grading
    elements : tuple of int
    """

    name: str
    grading: Grading
    elements: tuple[int, ...] = ELEMENTS

    @property
    def sizes(self) -> tuple[float, ...]:
        """Numbers of elements."""
        return self.elements

    def options(self, scene: Scene, size: float) -> MeshOptions:
        """Return the scene's options with this grading and number of elements."""
        return MeshOptions(elements=int(size), grading=self.grading, density=scene.mesh.density)


def uniform(elements: tuple[int, ...] = ELEMENTS) -> GivenMeshes:
    """Return uniform meshes."""
    return GivenMeshes("uniform", Uniform(), elements)


def graded(elements: tuple[int, ...] = ELEMENTS, exponent: float = 3.0) -> GivenMeshes:
    """Return meshes graded towards corners and ends of parts like a power of the distance."""
    return GivenMeshes("graded", Algebraic(exponent), elements)


@dataclass(frozen=True)
class AdaptiveMeshes:
    """Meshes that follow the solution until an accuracy is reached.

    Parameters
    ----------
    accuracies : tuple of float
    most_elements : int
        No mesh has more; a run that ends there keeps the best result so far. A limit of time would not do: what it
        leaves differs from run to run.
    """

    accuracies: tuple[float, ...] = ACCURACIES
    most_elements: int = MOST_ELEMENTS

    @property
    def name(self) -> str:
        """``adaptive``."""
        return "adaptive"

    @property
    def sizes(self) -> tuple[float, ...]:
        """Accuracies, from coarse to fine."""
        return self.accuracies

    def options(self, scene: Scene, size: float) -> MeshOptions:
        """Return options that ask for the accuracy."""
        return MeshOptions(accuracy=size, most_elements=self.most_elements)


@dataclass(frozen=True)
class Run:
    """One record to compute.

    Parameters
    ----------
    meshes : str
        Name of the sequence.
    size : float
        Number of elements, or asked-for accuracy.
    problem : Scene
        Its own mesh, elements and driver do not matter.
    element : Discretisation
    options : MeshOptions
    driver : ContactSolver
    """

    meshes: str
    size: float
    problem: Scene = field(repr=False)
    element: Discretisation
    options: MeshOptions
    driver: ContactSolver

    @property
    def scene(self) -> Scene:
        """Made ready to run; InputError if it does not allow the element type or the mesh."""
        return replace(self.problem, discretisation=self.element, mesh=self.options, solver=self.driver)

    @property
    def discretisation(self) -> str:
        """The word for its elements."""
        return DISCRETISATIONS.kind_of(self.element)

    @property
    def map(self) -> str:
        """Name of the Steklov-Poincare map that belongs to the elements."""
        return self.element.method

    @property
    def solver(self) -> str:
        """Its word, or the name of its class if it has none."""
        try:
            return SOLVERS.kind_of(self.driver)
        except InputError:
            return type(self.driver).__name__

    @property
    def key(self) -> tuple[str, str, str, float]:
        """What tells records of one study apart."""
        return self.discretisation, self.meshes, self.solver, self.size


def all_runs(
    scene: Scene,
    discretisations: Sequence[Discretisation],
    meshes: Sequence[MeshSequence],
    solvers: Sequence[ContactSolver],
) -> tuple[Run, ...]:
    """Combine element types, meshes and drivers; constant elements have no error estimate and so no adaptive meshes.

    Parameters
    ----------
    scene : Scene
        The problem; its own mesh, discretisation and solver do not matter.
    discretisations, meshes, solvers : sequences

    Returns
    -------
    tuple of Run

    Raises
    ------
    StudyError
        If nothing is left to run, two runs could not be told apart, the scene has no contact, or a size is no size of a
        mesh. What the scene itself does not allow becomes a refused row.
    """
    if not scene.contact_parts:
        raise StudyError("no part of the scene is in contact: errors are measured along the contact boundary")
    try:
        runs = tuple(
            Run(sequence.name, size, scene, element, sequence.options(scene, size), solver)
            for element in discretisations
            for sequence in meshes
            if element.estimates_error or not isinstance(sequence, AdaptiveMeshes)
            for solver in solvers
            for size in sequence.sizes
        )
    except InputError as error:  # of the mesh options, which name the number
        raise StudyError(str(error)) from error
    if not runs:
        raise StudyError(
            "nothing to run: give at least one element type, driver and mesh, and with constant elements other than "
            "adaptive meshes, for which they have no error estimate"
        )
    keys = [run.key for run in runs]
    repeated = next((key for k, key in enumerate(keys) if key in keys[:k]), None)
    if repeated is not None:
        raise StudyError(f"{', '.join(map(str, repeated[:3]))} of size {repeated[3]:g} is given twice: leave one out")
    return runs
