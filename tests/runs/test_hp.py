"""Degrees that rise from mesh to mesh, in geometric layers, until an accuracy is reached."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import lru_cache

import numpy as np
import pytest

import bemkit as bk
from bemkit.errors import InputError
from bemkit.geometry.meshing.division import divide
from bemkit.geometry.meshing.layers import (
    FACTOR,
    STEEPEST,
    layered_partition,
    origins,
    probing_partition,
    refined_partition,
    shortest_length,
)
from bemkit.geometry.outline import Selection
from bemkit.reference import errors_of, find_reference, sampled_fields
from bemkit.runs.adaptive import run_adaptive
from bemkit.runs.hp import LayeredMeshes, _settled
from bemkit.scene.toml import SceneError, scene_from_toml, scene_to_toml, with_overrides
from tests.scenes import true_error
from tests.slow import slow_except

EXAMPLES = ("paper-1", "paper-2", "wavy-obstacle", "disc-between-plates")


@lru_cache
def risen(name: str, accuracy: float, degree: int | None = None) -> tuple[bk.Solution, ...]:
    discretisation = bk.Galerkin(2 if degree is None else degree)
    mesh = bk.MeshOptions(accuracy=accuracy, rising_degrees=degree is None)
    return run_adaptive(dataclasses.replace(bk.load_scene(name), discretisation=discretisation, mesh=mesh))


def degree_of(solution: bk.Solution) -> int:
    return solution.scene.discretisation.displacement_space(solution.mesh).degree


def traction_error(solution: bk.Solution) -> float:
    """Return the relative error in L2 of both contact tractions against the reference."""
    reference = find_reference(solution.scene)
    assert reference is not None
    weight = np.concatenate([places.weight for places in reference.places])
    mine, exact = sampled_fields(solution, reference.places), reference.answer
    miss = (mine.sigma_n - exact.sigma_n) ** 2 + (mine.sigma_t - exact.sigma_t) ** 2
    return float(np.sqrt(weight @ miss / (weight @ (exact.sigma_n**2 + exact.sigma_t**2))))


@pytest.mark.parametrize("name", slow_except(EXAMPLES, "paper-1"))
def test_few_meshes_lead_to_five_digits(name: str) -> None:
    """Asked for 3e-5, which the estimates tell to a factor of two; the references are good to 1e-7 and better."""
    solutions = risen(name, 3e-5)
    last = solutions[-1]
    reference = find_reference(last.scene)
    assert reference is not None
    assert last.is_converged
    assert len(solutions) <= 5
    assert last.mesh.n_elements <= 100
    assert last.certificate.worst <= 1e-9
    errors = errors_of(sampled_fields(last, reference.places), reference)
    assert traction_error(last) <= 6e-5
    assert errors["energy"] <= 1e-7
    assert errors["transitions"] <= 3e-5


@pytest.mark.slow
@pytest.mark.parametrize("name", EXAMPLES)
def test_six_digits_from_scratch(name: str) -> None:
    """The logarithm of the error falls at least like -0.4 sqrt(unknowns): exponential convergence."""
    solutions = risen(name, 1e-6)
    assert solutions[-1].is_converged
    layered = [solution for solution in solutions if degree_of(solution) > 2]
    roots = [np.sqrt(solution.mesh.n_elements * degree_of(solution)) for solution in layered]
    errors = [solution.estimated_traction_error for solution in layered]
    slope = np.polyfit(roots, np.log(np.array(errors, float)), 1)[0]
    assert -1.5 < slope < -0.4
    assert traction_error(solutions[-1]) <= 2e-6


def test_layers_at_jumps_of_loads_are_not_expected_to_gain_much_by_degrees() -> None:
    """Their shortest elements are not symmetric about their middle: with that guess a fifth mesh was needed."""
    assert len(risen("paper-1", 1e-6)) == 4


@pytest.mark.parametrize("name", slow_except(EXAMPLES, "paper-1"))
def test_the_estimates_are_near_the_errors(name: str) -> None:
    """Of contact tractions, at every degree from 3 on."""
    for solution in risen(name, 3e-5):
        if degree_of(solution) > 2:
            assert solution.estimated_traction_error is not None
            assert 0.4 <= solution.estimated_traction_error / traction_error(solution) <= 2.5


@pytest.mark.slow
@pytest.mark.parametrize("name", EXAMPLES)
def test_the_estimates_of_energies_are_near_their_errors(name: str) -> None:
    """Where the bisected mesh is not too large."""
    solution = next(each for each in risen(name, 3e-5) if degree_of(each) > 4)
    assert solution.estimated_error is not None
    assert 0.3 <= solution.estimated_error / true_error(solution, 1) <= 6.0  # 5.4 on Example 2


@pytest.mark.parametrize("degree", slow_except([1, 2], 1))
@pytest.mark.parametrize("name", slow_except(EXAMPLES, "wavy-obstacle"))
def test_low_degrees_estimate_contact_tractions(name: str, degree: int) -> None:
    """On uniform meshes nearly all of the error lies where the status changes."""
    mesh = bk.MeshOptions(elements=80)
    solution = bk.run(dataclasses.replace(bk.load_scene(name), discretisation=bk.Galerkin(degree), mesh=mesh))
    assert solution.estimated_traction_error is not None
    assert 0.4 <= solution.estimated_traction_error / traction_error(solution) <= 2.5


def test_collocation_estimates_no_tractions() -> None:
    solution = bk.run(dataclasses.replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=40)))
    assert solution.estimated_traction_error is None
    assert solution.summary()["estimated_traction_error"] is None


def test_pieces_end_where_the_status_changes() -> None:
    before, solution = risen("paper-1", 3e-5)[-2:]
    for transition in before.transitions:
        distance = np.hypot(*(solution.mesh.nodes - [transition.x, transition.y]).T)
        assert distance.min() < 1e-12


def test_later_meshes_start_near_their_solution() -> None:
    *_, before, last = risen("paper-1", 3e-5)
    own_solves = last.linear_solves - sum(each.linear_solves for each in risen("paper-1", 3e-5)[:-1])
    assert own_solves <= 9  # three degrees more; from nothing 22
    assert before.linear_solves <= 7


def test_a_fixed_degree_takes_layers_alone() -> None:
    first, *later = risen("wavy-obstacle", 1e-3, degree=4)
    assert degree_of(first) == 2
    assert {degree_of(solution) for solution in later} == {4}
    assert later[-1].is_converged
    assert traction_error(later[-1]) <= 1e-3
    assert later[-1].scene.discretisation == bk.Galerkin(4)


@pytest.mark.slow
def test_a_mesh_is_not_planned_as_the_last_where_places_of_change_still_move() -> None:
    """They leave errors of 2e-5 on the first mesh that follows them: too much for 1e-5, whatever its degree."""
    assert [degree_of(solution) for solution in risen("paper-1", 5e-5)] == [2, 4, 6]
    assert len(risen("paper-1", 1e-5)) == 4


@pytest.mark.parametrize("name", slow_except(["paper-1", "paper-2"], "paper-1"))
def test_a_mesh_that_another_one_will_follow_is_as_coarse_as_that_one_allows(name: str) -> None:
    """Its degree is that from which three more suffice, and elements are divided for the places of change alone."""
    *_, third, last = risen(name, 1e-5)
    assert (degree_of(third), degree_of(last)) == ((5, 7) if name == "paper-1" else (6, 8))
    assert 1e-5 < traction_error(third) < 2e-4
    assert traction_error(last) < 1e-5


@pytest.mark.slow
def test_the_first_mesh_in_layers_is_the_last_where_it_may_be() -> None:
    """For 1e-3 on the paper's examples: a degree more than for 4e-3, and a layer more where loads jump."""
    for name, n_jumps in (("paper-1", 2), ("paper-2", 0)):
        (_, coarse, *_), (_, fine, *_) = (risen(name, accuracy) for accuracy in (4e-3, 1e-3))
        assert (degree_of(coarse), degree_of(fine)) == (4, 5)
        assert fine.mesh.n_elements == coarse.mesh.n_elements + 2 * n_jumps
        assert fine.is_converged
        assert traction_error(fine) <= 1e-3
        # on Example 2 estimates are above the accuracy, so that another mesh follows
        assert 1.0 < fine.estimated_traction_error / traction_error(fine) < 1.5
    assert [degree_of(solution) for solution in risen("paper-1", 3e-4)] == [2, 4, 5]  # too little for the first
    scene = bk.load_scene("paper-1")
    held = tuple(
        dataclasses.replace(part, condition=bk.Clamped()) if part.name == "foundation" else part for part in scene.parts
    )
    mesh = bk.MeshOptions(accuracy=3e-4, rising_degrees=True)
    no_law = dataclasses.replace(scene, law=bk.Frictionless())
    scene = dataclasses.replace(no_law, parts=held, discretisation=bk.Galerkin(2), mesh=mesh)
    # without contact tractions nothing tells
    assert [degree_of(solution) for solution in run_adaptive(scene)][:2] == [2, 4]


