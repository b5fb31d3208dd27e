"""Friction laws in scene files: formulas for coefficients, a law for each part."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.further_laws import PiecewiseLaw
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.scene.toml import SceneError, scene_from_toml, scene_to_toml, shipped_files
from tests.scene.test_load_history import block

PAPER_1 = shipped_files()["paper-1"].read_text("utf-8").replace("elements = 320", "elements = 60")
COEFFICIENT = "friction_coefficient = 0.5"
WALL = 'condition = "roller"'
OBSTACLE = "{ kind = 'half-plane', point = [1.0, 0.0], normal = [-1.0, 0.0] }"


def test_a_formula_for_the_coefficient() -> None:
    text = PAPER_1.replace(COEFFICIENT, 'friction_coefficient = "where(x < 0.5, 0.2, 0.8)"')
    scene = scene_from_toml(text)
    assert scene_from_toml(scene_to_toml(scene)).law.friction_coefficient == bk.Expression("where(x < 0.5, 0.2, 0.8)")
    solution = bk.run(scene)
    contact = solution.contact
    coefficient = np.where(contact.x < 0.5, 0.2, 0.8)
    slips = np.array(contact.status_words()) == "slip"
    assert slips.any()
    np.testing.assert_allclose(np.abs(contact.sigma_t[slips]), (coefficient * -contact.sigma_n)[slips], rtol=1e-9)
    assert np.all(np.abs(contact.sigma_t) <= coefficient * -contact.sigma_n + 1e-9)


@pytest.mark.parametrize("discretisation", [bk.Galerkin(1), bk.ConstantCollocation()])
def test_one_number_for_each_contact_node_is_as_the_formula_there(discretisation: bk.Discretisation) -> None:
    scene = dataclasses.replace(scene_from_toml(PAPER_1), discretisation=discretisation)
    formula = bk.run(dataclasses.replace(scene, law=bk.Coulomb(lambda x, y: 0.2 + x)))
    listed = bk.run(dataclasses.replace(scene, law=bk.Coulomb(0.2 + formula.contact.x)))
    np.testing.assert_array_equal(listed.contact.sigma_t, formula.contact.sigma_t)
    assert (listed.contact.sigma_t != 0.0).any()
    one, other = (solution.contacts_between_nodes["foundation"].cone_excess for solution in (listed, formula))
    assert one == pytest.approx(other, rel=0.2)  # beyond the last nodes their numbers are kept
    assert [warning.kind for warning in listed.warnings] == [warning.kind for warning in formula.warnings]


@pytest.mark.parametrize(
    "law", [bk.Tresca(bk.Expression("0.3 * x")), bk.CohesiveCoulomb(0.4, 0.0, bk.Expression("0.1 + x"))]
)
def test_formulas_for_stresses_are_in_the_users_units(law: bk.FrictionLaw) -> None:
    solution = bk.run(dataclasses.replace(scene_from_toml(PAPER_1), law=law))
    contact = solution.contact
    assert solution.is_converged
    at_nodes = law.at(np.stack([contact.x, contact.y], axis=1)).bound(contact.sigma_n)
    slips = np.array(contact.status_words()) == "slip"
    np.testing.assert_allclose(np.abs(contact.sigma_t[slips]), at_nodes[slips], rtol=1e-9)
    assert slips.any()


def test_each_part_may_have_its_own_law() -> None:
    law = "{ kind = 'coulomb', friction_coefficient = 0.1 }"
    condition = f"condition = {{ kind = 'contact', obstacle = {OBSTACLE}, law = {law} }}"
    scene = scene_from_toml(PAPER_1.replace(WALL, condition))
    assert scene_from_toml(scene_to_toml(scene)).parts[1].condition.law.friction_coefficient == 0.1
    model = build_model(prepare(scene, scene.build_mesh()))
    parts = model.prepared.names
    assert isinstance(model.problem.law, PiecewiseLaw)
    expected = np.where(np.array(parts) == "foundation", 0.5, 0.1)
    np.testing.assert_array_equal(model.problem.friction_bound(np.full(len(parts), -1.0)), expected)
    solution = bk.run(scene)
    assert solution.is_converged
    wall = np.array(solution.contact.part) == "wall"
    pressed = wall & (solution.contact.sigma_n < -1e-9)
    assert pressed.any()
    assert np.all(np.abs(solution.contact.sigma_t[pressed]) <= 0.1 * -solution.contact.sigma_n[pressed] * (1 + 1e-9))
    # a frictionless wall, either by its own law or as a roller that happens to stay in touch, gives one answer
    frictionless = scene_from_toml(PAPER_1.replace(WALL, condition.replace(law, "'frictionless'")))
    assert {
        type(law).__name__ for law in build_model(prepare(frictionless, frictionless.build_mesh())).problem.law.laws
    } == {
        "Coulomb",
        "Frictionless",
    }
    assert "Coulomb, static" in str(bk.run(frictionless).plan.as_dict())


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ('"0.5 - x"', r"part 'foundation': friction law: friction_coefficient = .* is -0\.\d+ at \(x, y\)"),
        ('"log(x - 2)"', r"part 'foundation': friction law: .*log"),
    ],
)
def test_bad_values_name_part_and_place(value: str, message: str) -> None:
    scene = scene_from_toml(PAPER_1.replace(COEFFICIENT, f"friction_coefficient = {value}"))
    with pytest.raises(ValueError, match=message):
        bk.run(scene)


@pytest.mark.parametrize("value", ['"z"', "true", '"x > 0.5"', "-0.5"])
def test_what_is_no_coefficient_is_refused_at_once(value: str) -> None:
    with pytest.raises(SceneError, match="friction_coefficient"):
        scene_from_toml(PAPER_1.replace(COEFFICIENT, f"friction_coefficient = {value}"))


def test_load_factors_in_files() -> None:
    text = PAPER_1.replace("[law]", "load_factors = [0.5, 1.0]\n[law]")
    scene = scene_from_toml(text)
    assert scene.load_factors == (0.5, 1.0)
    assert scene_from_toml(scene_to_toml(scene)).load_factors == (0.5, 1.0)
    for wrong in ("[]", "[inf]", "1.0"):
        with pytest.raises(SceneError, match="load_factors"):
            scene_from_toml(PAPER_1.replace("[law]", f"load_factors = {wrong}\n[law]"))


def test_plots_show_the_bound_of_each_part() -> None:
    from bemkit.pictures import draw_contact_traction

    scene = block(law=bk.Coulomb(bk.Expression("0.2 + x")))
    axes = draw_contact_traction(bk.run(scene), "floor")
    labels = [line.get_label() for line in axes.lines]
    assert "friction bound" in labels
