"""The check of discretisations accepts ours and one of one's own, and finds what is wrong with others."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.cli.main import main
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, LinearSpace, QuadraticSpace
from bemkit.operators.counts import OperationCounts
from bemkit.operators.linear_solvers import LinearSolver, Tag
from bemkit.operators.steklov_poincare import CondensedMap
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions
from bemkit.scene.discretisation import Discretisation
from bemkit.scene.registry import DISCRETISATIONS
from bemkit.testing import CheckFailed, check_discretisation
from tests.slow import slow_except

PLUGIN = """
from dataclasses import dataclass
import numpy as np
from bemkit.geometry.spaces import LinearSpace, QuadraticSpace
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.scene.discretisation import Discretisation

@dataclass(frozen=True)
class Jumping(Discretisation):
    everywhere: bool = True

    def displacement_space(self, mesh):
        return QuadraticSpace(mesh)

    def traction_space(self, mesh):
        return LinearSpace(mesh, np.full(mesh.n_nodes, self.everywhere))

    def elastic_map(self, mesh, material, linear_solver):
        spaces = self.displacement_space(mesh), self.traction_space(mesh)
        return GalerkinElasticity(mesh, material, *spaces, linear_solver)
"""


@pytest.fixture
def plugin(here: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    (here / "bemkit_jumping.py").write_text(PLUGIN, "utf-8")
    information = here / "bemkit_jumping-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: bemkit-jumping\nVersion: 1.0\n", "utf-8")
    (information / "entry_points.txt").write_text("[bemkit.discretisations]\njumping = bemkit_jumping:Jumping\n")
    monkeypatch.syspath_prepend(here)
    yield
    sys.modules.pop("bemkit_jumping", None)


@pytest.mark.parametrize("kind", [kind for kind in DISCRETISATIONS.built_in if kind != "galerkin"])
def test_built_in_discretisations_keep_their_promises(kind: str) -> None:
    check_discretisation(DISCRETISATIONS.find(kind)())


@pytest.mark.parametrize("degree", slow_except([1, 2, 3, 4, 5, 7, 8, 10, 12], 1, 3))
def test_every_degree_keeps_its_promises(degree: int) -> None:
    check_discretisation(bk.Galerkin(degree))


def test_the_papers_collocation_keeps_its_promises() -> None:
    check_discretisation(bk.ConstantCollocation(slopes=False))


@pytest.mark.usefixtures("undrawn")
def test_one_of_ones_own_goes_all_the_way(plugin: None, capsys: pytest.CaptureFixture[str]) -> None:
    """From a scene file to the plan, the result file, the tables and the pictures."""
    text = bk.scene_to_toml(replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=24)))
    Path("own.toml").write_text(text.replace('discretisation = "constant"', 'discretisation = "jumping"'), "utf-8")
    for arguments in (
        "plan own.toml --json -",
        "run own.toml -o own.h5 --plot pictures --what deformation",
        "show own.h5 --csv - --table boundary",
    ):
        with pytest.raises(SystemExit) as end:
            main(arguments.split())
        assert end.value.code == 0
    shown = capsys.readouterr().out
    assert "quadratic displacements, linear tractions" in shown
    assert "24 (jumping)" in shown
    again = bk.read_result("own.h5")
    assert type(again.scene.discretisation).__name__ == "Jumping"
    assert len(again.boundary.traction_dofs) == 2 * 24
    assert again.work == again.plan.work
    assert {path.suffix for path in Path("pictures").iterdir()} == {".png"}


def test_one_without_a_word_is_shown_by_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    from bemkit.cli.console import print_summary

    print_summary(bk.run(replace(bk.load_scene("bending"), discretisation=Own(), mesh=bk.MeshOptions(elements=24))))
    assert "24 (Own)" in capsys.readouterr().out


@dataclass(frozen=True)
class Own(Discretisation):
    """Quadratic displacements with linear tractions that may jump at every node."""

    def displacement_space(self, mesh: bk.BoundaryMesh) -> BoundarySpace:
        """Return quadratic functions."""
        return QuadraticSpace(mesh)

    def traction_space(self, mesh: bk.BoundaryMesh) -> BoundarySpace:
        """Return linear functions without any continuity."""
        return LinearSpace(mesh, np.ones(mesh.n_nodes, bool))

    def elastic_map(
        self, mesh: bk.BoundaryMesh, material: bk.Material, linear_solver: LinearSolver
    ) -> GalerkinElasticity:
        """Return the Galerkin map of these spaces."""
        return GalerkinElasticity(
            mesh, material, self.displacement_space(mesh), self.traction_space(mesh), linear_solver
        )


class NoDataclass(Discretisation):
    displacement_space, traction_space = Own.displacement_space, Own.traction_space
    elastic_map = Own.elastic_map


@dataclass(frozen=True, eq=False)
class UnlikeItsCopy(Discretisation):
    displacement_space, traction_space = Own.displacement_space, Own.traction_space
    elastic_map = Own.elastic_map


@dataclass(frozen=True)
class Nameless(Own):
    method = ""


@dataclass(frozen=True)
class Vague(Own):
    estimates_error = None  # type: ignore[assignment]


@dataclass(frozen=True)
class OtherSpace(Own):
    def elastic_map(
        self, mesh: bk.BoundaryMesh, material: bk.Material, linear_solver: LinearSolver
    ) -> GalerkinElasticity:
        return GalerkinElasticity(mesh, material)


@dataclass(frozen=True)
class TooHigh(Own):
    estimates_error = True

    def traction_space(self, mesh: bk.BoundaryMesh) -> BoundarySpace:
        return ConstantSpace(mesh)


class Unforeseen(CollocationElasticity):
    """Predicts nothing."""

    def counts(self, conditions: NodalConditions, loads: Sequence[GivenData]) -> OperationCounts:
        """Return nothing."""
        return OperationCounts()


@dataclass(frozen=True)
class Uncounted(bk.ConstantCollocation):
    def elastic_map(self, mesh: bk.BoundaryMesh, material: bk.Material, linear_solver: LinearSolver) -> Unforeseen:
        return Unforeseen(mesh, material)


class Promising(CollocationElasticity):
    """Promises what collocation without slopes does not keep."""

    promise: Tag

    @property
    def tags(self) -> frozenset[Tag]:
        """Return one promise."""
        return frozenset({self.promise})


@dataclass(frozen=True)
class NotSymmetric(bk.ConstantCollocation):
    promise = Tag.SYMMETRIC

    def elastic_map(self, mesh: bk.BoundaryMesh, material: bk.Material, linear_solver: LinearSolver) -> Promising:
        elastic = Promising(mesh, material, slopes=False)
        elastic.promise = self.promise
        return elastic


@dataclass(frozen=True)
class Turning(NotSymmetric):
    promise = Tag.KILLS_RIGID_MOTIONS


class Distorted(CollocationElasticity):
    """Adds springs to the stiffness."""

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Return a map with forces on translations."""
        condensed = super().condense(conditions, force)
        return replace(condensed, stiffness=condensed.stiffness + 1e-3 * np.eye(len(condensed.stiffness)))