def test_layers_where_loads_jump() -> None:
    """Where parts end inside of a side; where the status changes there are two already."""
    where = bk.Expression("x < 0.5")
    base = divide(bk.Rectangle(1.0, 1.0).outline(), {"floor": Selection(("bottom",), where)})
    before, after = layered_partition(base, {}, n_at_jumps=2).parameters[:2]
    np.testing.assert_allclose(before, 0.5 - 0.25 * np.array([2.0, 2.0 - FACTOR, 1.0, FACTOR, FACTOR**2, 0.0]))
    np.testing.assert_allclose(after, 1.0 - before[::-1])
    cut, *_ = layered_partition(base, {0: [0.25]}, n_at_jumps=3).parameters
    assert len(cut) - 1 == 5


@pytest.mark.slow
def test_the_last_mesh_has_no_layers_for_another_one() -> None:
    """On Example 2 fewer than where there were so many: 54 elements; its places are told well enough nevertheless."""
    last = risen("paper-2", 3e-5)[-1]
    assert last.mesh.n_elements <= 50
    reference = find_reference(last.scene)
    assert reference is not None
    assert errors_of(sampled_fields(last, reference.places), reference)["transitions"] <= 3e-7


def test_what_is_smooth_takes_one_mesh() -> None:
    scene = bk.load_scene("bending")
    solutions = run_adaptive(
        dataclasses.replace(
            scene, discretisation=bk.Galerkin(2), mesh=bk.MeshOptions(rising_degrees=True, accuracy=1e-10)
        )
    )
    assert len(solutions) == 1
    assert solutions[0].is_converged


