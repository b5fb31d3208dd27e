"""Only what the scene needs: each run counts what its plan foresees, and touches nothing that the plan leaves out."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import pytest

import bemkit as bk
from bemkit.operators.counts import Entries, Factorisation, FactorKind, OperationCounts
from bemkit.plan.plan import make_plan
from bemkit.results.result_file import read_result, write_result
from bemkit.scene.toml import load_scene, with_overrides
from tests.slow import slow_only

LAW_OF_ITS_OWN = bk.Contact(bk.RigidHalfPlane((1.0, 0.0), (-1.0, 0.0)), law=bk.Frictionless())


def paper(word: str = "constant", **changes: object) -> bk.Scene:
    return dataclasses.replace(with_overrides(load_scene("paper-1"), elements=40, discretisation=word), **changes)


def with_part(scene: bk.Scene, name: str, condition: object) -> bk.Scene:
    parts = [dataclasses.replace(part, condition=condition) if part.name == name else part for part in scene.parts]
    return dataclasses.replace(scene, parts=tuple(parts))


def block(word: str, poisson_ratio: float = 0.3, symmetry: bk.Symmetry | None = None) -> bk.Scene:
    """A block between a frictional floor and an even load, alike left and right of x = 1."""
    parts = (
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), ("bottom",)),
        bk.Part("load", bk.Pressure(1.0), ("top",)),
    )
    scene = bk.Scene(
        title="block",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(1.0, poisson_ratio),
        parts=parts,
        law=bk.Coulomb(0.3),
        mesh=bk.MeshOptions(elements=36),
        symmetry=symmetry,
    )
    return with_overrides(scene, discretisation=word)


def disc(word: str) -> bk.Scene:
    return with_overrides(load_scene("disc-between-plates"), elements=40, discretisation=word)


def hole(word: str) -> bk.Scene:
    """A pressurised hole in the infinite plane: exterior, curved, no contact."""
    parts = (bk.Part("hole", bk.Pressure(1.0)),)
    material, mesh = bk.Material(1.0, 0.3), bk.MeshOptions(elements=24)
    shape = bk.ExteriorOf(bk.Disk(1.0))
    scene = bk.Scene(title="hole", shape=shape, material=material, parts=parts, mesh=mesh)
    return with_overrides(scene, discretisation=word)


SCENES: dict[str, Callable[[], bk.Scene]] = {
    "constant": paper,
    "linear": lambda: paper("linear"),
    "quadratic": lambda: paper("quadratic"),
    "frictionless": lambda: paper(law=bk.Frictionless()),
    "frictionless, linear": lambda: paper("linear", law=bk.Frictionless()),
    "parts of their own laws": lambda: with_part(paper(), "wall", LAW_OF_ITS_OWN),
    "no contact": lambda: with_part(paper(law=bk.Frictionless()), "foundation", bk.Clamped()),
    "no contact, quadratic": lambda: with_part(paper("quadratic", law=bk.Frictionless()), "foundation", bk.Clamped()),
    "a moved support": lambda: with_part(paper(), "wall", bk.PrescribedDisplacement(x=-1e-5)),
    "curved": lambda: disc("constant"),
    "curved, linear": lambda: disc("linear"),
    "exterior": lambda: hole("constant"),
    "exterior, quadratic": lambda: hole("quadratic"),
    "exterior, nu = 1/2": lambda: dataclasses.replace(hole("linear"), material=bk.Material(1.0, 0.5)),
    "load history": lambda: paper(load_factors=(0.5, 1.0)),
    "load history, linear": lambda: paper("linear", load_factors=(0.5, 1.0)),
    "load history from zero": lambda: paper(load_factors=(0.0, 1.0)),
    "symmetry": lambda: block("linear", symmetry=bk.Symmetry(x=1.0)),
    "symmetry, constant": lambda: block("constant", symmetry=bk.Symmetry(x=1.0)),
    "held only by contact": lambda: block("quadratic"),
    "nu = 1/2": lambda: block("linear", poisson_ratio=0.5),
    "nu = 1/2, quadratic": lambda: block("quadratic", poisson_ratio=0.5),
}


@pytest.mark.parametrize(
    "kind",
    slow_only(
        SCENES,
        "frictionless",
        "frictionless, linear",
        "load history, linear",
        "quadratic",
        "curved",
        "exterior",
        "parts of their own laws",
        "no contact, quadratic",
        "curved, linear",
        "exterior, quadratic",
        "load history",
        "symmetry, constant",
        "nu = 1/2, quadratic",
    ),
)
def test_a_run_counts_what_its_plan_foresees(kind: str) -> None:
    scene = SCENES[kind]()
    planned = make_plan(scene, scene.build_mesh()).work
    solution = bk.run(scene)
    assert solution.is_converged
    assert solution.work == solution.plan.work == planned


def test_the_counts_of_the_papers_first_example() -> None:
    """40 elements: 10 touch, 10 are on rollers, 10 carry loads in one direction; nothing else carries tractions."""
    work = make_plan(paper(), paper().build_mesh()).work
    n_rows, n_unknown = 80, 2 * 10 + 10
    n_loaded, n_held = 5 + 5, 10
    assert work.single_layer == Entries(n_rows * (n_unknown + n_loaded), n_rows * n_unknown)
    assert work.double_layer == Entries.full(n_rows, n_rows - n_held)
    assert work.hypersingular == Entries()
    assert work.element_pairs == 40**2
    assert work.factorisations == (Factorisation(FactorKind.LU, n_rows + 4),)  # three resultants and one reciprocity
    assert (work.right_hand_sides, work.contact_unknowns) == (20 + 1, 20)
    # what the exchange of columns is for: at most 70 % of the full matrices V and K are computed, 65 % stored
    assert work.single_layer.computed + work.double_layer.computed <= 0.7 * 2 * n_rows**2
    assert work.single_layer.stored + work.double_layer.stored <= 0.65 * 2 * n_rows**2


LEFT_OUT = {
    "constant": (
        "operators.forms.PairForm.__init__",
        "operators.linear_solvers.Cholesky.__init__",
        "operators.integrals.inner.far_inner",
        "operators.integrals.curved_geometry.fit",
    ),
    "linear": (
        "operators.steklov_poincare.collocation.MixedSystem._sweep",
        "operators.linear_solvers.DenseLU.__init__",
        "operators.integrals.inner.far_inner",
        "operators.integrals.curved_geometry.fit",
    ),
    "no contact": (
        "contact.dense_body.DenseBody.__init__",
        "solvers.base._Run.finish",
        "operators.forms.PairForm.__init__",
    ),
    "curved": ("operators.forms.PairForm.__init__",),
    "exterior": ("contact.dense_body.DenseBody.__init__", "operators.forms.PairForm.__init__"),
}


@pytest.mark.parametrize("kind", LEFT_OUT)
def test_what_is_left_out_is_not_touched(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in LEFT_OUT[kind]:
        monkeypatch.setattr(f"bemkit.{name}", _forbidden(name))
    assert bk.run(SCENES[kind]()).is_converged


def _forbidden(path: str) -> Callable[..., None]:
    def touched(*_: object) -> None:
        raise AssertionError(f"{path} was touched")

    return touched


def test_only_columns_that_are_needed_are_computed() -> None:
    """Full contact all round needs all of V; a held and free body without load needs none of its free columns."""
    free = with_part(with_part(paper(), "top-load", bk.Traction()), "left-load", bk.Traction())
    work, loaded = make_plan(free, free.build_mesh()).work, make_plan(paper(), paper().build_mesh()).work
    assert loaded.single_layer.computed - work.single_layer.computed == 80 * 10
    assert bk.run(free).work == work


def test_contact_has_two_unknowns_for_each_node_with_and_without_friction() -> None:
    for solution in (bk.run(SCENES[kind]()) for kind in ("constant", "frictionless")):
        assert solution.work.contact_unknowns == 2 * solution.contact.n_contact


def test_a_symmetric_half_sees_the_whole_body() -> None:
    whole, half = (bk.run(block("linear", symmetry=lines)).work for lines in (None, bk.Symmetry(x=1.0)))
    assert 2 * half.element_pairs == whole.element_pairs
    assert half.single_layer.stored == whole.single_layer.stored / 4


@pytest.mark.parametrize("discretisation", [bk.ConstantCollocation(), bk.Galerkin(1)])
def test_a_later_load_step_adds_right_hand_sides_at_most(discretisation: bk.Discretisation) -> None:
    one, two = (bk.run(paper(load_factors=factors, discretisation=discretisation)) for factors in ((1.0,), (0.5, 1.0)))
    # collocation takes the multiple of the first solution
    n_columns = 0 if isinstance(discretisation, bk.ConstantCollocation) else 1
    assert two.work == one.work + OperationCounts(right_hand_sides=n_columns)


@pytest.mark.parametrize("kind", ["constant", "load history, linear"])
def test_plan_counts_and_memory_return_from_a_file(kind: str, tmp_path: Path) -> None:
    solution = dataclasses.replace(bk.run(SCENES[kind]()), memory={"solve": 123})
    write_result(tmp_path / "result.h5", solution)
    again = read_result(tmp_path / "result.h5")
    assert (again.plan, again.work, again.memory) == (solution.plan, solution.work, {"solve": 123})
    assert again.summary()["work"] == solution.work.as_dict()
    assert again.plan.work == solution.work