@dataclass(frozen=True)
class Springs(bk.ConstantCollocation):
    def elastic_map(self, mesh: bk.BoundaryMesh, material: bk.Material, linear_solver: LinearSolver) -> Distorted:
        return Distorted(mesh, material)


@dataclass(frozen=True)
class Softer(bk.ConstantCollocation):
    def elastic_map(
        self, mesh: bk.BoundaryMesh, material: bk.Material, linear_solver: LinearSolver
    ) -> CollocationElasticity:
        return CollocationElasticity(mesh, bk.Material(0.8 * material.youngs_modulus, material.poisson_ratio))


class Weakened(CollocationElasticity):
    """Halves the tractions of supports."""

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return half of the tractions."""
        return 0.5 * super().element_tractions(displacement, force)


@dataclass(frozen=True)
class HalfTheTractions(bk.ConstantCollocation):
    def elastic_map(self, mesh: bk.BoundaryMesh, material: bk.Material, linear_solver: LinearSolver) -> Weakened:
        return Weakened(mesh, material)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (NoDataclass(), "NoDataclass is not a dataclass"),
        (UnlikeItsCopy(), "UnlikeItsCopy does not equal its copy"),
        (Nameless(), "Nameless.method is empty"),
        (Vague(), "Vague.estimates_error is None, not a bool"),
        (OtherSpace(), "OtherSpace.displacement_space is not the displacement_space of its map"),
        (TooHigh(), r"TooHigh.estimates_error is True with .* of the degrees \(2, 0\)"),
        (Uncounted(), "Uncounted.elastic_map: its counts are .*'element_pairs': 0.*, but the run counts"),
        (NotSymmetric(), "NotSymmetric.elastic_map says it is symmetric: it differs from its transpose by"),
        (Turning(), "Turning.elastic_map says it is zero on rigid motions: a turn causes"),
        (Springs(), "Springs.elastic_map: a translation causes forces"),
        (Softer(), "Softer: displacements under uniform tension are wrong by 2.*e-01"),
        (HalfTheTractions(), "HalfTheTractions: stresses inside under uniform tension are wrong"),
    ],
    ids=lambda value: "" if isinstance(value, str) else type(value).__name__,
)
def test_broken_promises_are_found(wrong: Discretisation, message: str) -> None:
    with pytest.raises(CheckFailed, match=message):
        check_discretisation(wrong)