def test_high_degrees_on_wholes_agree_with_low_ones_on_halves() -> None:
    """Example 1 on one graded mesh of quartic elements, and of quadratic ones half as long: to their estimates."""
    scene = bk.load_scene("paper-1")
    mesh = risen("paper-1", 3e-5)[1].mesh
    halves = mesh.refined(np.arange(mesh.n_elements))
    quartic = bk.run(dataclasses.replace(scene, discretisation=bk.Galerkin(4)), mesh=mesh)
    quadratic = bk.run(dataclasses.replace(scene, discretisation=bk.Galerkin(2)), mesh=halves)
    assert quartic.estimated_error is not None
    assert quadratic.estimated_error is not None
    squared = quartic.estimated_error**2 + quadratic.estimated_error**2
    assert abs(quartic.energy / quadratic.energy - 1.0) <= squared
    assert quartic.estimated_error < quadratic.estimated_error


def test_layers_stand_at_ends_and_not_on_symmetry_lines() -> None:
    whole = divide(bk.Rectangle(2.0, 1.0).outline(), {})
    lengths = layered_partition(whole, {}).mesh.lengths
    np.testing.assert_allclose(lengths[:4], 2.0 * np.array([0.5 * FACTOR, 0.5 - 0.5 * FACTOR] * 2)[[0, 1, 3, 2]])
    half = layered_partition(whole.half(bk.Symmetry(x=1.0)), {})
    # the halves of bottom and top have one layer, at their corner
    assert sorted(len(s) - 1 for s in half.parameters) == [3, 3, 4]


def test_the_first_look_is_even_on_contact_parts_and_has_layers_at_their_ends() -> None:
    base = divide(bk.Rectangle(2.0, 1.0).outline(), {"floor": Selection(("bottom",))})
    floor, *others = probing_partition(base, {"floor"}, 40).parameters
    lengths = np.diff(floor)
    np.testing.assert_allclose(lengths[2:-2], lengths[2], rtol=1e-12)
    np.testing.assert_allclose(lengths[[0, -1]], FACTOR * lengths[2], rtol=1e-12)
    assert lengths.size == 14  # a share of 40 by the roots of lengths, and two layers
    assert [len(s) - 1 for s in others] == [4, 4, 4]
    floor = probing_partition(base.half(bk.Symmetry(x=1.0)), {"floor"}, 40).parameters[0]
    lengths = np.diff(floor)
    np.testing.assert_allclose(lengths[2:], lengths[2], rtol=1e-12)  # no layer on the symmetry line
    assert lengths[0] < lengths[1] < lengths[2]


