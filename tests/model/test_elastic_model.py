"""Scenes without contact: one linear solve, its certificate, and everything that can be asked of the result."""

from __future__ import annotations

import json
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import FloatArray, IntArray
from bemkit.cli.console import print_summary
from bemkit.errors import InputError
from bemkit.model.contact_free_body import certified, contact_free_state
from bemkit.model.free_motion import FreeBodyError
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.operators.steklov_poincare import CondensedMap
from bemkit.pictures import draw_boundary_traction
from bemkit.pictures.catalogue import default_pictures
from bemkit.results.result_file import read_result, write_result
from bemkit.results.solution import Solution
from bemkit.results.tables import to_csv, to_json
from bemkit.runs.distinct_solutions import distinct_solutions
from bemkit.runs.nested import run_nested
from bemkit.scene.discretisation import Discretisation
from bemkit.scene.toml import SceneError, scene_from_toml, scene_to_toml
from bemkit.solvers.base import StepRecord
from bemkit.studies.engine import StudyError
from bemkit.studies.stability.axes import find_axes
from bemkit.studies.stability.sweep import sweep

CURVATURE, NU, MODULUS = 2e-3, 0.3, 1000.0 / (1.0 - 0.3**2)


def bending(discretisation: Discretisation | None = None, n_elements: int = 40) -> bk.Scene:
    scene = bk.load_scene("bending")
    discretisation = scene.discretisation if discretisation is None else discretisation
    return replace(scene, discretisation=discretisation, mesh=bk.MeshOptions(elements=n_elements))


@pytest.fixture(scope="module")
def bent() -> Solution:
    return bk.run(bending())


def exact(points: FloatArray) -> FloatArray:
    x, y = points.T
    return np.stack([-CURVATURE * x * y, 0.5 * CURVATURE * (x**2 + NU / (1.0 - NU) * y**2)], axis=1)


def miss(solution: Solution) -> float:
    answer = exact(solution.boundary.points)
    return float(np.abs(solution.boundary.displacement - answer).max() / np.abs(answer).max())


def plate(*parts: bk.Part, shape: object = None) -> bk.Scene:
    return bk.Scene(
        title="plate",
        shape=bk.Rectangle(2.0, 1.0) if shape is None else shape,  # type: ignore[arg-type]
        material=bk.Material(1.0, 0.3),
        parts=parts,
        mesh=bk.MeshOptions(elements=24),
    )


def test_bending_is_exact_on_quadratic_elements(bent: Solution) -> None:
    assert bent.status is bk.Status.CONVERGED
    assert bent.message.startswith("All forces are in equilibrium")
    assert miss(bent) < 1e-11  # displacements are quadratic, tractions linear: only round-off is left
    assert bent.energy == pytest.approx(4.0 * MODULUS * CURVATURE**2 / 24.0, rel=1e-11)
    normal = bent.boundary.traction[:, 0] * bent.mesh.normals[:, 0]
    ends = np.abs(bent.mesh.normals[:, 0]) > 0.5
    np.testing.assert_allclose(normal[ends], -MODULUS * CURVATURE * bent.mesh.centres[ends, 1], atol=1e-10)
    assert bent.certificate.worst < 1e-12


@pytest.mark.parametrize(("discretisation", "ceiling"), [(bk.Galerkin(1), 1e-3), (bk.ConstantCollocation(), 0.12)])
def test_bending_on_simpler_elements(discretisation: Discretisation, ceiling: float) -> None:
    coarse, fine = (bk.run(bending(discretisation, n)) for n in (40, 80))
    assert coarse.is_converged
    assert miss(coarse) < ceiling
    assert miss(fine) < 0.6 * miss(coarse)  # second order away from the corners, first order at worst


def test_stress_inside_is_that_of_bending(bent: Solution) -> None:
    points = np.array([[1.0, 0.2], [2.0, 0.0], [3.0, -0.3]])
    stress = bk.interior_fields(bent).stress(points)
    # the tractions of the solution are linear, as those of bending are: only round-off is left
    np.testing.assert_allclose(stress[:, 0, 0], -MODULUS * CURVATURE * points[:, 1], atol=1e-9)
    np.testing.assert_allclose(stress[:, 0, 1], 0.0, atol=1e-9)


def test_tractions_are_kept_as_dofs_of_their_space(bent: Solution) -> None:
    boundary, mesh = bent.boundary, bent.mesh
    at_ends = boundary.traction_dofs.reshape(mesh.n_elements, 2, 2)
    y = np.stack([mesh.start[:, 1], mesh.end[:, 1]], axis=1)
    np.testing.assert_allclose(at_ends[..., 0], -MODULUS * CURVATURE * y * mesh.normals[:, :1], atol=1e-9)
    np.testing.assert_allclose(at_ends.mean(axis=1), boundary.traction, atol=1e-14)
    assert not boundary.traction_dofs.flags.writeable
    constant = bk.run(bending(bk.Galerkin(1)))
    np.testing.assert_array_equal(constant.boundary.traction_dofs, constant.boundary.traction)


