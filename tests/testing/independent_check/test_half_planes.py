"""Half-planes in the stability suite: similar scenes, evidence of their own, axes that say something of them."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import bemkit as bk
from bemkit.geometry.meshing.discretise import Geometric
from bemkit.operators.half_plane.flexibility import mean_logarithms
from bemkit.studies.engine import StudyError
from bemkit.studies.stability.axes import AXES, find_axes
from bemkit.studies.stability.similarity import Similarity
from bemkit.studies.stability.sweep import TWIN, difference, solve_and_judge, sweep
from bemkit.studies.stability.transform import with_turned_loads
from bemkit.testing.independent_check import Violations, violations_of
from bemkit.testing.independent_check.bodies import bodies_of
from bemkit.testing.independent_check.half_plane import Surface
from tests.slow import slow_except, slow_only
from tests.testing.independent_check.company import first_body, in_company, with_body

SIMILARITY = Similarity(length=3.0, modulus=70.0, stress=11.0, shift=(5.0, -7.0))
BUMP = bk.Gap(bk.Expression("0.1 * x**2"))
PUNCH = bk.Scene(
    title="a bump, a bonded punch and loads beside them",
    shape=bk.ElasticHalfPlane(-1.0, 1.5),
    material=bk.Material(1.0, 0.3, bk.Plane.STRESS),
    law=bk.Coulomb(0.3),
    parts=(
        bk.Part("zone", bk.Contact(BUMP), where=bk.Expression("x < 0.3")),
        bk.Part("held", bk.PrescribedDisplacement(x=0.002, y=0.01), where=bk.Expression("x > 1.2")),
        bk.Part("load", bk.Traction(0.01, bk.Expression("-0.01 * x")), where=bk.Expression("x > 0.5 and x < 0.9")),
    ),
    far=bk.FarField(x=0.01, y=0.05, turn=0.01, centre=(0.3, -2.0)),
    mesh=bk.MeshOptions(elements=60),
)
GRADED = replace(PUNCH, mesh=bk.MeshOptions(elements=40, grading=Geometric(0.2, 6)))
TIP = bk.Part("zone", bk.Contact(bk.Gap(bk.Expression("2 * x**2"))), where=bk.Expression("x < 0.3"))
DRIVEN = replace(
    PUNCH,
    law=bk.Coulomb(0.5),
    parts=(TIP, PUNCH.parts[2]),
    far=bk.FarField(force_x=0.002, force_y=0.05, moment=0.001, centre=(-0.1, -0.2)),
)
WAVY = replace(bk.load_scene("rough-surface"), mesh=bk.MeshOptions(elements=128))
MOVED = replace(WAVY, far=bk.FarField(x=1e-3, y=2e-3))
SCENES = {"punch": PUNCH, "graded": GRADED, "driven": DRIVEN, "rough": WAVY, "rough, moved": MOVED}


AMONG = {"punch": "punch, one of several", "driven": "driven, one of several"}


@lru_cache
def solved(name: str) -> bk.Solution:
    return bk.run(SCENES[name] if name in SCENES else in_company(SCENES[name.split(",")[0]]))


@pytest.mark.parametrize("similarity", slow_only([SIMILARITY, TWIN], TWIN), ids=["moved", "twin"])
@pytest.mark.parametrize("name", slow_only(SCENES, "rough", "graded"))
def test_results_of_a_similar_half_plane_follow_by_its_factors(name: str, similarity: Similarity) -> None:
    one, other = solved(name), bk.run(similarity.apply(SCENES[name]))
    assert one.is_converged
    assert np.ptp(one.contact.status) > 0
    # round-off times the ratio of the longest element to the shortest
    assert difference(one, other, similarity) <= 1e-10
    assert other.linear_solves == one.linear_solves
    energy = one.energy * similarity.stress * similarity.displacement * similarity.length
    assert other.energy == pytest.approx(energy, rel=1e-9)
    force = one.force_normal * similarity.stress * similarity.length
    assert other.force_normal == pytest.approx(force, rel=1e-9)


def test_a_load_far_away_turns_where_no_motion_is_given() -> None:
    turned = with_turned_loads(replace(PUNCH, far=bk.FarField(force_x=3.0, force_y=4.0, turn=0.1)), np.pi / 2.0)
    assert turned.far is not None
    np.testing.assert_allclose(turned.far.load, [-4.0, 3.0, 0.0], atol=1e-15)
    assert turned.far.turn == 0.1
    held = with_turned_loads(replace(PUNCH, far=bk.FarField(x=0.2, force_y=4.0)), np.pi / 3.0)
    assert held.far is not None
    np.testing.assert_allclose((*held.far.motion, *held.far.load), [0.2, 0.0, 0.0, 0.0, 2.0, 0.0], atol=1e-15)


@pytest.mark.parametrize("name", SCENES)
def test_right_answers_pass(name: str) -> None:
    check = violations_of(solved(name))
    assert check.worst <= 1e-11  # 1e-11 is what iterations for periodic ones stop at
    assert not check.needs_warning


def test_round_off_along_a_motion_that_no_force_drives_is_no_imbalance() -> None:
    floor = bk.Part("floor", bk.Contact(bk.Gap(direction=(-0.18173651760084097, 1.0))))
    scene = replace(WAVY, parts=(floor,), law=bk.Coulomb(0.2), far=bk.FarField(force_x=0.0, force_y=3434.5553035285857))
    solution = bk.run(replace(scene, mesh=bk.MeshOptions(elements=32)))
    assert np.abs(solution.boundary.traction[:, 0]).max() > 0.0  # round-off, which alone would be all out of balance
    assert violations_of(solution).worst <= 1e-11
    far = replace(scene.far, force_x=1.0)
    assert changed(solution, scene=replace(first_body(solution).scene, far=far)).equilibrium > 1e-5


@pytest.mark.parametrize(
    "place",
    [np.linspace(0.0, 1.0, 30), np.cumsum(0.4 ** np.arange(12.0)), np.array([0.0, 1.0, 1.001, 1.5, 1.5001, 7.0])],
    ids=["equal", "graded", "uneven"],
)
def test_mean_logarithms_are_those_of_the_closed_form(place: np.ndarray) -> None:
    lengths, middles = np.diff(place), 0.5 * (place[1:] + place[:-1])
    surface = replace(Surface.of(bodies_of(solved("punch"), None)[""]), lengths=lengths, place=middles)
    found = np.array([surface._logarithms(element) for element in range(lengths.size)])
    expected = mean_logarithms(place / (place[-1] - place[0]))
    np.testing.assert_allclose(found, expected, atol=1e-9)  # what the rule leaves


def changed(solution: bk.Solution, **changes: object) -> Violations:
    return violations_of(with_body(solution, **changes))


def with_boundary(solution: bk.Solution, **fields: np.ndarray) -> Violations:
    boundary = first_body(solution).boundary
    traction = fields.get("traction", boundary.traction).copy()  # constant on each element
    return changed(solution, boundary=replace(boundary, traction_dofs=traction, **fields))


@pytest.mark.parametrize("name", slow_except([*SCENES, *AMONG.values()], "punch"))
def test_each_violation_is_seen_under_its_name(name: str) -> None:
    solution = solved(name)
    assert violations_of(solution).is_good
    body = first_body(solution)
    boundary, scene = body.boundary, body.scene
    pressed = int(np.argmin(boundary.traction[:, 1]))
    traction, displacement = boundary.traction.copy(), boundary.displacement.copy()
    traction[pressed, 1] *= 1.001
    assert "elasticity" in with_boundary(solution, traction=traction).faults
    displacement[pressed, 0] += 1e-4 * np.ptp(displacement[:, 0])
    assert "elasticity" in with_boundary(solution, displacement=displacement).faults
    mirrored = boundary.traction * np.array([-1.0, 1.0])
    assert "elasticity" in with_boundary(solution, traction=mirrored).faults
    for material in (bk.Material(1.001, 0.3, scene.material.plane), bk.Material(1.0, 0.301, scene.material.plane)):
        assert "elasticity" in changed(solution, scene=replace(scene, material=material)).faults
    assert changed(solution, energy=1.001 * body.energy).faults == ("energy",)
    assert set(changed(solution, energy=-body.energy).faults) == {"energy", "negative_energy"}


@pytest.mark.slow
def test_a_driven_half_plane_balances_and_a_given_motion_is_met() -> None:
    for name in ("driven", "rough"):
        scene = first_body(solved(name)).scene
        for key in ("force_x", "force_y", "moment"):
            load = getattr(scene.far, key)
            if load is not None:
                far = replace(scene.far, **{key: load + 1e-4 * scene.far.force_y})
                assert changed(solved(name), scene=replace(scene, far=far)).faults == ("equilibrium",)
    for name in ("punch", "rough, moved"):
        scene = first_body(solved(name)).scene
        for key in ("x", "y", "turn"):
            motion = getattr(scene.far, key)
            if motion is not None:
                far = replace(scene.far, **{key: 1.0001 * motion})
                # without its part far away the body is strained by other displacements
                assert "elasticity" in changed(solved(name), scene=replace(scene, far=far)).faults


@pytest.mark.slow
def test_of_many_elements_some_displacements_are_looked_at_and_all_tractions() -> None:
    solution = bk.run(replace(WAVY, mesh=bk.MeshOptions(elements=600)))
    surface = Surface.of(bodies_of(solution, None)[""])
    assert surface.seen.size < 450
    assert violations_of(solution).is_good
    for element in np.flatnonzero(solution.boundary.traction[:, 1])[::40]:
        traction = solution.boundary.traction.copy()
        traction[element] *= 1.01
        assert "elasticity" in with_boundary(solution, traction=traction).faults


def names_against(scene: bk.Scene) -> list[str]:
    """Return the axes of one body that say nothing of a scene."""
    return [axis.name for axis in AXES if axis.reason_against(scene) not in ("", "it is about several bodies")]


def test_axes_say_where_they_say_nothing() -> None:
    assert names_against(PUNCH) == ["degenerate-size", "aspect-ratio"]
    assert names_against(WAVY) == ["degenerate-size", "aspect-ratio", "grading"]
    assert names_against(bk.load_scene("paper-1")) == []
    with pytest.raises(
        StudyError, match=r"axis 'aspect-ratio' does not apply to this scene: .* no thickness .*; remove it"
    ):
        list(sweep(PUNCH, find_axes(["aspect-ratio"])))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["driven", "rough"])
def test_no_row_is_wrong_along_axes_that_say_something(name: str) -> None:
    baseline = bk.run(replace(SCENES[name], mesh=bk.MeshOptions(elements=32)))
    for axis in AXES:
        if axis.reason_against(baseline.scene) or axis.name.startswith("rho"):
            continue
        case = axis.make(baseline, axis.values[1])
        row = solve_and_judge(axis.name, case, baseline if axis.reference is None else None)
        assert row.verdict in ("right", "named"), (axis.name, row.message)


@pytest.mark.slow
def test_a_half_plane_is_pushed_to_the_edge_of_sliding() -> None:
    baseline = bk.run(replace(WAVY, mesh=bk.MeshOptions(elements=64)))
    (axis,) = find_axes(["sliding"])
    for value, verdict in ((0.5, "right"), (0.9999, "right"), (1.01, "named")):
        case = axis.make(baseline, value)
        assert solve_and_judge("sliding", case, None).verdict == verdict


def test_a_half_plane_among_several_bodies_is_checked_too() -> None:
    press = bk.Part("top", bk.Traction(0.0, -1e-3), sides=("top",))
    material = bk.Material(1.0, 0.3)
    base = bk.Body(
        name="base", shape=bk.ElasticHalfPlane(-2.0, 2.0), material=material, parts=(), mesh=bk.MeshOptions(30)
    )
    shape = bk.Rectangle(1.0, 0.5, (-0.4, 0.0))
    block = bk.Body(name="block", shape=shape, material=material, parts=(press,), mesh=bk.MeshOptions(40))
    contacts = (bk.ContactPair(("block.bottom", "base.surface")),)
    solution = bk.run(bk.Scene(title="block", bodies=(base, block), contacts=contacts, law=bk.Coulomb(0.5)))
    assert violations_of(solution).worst <= 1e-11
    result = solution.bodies["base"]
    displacement = result.boundary.displacement.copy()
    displacement[3, 1] *= 1.001  # away from contact, where nothing else looks
    moved = replace(result, boundary=replace(result.boundary, displacement=displacement))
    seen = violations_of(replace(solution, bodies={**solution.bodies, "base": moved}))
    assert seen.faults == ("elasticity",)


@pytest.mark.parametrize(("elements", "is_warned"), [(18, True), (72, False)])
def test_half_planes_say_where_only_the_mean_of_a_load_acts(elements: int, is_warned: bool) -> None:
    """A load that has no mean would vanish without a word; the check knows how large its round-off is."""
    load = bk.Part("load", bk.Traction(y=bk.Expression("x - 1 / 36")), where=bk.Expression("x > 0 and x < 1 / 18"))
    contact = bk.Part("contact", bk.Contact(bk.Gap(1.0)), where=bk.Expression("x < -2 / 9"))
    scene = bk.Scene(
        title="twisted",
        shape=bk.PeriodicHalfPlane(1.0, -0.5),
        material=bk.Material(1e3, 0.3),
        parts=(load, contact),
        mesh=bk.MeshOptions(elements),
    )
    solution = bk.run(scene)
    found = [warning.text for warning in solution.warnings if warning.kind == "load on a single element"]
    text = "Only the mean of the load acts on the element of part 'load': use more elements there."
    assert found == [text] * is_warned
    assert violations_of(solution).is_good