def test_a_first_look_is_taken_where_layers_follow() -> None:
    """The plan says so, too; quadratic elements, whose density follows, take more of them."""
    quadratic = dataclasses.replace(
        bk.load_scene("paper-1"), discretisation=bk.Galerkin(2), mesh=bk.MeshOptions(accuracy=1e-3)
    )
    layered = dataclasses.replace(quadratic, mesh=dataclasses.replace(quadratic.mesh, rising_degrees=True))
    assert risen("paper-1", 3e-5)[0].mesh.n_elements == layered.build_mesh().n_elements
    assert layered.build_mesh().n_elements < 0.6 * quadratic.build_mesh().n_elements


def test_refinement_adds_layers_at_ends_and_halves_elsewhere() -> None:
    base = divide(bk.Rectangle(1.0, 1.0).outline(), {})
    old = layered_partition(base, {})
    excess = np.zeros(len(old.sides))
    excess[0], excess[1] = FACTOR**-1.5, 1.5  # two layers more, and a half
    fine = refined_partition(old, excess, old, 1.0)
    start, first = old.parameters[0][:2]
    expected = [start, *(first * FACTOR ** np.array([2.0, 1.0])), first, 0.5 * (first + 0.5)]
    np.testing.assert_allclose(fine.parameters[0][:5], expected, rtol=1e-12)
    # the side around the corner has followed
    ratio = (fine.mesh.lengths / np.roll(fine.mesh.lengths, 1))[np.cumsum([0, *map(len, fine.parameters[:-1])]) - 1]
    assert max(ratio.max(), 1.0 / ratio.min()) <= STEEPEST * (1.0 + 1e-9)


def test_pieces_move_with_the_places_of_the_changes() -> None:
    base = divide(bk.Rectangle(1.0, 1.0).outline(), {})
    old = layered_partition(base, {0: [0.3]})
    moved = refined_partition(old, np.zeros(len(old.sides)), layered_partition(base, {0: [0.35]}), 1.0)
    np.testing.assert_allclose(moved.parameters[0], old.parameters[0] * 0.35 / 0.3, rtol=1e-12)
    fresh = layered_partition(base, {0: [0.35, 0.6]})
    anew = refined_partition(moved, np.zeros(len(moved.sides)), fresh, 1.0)
    np.testing.assert_allclose(anew.parameters[1], fresh.parameters[1])


def test_layers_follow_places_that_move() -> None:
    """Down to a tenth of the motion on both sides of the place, and no further than the resolution."""
    base = divide(bk.Rectangle(1.0, 1.0).outline(), {})
    old, fresh = layered_partition(base, {0: [0.3]}), layered_partition(base, {0: [0.301]})
    for resolution, longest in ((1e-6, 0.1 * 1e-3), (0.01, 0.01 * 0.7)):
        moved = refined_partition(old, np.zeros(len(old.sides)), fresh, resolution)
        beside = [moved.parameters[0][-1] - moved.parameters[0][-2], moved.parameters[1][1] - moved.parameters[1][0]]
        assert max(beside) <= longest
        assert min(beside) >= FACTOR**2 * longest
        elements, layers = origins(old, moved)
        assert elements[len(moved.parameters[0]) - 2] == len(old.parameters[0]) - 2
        np.testing.assert_allclose(layers[:1], 0.0, atol=1e-12)
        assert layers.max() > 0.8


def test_free_elements_gain_by_degrees() -> None:
    """Their tractions are round-off, which does not fall, and say nothing of their error."""
    solution = next(each for each in risen("paper-1", 3e-5) if degree_of(each) > 4)
    errors, loaded = solution.body.coefficient_errors, np.concatenate(list(solution.mesh.parts.values()))
    assert errors is not None
    free = np.setdiff1d(np.arange(solution.mesh.n_elements), loaded)
    assert free.size > 5
    assert np.median(errors.energy_decay[free]) < 0.6


def test_curves_turn_little_on_an_element() -> None:
    mesh = layered_partition(divide(bk.Disk(1.0).outline(), {}), {}).mesh
    assert mesh.lengths.max() <= np.pi / 4.0 + 1e-12