def test_fields_of_a_symmetric_half_take_its_tractions() -> None:
    """A quarter of a plate under a load that grows towards the middle of its sides."""
    loads = tuple(
        bk.Part(side, bk.Traction(x=bk.Expression(f"{sign} * (1 + y * (1 - y))")), (side,))
        for side, sign in (("left", "-1"), ("right", "1"))
    )
    scene = replace(plate(*loads), discretisation=bk.Galerkin(2), mesh=bk.MeshOptions(elements=48))
    fields = bk.interior_fields(bk.run(replace(scene, symmetry=bk.Symmetry(x=1.0, y=0.5))))
    x = np.array([[0.3, 0.4], [1.5, 0.7]])
    mirrored = fields.stress(np.array([2.0, 1.0]) - x)
    np.testing.assert_allclose(fields.stress(x), mirrored, atol=1e-10)  # images are the same numbers
    across = np.linspace(0.01, 0.99, 50)
    stress = fields.stress(np.column_stack([np.full_like(across, 0.6), across]))[:, 0, 0]
    assert stress.mean() == pytest.approx(7.0 / 6.0, rel=5e-3)  # the mean load, by 50 points


def test_nothing_of_contact_is_in_the_result(bent: Solution) -> None:
    summary = json.loads(to_json(bent))
    expected = {"n_contact": 0, "force_normal": 0.0, "force_tangential": 0.0, "transitions": [], "linear_solves": 1}
    assert {name: summary[name] for name in expected} == expected
    assert str(summary["force_normal"]) == "0.0"  # and not -0.0
    assert summary["outer_steps"] == 0
    assert summary["certificate"]["penetration"] == 0.0
    assert summary["status"] == "converged"
    assert to_csv(bent, "contact") == "x,y,s,u_n,u_t,sigma_n,sigma_t,gap,clearance,status,part\n"
    assert len(to_csv(bent, "history").splitlines()) == 2


def test_the_plan_says_so(bent: Solution) -> None:
    needed = {item.name: item.is_needed for item in bent.plan.items}
    assert not needed["contact system"]
    assert not needed.keys() & {"friction", "tangential unknowns", "rigid motions as unknowns"}
    assert bent.plan.work == bent.work
    assert bent.work.contact_unknowns == 0


def test_the_summary_speaks_of_elasticity_alone(bent: Solution, capsys: pytest.CaptureFixture[str]) -> None:
    print_summary(bent)
    shown = capsys.readouterr().out
    assert "penetration" not in shown
    lines = [line.split("  ")[0].strip() for line in shown.splitlines()]
    assert lines[1:4] == ["status", "elements", "contact"]
    assert not {"friction force", "transitions", "linear solves"} & {*lines}


def test_result_files_hold_it(bent: Solution, tmp_path: Path) -> None:
    write_result(tmp_path / "bent.h5", bent)
    again = read_result(tmp_path / "bent.h5")
    assert again.contact.n_contact == 0
    assert again.scene == bent.scene
    assert again.transitions == ()
    np.testing.assert_array_equal(again.boundary.traction, bent.boundary.traction)
    without_times = [{**json.loads(to_json(each)), "timings": None} for each in (again, bent)]
    assert without_times[0] == without_times[1]


def test_scene_files_say_nothing_of_friction_and_drivers() -> None:
    text = scene_to_toml(bending())
    assert not {"law", "solver"} & tomllib.loads(text).keys()
    assert scene_from_toml(text) == bending()


def test_figures_show_the_tractions_on_the_boundary(bent: Solution) -> None:
    assert [picture.name for picture in default_pictures(bent)] == ["deformation", "boundary-traction", "von-mises"]
    axes = draw_boundary_traction(bk.run(replace(bending(), units=bk.UnitNames("mm", "MPa"))))
    (strip,) = axes.child_axes
    drawn = {line.get_label(): line.get_ydata() for line in axes.lines}
    largest = np.abs(bent.boundary.traction_dofs).max()
    assert drawn["normal $t_n$"].max() == pytest.approx(largest, rel=1e-12)
    assert np.abs(drawn["tangential $t_t$"]).max() < 1e-9 * largest
    assert {text.get_text() for text in strip.texts} == {"wall", "bending"}
    assert axes.get_ylabel() == "traction [MPa]"