def test_words_for_rising_degrees() -> None:
    scene = with_overrides(bk.load_scene("paper-1"), degree="hp", accuracy=1e-6)
    assert (scene.discretisation, scene.mesh.rising_degrees) == (bk.Galerkin(2), True)
    text = scene_to_toml(scene)
    assert 'discretisation = "hp"' in text
    assert scene_from_toml(text) == scene
    longer = text.replace('discretisation = "hp"', 'discretisation = "quadratic"')
    assert scene_from_toml(longer.replace("[mesh]", "[mesh]\nrising_degrees = true")) == scene
    assert with_overrides(bk.load_scene("paper-1"), discretisation="hp", accuracy=1e-6) == scene


def test_rising_degrees_need_an_accuracy() -> None:
    with pytest.raises(SceneError, match=r"discretisation .hp.\): degrees rise until .*: give mesh\.accuracy"):
        with_overrides(bk.load_scene("paper-1"), degree="hp")


def test_an_accuracy_beyond_round_off_is_refused() -> None:
    with pytest.raises(
        InputError, match=r"accuracy is 1e-13: round-off leaves about ten digits .*: give at least 1e-10"
    ):
        bk.MeshOptions(accuracy=1e-13)


def test_budgets_are_kept() -> None:
    scene = dataclasses.replace(
        bk.load_scene("paper-1"),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(rising_degrees=True, accuracy=1e-8, most_elements=100),
    )
    last = bk.run(scene)
    assert last.status is bk.Status.ACCURACY_NOT_REACHED
    assert "more than 100 elements would be needed; estimated error" in last.message
    assert ", of contact tractions" in last.message
    assert last.mesh.n_elements * degree_of(last) <= 200


def test_elements_of_high_degree_are_judged_without_neighbours() -> None:
    scene = bk.load_scene("bending")
    coarse = bk.MeshOptions(elements=4)
    low, high = (
        bk.run(dataclasses.replace(scene, discretisation=bk.Galerkin(degree), mesh=coarse)) for degree in (2, 4)
    )
    assert any("no error can be estimated" in warning for warning in map(str, low.warnings))
    assert high.warnings == ()
    assert high.estimated_error is not None


@pytest.mark.slow
def test_a_pressure_without_bound_takes_short_elements() -> None:
    """Beside a sheared side pressures grow like a logarithm: its tail in L2 is the root of the length of an element."""
    *_, last = risen("clamped-angle", 1e-6)
    assert last.is_converged, last.message
    assert last.mesh.lengths.min() < 1e-11
    *_, last = risen("clamped-angle", 1e-7)
    assert last.status is bk.Status.ACCURACY_NOT_REACHED
    assert "the largest error is at (1, 0), where an element of the length" in last.message
    assert last.estimated_traction_error is not None
    assert last.estimated_traction_error <= 1e-6


@pytest.mark.slow
def test_statuses_that_flicker_where_clearances_are_round_off_do_not_cost_elements() -> None:
    reached = risen("wavy-obstacle", 2e-9)[-1]
    assert reached.is_converged
    assert traction_error(reached) <= 1e-9
    # the estimate ends at 6e-10 to 1e-9, which is round-off on elements of this length: places of change are all within
    # 3e-9 of each other
    flickering = [each for each in risen("wavy-obstacle", 2e-10) if len(each.transitions) > 1]
    assert flickering
    for solution in flickering:
        assert solution.n_elements <= 80
        assert _settled([place.x for place in solution.transitions]) == pytest.approx([0.25000030], abs=1e-7)
    assert _settled([0.3, 0.1 + 1e-9, 0.3 + 4e-9, 0.1]) == pytest.approx([0.1 + 5e-10, 0.3 + 2e-9], abs=1e-15)


def test_layers_end_where_coordinates_do() -> None:
    base = divide(bk.Rectangle(1.0, 1.0).outline(), {})
    partition = layered_partition(base, {})
    for _ in range(12):  # 36 layers would be 1e-26 long
        partition = refined_partition(partition, np.full(len(partition.sides), 1e9), partition, 1.0)
        if len(partition.sides) > 2000:
            break
    assert 0.9 <= partition.mesh.lengths.min() / shortest_length(partition.mesh) <= 1.1 / FACTOR


def test_a_mesh_that_cannot_be_made_loses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def refusing(self: LayeredMeshes, level: object, solutions: object) -> None:
        raise InputError("no room")

    monkeypatch.setattr(LayeredMeshes, "following", refusing)
    scene = bk.load_scene("paper-1")
    mesh = bk.MeshOptions(accuracy=1e-6, rising_degrees=True)
    solution = bk.run(dataclasses.replace(scene, discretisation=bk.Galerkin(2), mesh=mesh))
    assert solution.status is bk.Status.ACCURACY_NOT_REACHED
    assert "no finer mesh can be made (no room)" in solution.message