def test_holes_follow_the_outer_boundary_in_the_figure() -> None:
    inner, outer = (tuple(f"{name}-{k}" for k in range(1, 5)) for name in ("inner", "outer"))
    scene = plate(
        bk.Part("shaft", bk.Clamped(), sides=inner),
        bk.Part("press", bk.Pressure(1.0), sides=outer),
        shape=bk.Ring(1.0, 2.0),
    )
    solution = bk.run(scene)
    axes = draw_boundary_traction(solution)
    places = [line.get_xdata()[0] for line in axes.lines if len(line.get_xdata()) == 2 and line.get_xdata()[0] > 0]
    assert places == pytest.approx([solution.mesh.lengths[solution.mesh.loops[0]].sum()], rel=1e-12)


@pytest.mark.parametrize(
    ("parts", "shape", "free"),
    [
        ((), None, "move in any direction and turn"),
        ((bk.Part("side", bk.Roller(), ("left",)),), None, "move along y"),
        ((bk.Part("side", bk.PrescribedDisplacement(y=0.1), ("left",)),), None, "move along x and turn"),
        ((bk.Part("all", bk.Roller()),), bk.Disk(0.5, (3.0, 1.0)), r"turn about \(3, 1\)"),
        (
            (bk.Part("slope", bk.Roller(), ("side-2",)),),
            bk.Polygon(((0.0, 0.0), (2.0, 0.0), (1.0, 3.0**0.5))),
            r"move along \(-?0.5, -?0.866\)",
        ),
    ],
)
def test_a_free_motion_is_named(parts: tuple[bk.Part, ...], shape: object, free: str) -> None:
    with pytest.raises(FreeBodyError, match=f"nothing holds the body: it may {free}; give it a part that is clamped"):
        bk.run(plate(*parts, shape=shape))


def test_what_holds_the_body_need_not_be_a_support() -> None:
    sides = tuple(bk.Part(side, bk.Pressure(1.0), sides=(side,)) for side in ("bottom", "right", "top", "left"))
    scene = replace(plate(*sides), symmetry=bk.Symmetry(x=1.0, y=0.5))
    squeezed = bk.run(scene)
    assert squeezed.is_converged
    # plane strain under a uniform pressure: both strains are -(1 + nu) (1 - 2 nu) p / E
    x, y = squeezed.boundary.points.T
    strain = -1.3 * 0.4
    np.testing.assert_allclose(
        squeezed.boundary.displacement, strain * np.stack([x - 1.0, y - 0.5], axis=1), atol=1e-12
    )
    hole = bk.run(plate(bk.Part("hole", bk.Pressure(1.0)), shape=bk.ExteriorOf(bk.Disk(1.0))))
    assert hole.is_converged
    # u_r = p R / (2 G), elements of 15 degrees
    assert np.hypot(*hole.boundary.displacement.T) == pytest.approx(1.3, rel=0.02)


def test_a_body_without_load_rests() -> None:
    solution = bk.run(plate(bk.Part("wall", bk.Clamped(), ("left",))))
    assert solution.is_converged
    assert not solution.boundary.displacement.any()


def test_load_factors_are_solved_one_after_the_other() -> None:
    scene = plate(bk.Part("wall", bk.Clamped(), ("left",)), bk.Part("load", bk.Traction(y=-1.0), ("right",)))
    records: list[StepRecord] = []
    single, twice = bk.run(scene), bk.run(replace(scene, load_factors=(0.5, 2.0)), callback=records.append)
    np.testing.assert_allclose(twice.boundary.displacement, 2.0 * single.boundary.displacement, rtol=1e-10, atol=1e-12)
    assert twice.linear_solves == len(records) == 2
    moved = bk.Part("wall", bk.PrescribedDisplacement(x=0.1, y=0.0), ("left",))
    first, second = bk.run(
        [
            replace(scene, parts=(moved, scene.parts[1])),
            replace(scene, parts=(bk.Part("wall", bk.PrescribedDisplacement(x=0.0, y=0.0), ("left",)), scene.parts[1])),
        ]
    )
    shift = first.boundary.displacement - second.boundary.displacement
    np.testing.assert_allclose(shift, np.broadcast_to([0.1, 0.0], shift.shape), atol=1e-11)


def test_meshes_follow_an_accuracy() -> None:
    wall, load = bk.Part("wall", bk.Clamped(), ("left",)), bk.Part("load", bk.Traction(y=-1.0), ("right",))
    solution = bk.run(replace(plate(wall, load), mesh=bk.MeshOptions(accuracy=5e-3)))
    assert solution.is_converged
    assert solution.estimated_error is not None
    assert solution.estimated_error < 5e-3
    assert " meshes, the last with " in solution.message
    shortest = np.argmin(solution.mesh.lengths)
    assert solution.mesh.centres[shortest, 0] < 0.2  # the corners of a clamped side are singular
    # 196 elements: twice as many where half of them would be spread over a contact boundary
    assert solution.mesh.n_elements < 250