BLOCK = bk.Rectangle(width=2.0, height=0.5)


def pushed(side: str, y: float) -> bk.Part:
    middle = (0.9, 1.3)
    condition = bk.PrescribedDisplacement(x=0.0, y=y)
    return bk.Part("pushed", condition, sides=(side,), where=lambda x, _: (x > middle[0]) & (x < middle[1]))


def two_blocks(accuracy: float, law: bk.FrictionLaw, degree: int | None = None) -> bk.Scene:
    """Two mirrored blocks, pressed together in the middle: their ends lift off."""
    material = bk.Material(youngs_modulus=1.0, poisson_ratio=0.3)
    upper = bk.Body(
        name="upper",
        shape=BLOCK,
        material=material,
        parts=(pushed("top", -1e-3),),
        placement=bk.Placement(shift=(0.0, 0.5)),
    )
    lower = bk.Body(name="lower", shape=BLOCK, material=material, parts=(pushed("bottom", 1e-3),))
    return bk.Scene(
        title="Two mirrored blocks",
        bodies=(upper, lower),
        contacts=(bk.ContactPair(("upper.bottom", "lower.top")),),
        law=law,
        discretisation=bk.Galerkin(degree or 2),
        mesh=bk.MeshOptions(accuracy=accuracy, rising_degrees=degree is None),
    )


def half_of_two_blocks(accuracy: float) -> bk.Scene:
    """The upper block on the plane of symmetry."""
    return bk.Scene(
        title="One of two mirrored blocks",
        shape=BLOCK,
        material=bk.Material(youngs_modulus=1.0, poisson_ratio=0.3),
        law=bk.Frictionless(),
        parts=(bk.Part("base", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)), pushed("top", -1e-3)),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(rising_degrees=True, accuracy=accuracy),
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("accuracy", "law"),
    [
        (1e-2, bk.Coulomb(0.3)),
        pytest.param(1e-3, bk.Coulomb(0.3), marks=pytest.mark.slow),
        pytest.param(1e-6, bk.Frictionless(), marks=pytest.mark.slow),
        pytest.param(1e-6, bk.Coulomb(0.3), marks=pytest.mark.slow),
    ],
)
def test_degrees_of_two_bodies_rise_together(accuracy: float, law: bk.FrictionLaw) -> None:
    """Mirrored bodies do not rub, and each is one on a frictionless plane: places of change, energies, tractions."""
    both, one = bk.run(two_blocks(accuracy, law)), bk.run(half_of_two_blocks(0.1 * accuracy))
    assert both.is_converged, both.message
    assert both.certificate.worst <= 1e-9
    assert both.estimated_traction_error is not None
    assert both.estimated_traction_error <= accuracy
    assert both.n_elements <= 300
    assert both.energy == pytest.approx(2.0 * one.energy, rel=accuracy**2)
    assert [each.x for each in both.transitions] == pytest.approx([each.x for each in one.transitions], abs=accuracy)
    size = np.abs(one.contact.sigma_n).max()
    inside = (both.contact.x > 0.7) & (both.contact.x < 1.5)  # away from where tractions have infinite slopes
    order = np.argsort(one.contact.x)
    exact = np.interp(both.contact.x[inside], one.contact.x[order], one.contact.sigma_n[order])
    assert np.abs(both.contact.sigma_n[inside] - exact).max() <= 0.02 * size  # both between nodes


@pytest.mark.parametrize("is_found", slow_except([True, False], False), ids=["found", "named"])
def test_all_meshes_have_the_multipliers_on_one_side(is_found: bool) -> None:
    """Of two half discs of nearly the same radius, the finer one of which changes from mesh to mesh."""
    material, cut = bk.Material(1.0, 0.3), ("start", "end")
    held = bk.Part("held", bk.Clamped(), cut)
    pressed = bk.Part("pressed", bk.PrescribedDisplacement(0.0, -0.04), cut)
    shape = bk.Sector(1.02, 0.0, 180.0, (0.0, -1.02))
    lower = bk.Body(name="lower", shape=shape, material=material, parts=(held,))
    shape = bk.Sector(1.0, 180.0, 360.0, (0.0, 1.0))
    upper = bk.Body(name="upper", shape=shape, material=material, parts=(pressed,))
    pair = bk.ContactPair(("lower.arc", "upper.arc"))
    scene = bk.Scene(
        title="two discs", bodies=(lower, upper), contacts=(pair,), law=bk.Frictionless(),
        discretisation=bk.Galerkin(2), mesh=bk.MeshOptions(accuracy=3e-2, rising_degrees=True),
    )  # fmt: skip
    name = pair.name
    if is_found:
        scene, name = dataclasses.replace(scene, contacts=(), touching=bk.Touching(0.05)), "upper.arc / lower.arc"
    solutions = run_adaptive(scene)
    assert len(solutions) > 2
    assert {solution.contact_sides[name][0].body for solution in solutions} == {"upper"}