def test_an_incompressible_body() -> None:
    scene = plate(bk.Part("wall", bk.Clamped(), ("left",)), bk.Part("load", bk.Traction(x=1.0), ("right",)))
    solution = bk.run(replace(scene, material=bk.Material(1.0, 0.5)))
    assert solution.is_converged
    assert solution.boundary.displacement[:, 0].max() > 0.5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"law": bk.Coulomb(0.3)}, "law is Coulomb.*, but no part is in contact: remove the law, or give one part"),
        ({"solver": bk.FixedPoint()}, "solver is FixedPoint.*, but no part is in contact: remove the solver"),
    ],
)
def test_friction_and_drivers_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(bending(), **change)  # type: ignore[arg-type]


def test_friction_is_refused_in_files() -> None:
    text = scene_to_toml(bending()) + '\n[law]\nkind = "coulomb"\nfriction_coefficient = 0.3\n'
    with pytest.raises(SceneError, match=r"scene: law is Coulomb.*: remove the law"):
        scene_from_toml(text)


def test_questions_about_contact_are_refused(bent: Solution) -> None:
    with pytest.raises(InputError, match="no part is in contact: one mesh is enough"):
        run_nested(bending())
    with pytest.raises(InputError, match="no part is in contact: the solution is the only one"):
        distinct_solutions(bending())
    with pytest.raises(InputError, match="start is given, but no part is in contact"):
        bk.run(bending(), start=bent)
    with pytest.raises(StudyError, match="the scene has no contact, which this suite is about"):
        next(sweep(bending(), find_axes(["load"])))


def test_other_loads_need_no_other_matrices() -> None:
    scene = bending()
    model = build_model(prepare(scene, scene.build_mesh()))
    doubled = replace(scene, parts=(scene.parts[0], replace(scene.parts[1], condition=bk.Traction(y=0.1))))
    ((u, _, energy),) = model.under(model.prepared.under(doubled)).boundary_fields(contact_free_state())
    ((v, _, fresh),) = build_model(prepare(doubled, model.prepared.only.mesh)).boundary_fields(contact_free_state())
    np.testing.assert_allclose(u, v, atol=1e-11 * np.abs(v).max())
    assert energy == pytest.approx(fresh, rel=1e-11)
    with pytest.raises(ValueError, match=r"material is .*: keep"):
        model.prepared.under(replace(scene, material=bk.Material(1.0, 0.2)))


@dataclass(frozen=True, eq=False, kw_only=True)
class Reported(CondensedMap):
    """A map that reports given displacements and forces."""

    fields: tuple[FloatArray, FloatArray]

    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        return self.fields

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        raise NotImplementedError

    def follow(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        raise NotImplementedError


def test_only_forces_in_equilibrium_are_certified() -> None:
    scene = bending()
    body = build_model(prepare(scene, scene.build_mesh())).body
    whole, points = body.whole, body.whole.points
    displacement, force = body.recover(contact_free_state())
    assert certified(body).is_converged

    def status_with(u: FloatArray, f: FloatArray) -> bk.Status:
        known = {name: getattr(body.condensed, name) for name in ("stiffness", "load", "sensitivity", "volume_force")}
        return certified(replace(body, whole=replace(whole, condensed=Reported(**known, fields=(u, f))))).status

    free = int(np.flatnonzero(whole.conditions.is_free.all(axis=1))[0])
    other = int(np.flatnonzero(whole.conditions.is_fixed.all(axis=1))[0])
    bump = np.zeros_like(force)
    bump[free, 0] = 1e-6 * np.abs(force).sum()
    assert status_with(displacement, force + bump) is bk.Status.STALLED
    # in equilibrium with the supports, but not what is prescribed on the free boundary
    pair = bump.copy()
    pair[other, 0] = -bump[free, 0]
    assert status_with(displacement, force + pair) is bk.Status.STALLED
    # on the supports alone only the balance can tell: of forces along x, or of moments
    held = whole.conditions.is_fixed.all(axis=1)
    for amounts in (np.ones(held.sum()), np.sign(points[held, 1])):
        bump = np.zeros_like(force)
        bump[held, 0] = 1e-6 * np.abs(force).sum() * amounts / np.abs(amounts).max()
        assert status_with(displacement, force + bump) is bk.Status.STALLED
    assert status_with(np.full_like(displacement, np.nan), force) is bk.Status.NOT_FINITE