@pytest.mark.slow
def test_a_bolt_in_a_plate_needs_few_elements_for_five_digits() -> None:
    """Curved sides with friction: places and energies settle faster than the accuracy asked for."""
    plate = bk.load_scene("pin-in-plate")
    rough, fine = (
        bk.run(
            dataclasses.replace(
                plate, discretisation=bk.Galerkin(2), mesh=bk.MeshOptions(rising_degrees=True, accuracy=accuracy)
            )
        )
        for accuracy in (1e-4, 1e-5)
    )
    assert fine.is_converged
    assert fine.n_elements <= 300
    assert rough.energy == pytest.approx(fine.energy, rel=1e-8)
    # 1e-4 of the zone, as accurate as the tractions
    assert [each.s for each in rough.transitions] == pytest.approx([each.s for each in fine.transitions], abs=2e-5)


@pytest.mark.slow
def test_copies_have_one_mesh_as_fine_as_the_worst_needs() -> None:
    """Two feet on a base that a wall holds at one end: the pressures of the feet differ, and their mesh is one."""
    material = bk.Material(youngs_modulus=1.0, poisson_ratio=0.3)
    base = bk.Body(
        name="base",
        shape=bk.Rectangle(width=3.0, height=0.5),
        material=material,
        parts=(bk.Part("wall", bk.Clamped(), sides=("left",)), bk.Part("ground", bk.Roller(), sides=("bottom",))),
    )
    foot = bk.Body(
        name="foot",
        shape=bk.Rectangle(width=0.5, height=0.5),
        material=material,
        parts=(bk.Part("load", bk.Pressure(1e-3), sides=("top",)),),
        placement=bk.Placement(shift=(0.5, 0.5)),
        copies=bk.GridCopies(2, 1, (1.2, 0.0)),
    )
    feet = bk.Scene(
        title="Two feet",
        bodies=(base, foot),
        touching=bk.Touching(within=1e-9),
        law=bk.Coulomb(0.5),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(rising_degrees=True, accuracy=1e-2),
    )
    solution = bk.run(feet)
    assert solution.is_converged, solution.message
    _, one, two = solution.bodies.values()
    np.testing.assert_allclose(one.mesh.lengths, two.mesh.lengths, rtol=1e-12)
    assert one.energy != pytest.approx(two.energy, rel=1e-6)
    quadratic = bk.run(dataclasses.replace(feet, discretisation=bk.Galerkin(2)))
    assert solution.energy == pytest.approx(quadratic.energy, rel=2e-4)  # the square of both accuracies


def filled_hole(accuracy: float) -> bk.Scene:
    """A quarter of a plate under pressure whose hole is filled by a disc of its material: uniform stress."""
    material = bk.Material(youngs_modulus=1.0, poisson_ratio=0.3)
    sides = ("bottom", "right", "top", "left")
    hole = bk.Part("hole", bk.Free(), ("hole-1", "hole-2", "hole-3", "hole-4"))
    rim = bk.Part("rim", bk.Free(), ("arc-1", "arc-2", "arc-3", "arc-4"))
    plate = bk.Body(
        name="plate",
        shape=bk.PlateWithHole(4.0, 4.0, 1.0, corner=(-2.0, -2.0)),
        material=material,
        parts=(hole, bk.Part("load", bk.Pressure(1.0), sides)),
    )
    return bk.Scene(
        title="filled hole",
        bodies=(plate, bk.Body(name="disc", shape=bk.Disk(1.0), material=material, parts=(rim,))),
        contacts=(bk.ContactPair(("disc.rim", "plate.hole")),),
        law=bk.Coulomb(0.3),
        symmetry=bk.Symmetry(x=0.0, y=0.0),
        mesh=bk.MeshOptions(accuracy=accuracy, rising_degrees=True),
    )


def press_fit(accuracy: float) -> bk.Scene:
    """Two whole rings of different materials, one 1e-3 too large for the other; the outer one is held on its rim."""
    held = bk.PrescribedDisplacement(bk.Expression("3e-4 * x"), bk.Expression("3e-4 * y"))
    inner = bk.Body(name="inner", shape=bk.Ring(0.5, 1.0), material=bk.Material(1.0, 0.3))
    outer = bk.Body(name="outer", shape=bk.Ring(1.0, 2.0), material=bk.Material(0.5, 0.2))
    out = bk.Part("fit", bk.Free(), ("outer-1", "outer-2", "outer-3", "outer-4"))
    rim = bk.Part("rim", held, ("outer-1", "outer-2", "outer-3", "outer-4"))
    inside = bk.Part("fit", bk.Free(), ("inner-1", "inner-2", "inner-3", "inner-4"))
    return bk.Scene(
        title="press fit",
        bodies=(dataclasses.replace(inner, parts=(out,)), dataclasses.replace(outer, parts=(inside, rim))),
        contacts=(bk.ContactPair(("inner.fit", "outer.fit"), gap=-1e-3),),
        law=bk.Coulomb(0.2),
        mesh=bk.MeshOptions(accuracy=accuracy, rising_degrees=True),
    )


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", [1e-2, 1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("scene", [filled_hole, press_fit])
def test_uniform_pressures_between_bodies_are_as_accurate_as_asked(
    scene: Callable[[float], bk.Scene], accuracy: float
) -> None:
    """The first look has no estimate of traction errors: a missing one is never small."""
    solution = bk.run(scene(accuracy))
    assert solution.is_converged, solution.message
    assert solution.estimated_traction_error is not None
    assert solution.estimated_traction_error <= accuracy
    table = solution.contact
    pressure = -float(table.weight @ table.sigma_n / table.weight.sum())
    miss = (table.sigma_n + pressure) ** 2 + table.sigma_t**2
    assert np.sqrt(table.weight @ miss / table.weight.sum()) <= accuracy * pressure
    if scene is filled_hole:
        assert pressure == pytest.approx(1.0, rel=accuracy)


def test_degrees_of_bodies_do_not_rise_in_histories() -> None:
    history = dataclasses.replace(two_blocks(1e-3, bk.Frictionless()), load_factors=(0.5, 1.0))
    with pytest.raises(InputError, match="discretisation is 'hp', and there are 2 load steps"):
        bk.run(history)


@pytest.mark.slow
def test_errors_that_spread_from_a_corner_lead_to_layers_there() -> None:
    """Beside a corner where pressures have no bound, no degree and no halves make an error small."""
    last = risen("wedged-leg", 1e-5)[-1]
    assert last.is_converged
    assert last.n_elements <= 120
    (tip, following), *_ = next(corner for corner in last.singular_corners if corner.x == 0.0).beside(last.mesh)
    assert last.mesh.lengths[tip] <= 2e-4 * last.part_length("foot")
    assert last.body.coefficient_errors is not None
    assert last.body.coefficient_errors.traction_decay[following] < 0.6


def test_an_error_beside_a_corner_raises_the_degree_where_no_element_asks_for_it() -> None:
    """A quarter of a block between two others: that error alone was above the accuracy, on one mesh after the other."""
    below = bk.Body(
        name="below",
        shape=bk.Rectangle(1.0, 1.0, (-0.5, -1.5)),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("base", bk.PrescribedDisplacement(0.0, 0.01), ("bottom",)),),
    )
    squeezed = bk.Scene(
        title="Squeezed block",
        law=bk.Coulomb(0.2),
        discretisation=bk.Galerkin(2),
        symmetry=bk.Symmetry(x=0.0, y=0.0),
        mesh=bk.MeshOptions(accuracy=1e-3, rising_degrees=True),
        bodies=(
            bk.Body(name="middle", shape=bk.Rectangle(2.0, 1.0, (-1.0, -0.5)), material=bk.Material(1.0, 0.2)),
            below,
        ),
        contacts=(bk.ContactPair(("below.top", "middle.bottom")),),
    )
    *_, before, last = run_adaptive(squeezed)
    assert last.is_converged, last.message
    assert last.estimated_traction_error is not None
    assert last.estimated_traction_error <= 1e-3
    assert last.n_elements == before.n_elements
    assert last.places.lowest_degree == before.places.lowest_degree + 1
