"""Scene files: round trips, and one line of complaint for everything that can be wrong."""

from __future__ import annotations

import dataclasses
import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bemkit.contact.further_laws import CohesiveCoulomb
from bemkit.contact.laws import Coulomb, Frictionless, Tresca
from bemkit.contact.obstacle import Gap, RigidCavity, RigidCircle, RigidHalfPlane
from bemkit.formulas import Expression
from bemkit.geometry.meshing.discretise import Algebraic, Geometric, Uniform
from bemkit.geometry.shapes import Disk, ExteriorOf, PlateWithHole, Polygon, Rectangle, Ring, Sector
from bemkit.operators.material import Material, Plane
from bemkit.scene.conditions import Clamped, Contact, Part, PrescribedDisplacement, Pressure, Roller, Traction
from bemkit.scene.discretisation import ConstantCollocation, Galerkin, MeshOptions
from bemkit.scene.scene import Scene
from bemkit.scene.serialisation import StructureError
from bemkit.scene.toml import SceneError, load_scene, scene_from_toml, scene_to_toml, shipped_scenes, with_overrides
from bemkit.solvers.alm import AugmentedLagrangian, BoundUpdate, InnerNewton
from bemkit.solvers.fallbacks import Fallbacks, SolutionPath, Springs
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.lemke import LemkePivoting
from bemkit.solvers.ssn import SemismoothNewton

BLOCK = """
title = "Square on a rigid foundation"
discretisation = "constant"
solver = "semismooth-newton"

[law]
kind = "coulomb"
friction_coefficient = 0.5

[shape]
kind = "rectangle"
width = 1.0
height = 1.0

[material]
youngs_modulus = 10000.0
poisson_ratio = 0.2
plane = "strain"

[mesh]
elements = 320
grading = "uniform"

[parts.foundation]
sides = ["bottom"]
condition = { kind = "contact", obstacle = { kind = "half-plane", point = [0.0, 0.0], normal = [0.0, 1.0] } }

[parts.wall]
sides = ["right"]
condition = "roller"

[parts.top-load]
sides = ["top"]
where = "x > 0.5"
condition = { kind = "traction", y = -1.0 }

[parts.left-load]
sides = ["left"]
where = "y > 0.5"
condition = { kind = "traction", x = 1.0 }
"""

positive = st.floats(1e-3, 1e3)
lengths = st.floats(-1e3, 1e3)
points = st.tuples(lengths, lengths)
fields = st.one_of(lengths, st.sampled_from([Expression("x**2 * (1 - y)"), Expression("where(x > 0.5, 1, -y)")]))
texts = st.text(st.characters(exclude_categories=["C", "Z"]), min_size=1, max_size=20)

shapes = st.one_of(
    st.builds(Rectangle, positive, positive, points),
    st.builds(Disk, positive, points),
    st.builds(lambda a, b, c: Sector(a, b, b + 77.0, c), positive, st.floats(-180.0, 180.0), points),
    st.builds(lambda a, b, c: Ring(a, a + b, c), positive, positive, points),
    st.builds(lambda a, c: PlateWithHole(4.0 * a, 5.0 * a, a, c), positive, points),
    st.builds(lambda a: ExteriorOf(Disk(a)), positive),
    st.builds(lambda a: Polygon(((0.0, 0.0), (a, 0.0), (0.0, a)), ("one", "two", "three")), positive),
)
obstacles = st.one_of(
    st.builds(RigidHalfPlane, points, st.sampled_from([(0.0, 1.0), (3.0, -4.0)])),
    st.builds(RigidCircle, points, positive),
    st.builds(RigidCavity, points, positive),
    st.builds(Gap, fields),
)
conditions = st.one_of(
    st.just(Clamped()),
    st.just(Roller()),
    st.builds(PrescribedDisplacement, fields, st.none() | fields),
    st.builds(Traction, fields, fields),
    st.builds(Pressure, fields, fields),
    st.builds(Contact, obstacles),
)
laws = st.one_of(
    st.just(Frictionless()),
    st.builds(Tresca, positive),
    st.builds(Coulomb, positive),
    st.builds(CohesiveCoulomb, positive, positive, st.one_of(st.just(math.inf), st.just(1e4))),
)
solvers = st.one_of(
    st.builds(SemismoothNewton, rho=st.none() | positive, max_steps=st.integers(1, 500)),
    st.builds(AugmentedLagrangian, rho_n=st.none() | positive, rho_t=st.none() | positive),
    st.builds(FixedPoint, max_steps=st.integers(1, 500)),
    st.just(LemkePivoting()),
    st.builds(SolutionPath, st.booleans()),
    st.just(Springs(first=0.1)),
    st.just(Fallbacks()),
    st.just(Fallbacks((SemismoothNewton(max_steps=4), SolutionPath(from_start=True), FixedPoint()))),
    st.just(AugmentedLagrangian(bound=BoundUpdate.CURRENT, inner=InnerNewton(max_steps=7))),
)
gradings = st.one_of(st.just(Uniform()), st.builds(Algebraic, st.floats(1.0, 4.0)), st.just(Geometric(0.25, 3)))


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    shape = draw(shapes)
    sides = tuple(side.name for loop in shape.outline().loops for side in loop)
    names = draw(st.lists(texts, min_size=1, max_size=4, unique=True))
    parts = [Part(names[0], Contact(draw(obstacles)), sides[:1])]
    for name in names[1:]:
        where = draw(st.none() | st.just(Expression("x > 0.5 and y < 1")))
        parts.append(Part(name, draw(conditions), draw(st.sampled_from([(), sides[1:]])), where))
    return Scene(
        title=draw(texts),
        description=draw(st.text(st.characters(exclude_categories=["Cs"]), max_size=40)),
        shape=shape,
        material=Material(draw(positive), draw(st.floats(-0.9, 0.5)), draw(st.sampled_from(Plane))),
        parts=tuple(parts),
        law=draw(laws),
        discretisation=draw(st.sampled_from([Galerkin(1), ConstantCollocation()])),
        mesh=MeshOptions(draw(st.integers(3, 10_000)), draw(gradings), draw(st.just({}) | st.just({sides[0]: 2.0}))),
        solver=draw(solvers),
    )


@settings(max_examples=settings.default.max_examples // 3)
@given(scenes())
def test_a_scene_survives_the_way_to_toml_and_back(scene: Scene) -> None:
    text = scene_to_toml(scene)
    again = scene_from_toml(text)
    assert again == scene
    assert scene_to_toml(again) == text


@pytest.mark.parametrize("name", list(shipped_scenes()))
def test_shipped_scenes_load_and_survive_the_round_trip(name: str) -> None:
    scene = load_scene(name)
    assert scene.title == shipped_scenes()[name]
    if not scene.bodies:
        assert scene.build_mesh().n_elements == scene.mesh.elements
    assert scene_to_toml(scene_from_toml(scene_to_toml(scene))) == scene_to_toml(scene)


def test_the_papers_examples_are_what_the_paper_says() -> None:
    one, two = load_scene("paper-1"), load_scene("paper-2")
    assert one.material == Material(10000.0, 0.2, Plane.STRAIN)
    assert two.material == Material(10000.0, 0.3, Plane.STRAIN)
    assert one.shape == Rectangle(1.0, 1.0)
    assert two.shape == Rectangle(0.5, 1.0)
    assert isinstance(one.law, Coulomb)
    assert isinstance(two.law, Coulomb)
    assert (one.law.friction_coefficient, two.law.friction_coefficient) == (0.5, 0.1)
    assert one.mesh.elements == two.mesh.elements == 320
    points, normals = np.array([[0.0, 0.75], [0.2, 1.0]]), np.array([[-1.0, 0.0], [0.0, 1.0]])
    loads = {
        part.name: part.condition.at(points, normals) for part in two.parts if isinstance(part.condition, Traction)
    }
    # the side load acts horizontally and inwards, unlike the print
    np.testing.assert_allclose(loads["side-load"][0], [2 * 0.75**2 * 0.25**2, 0.0], rtol=1e-14)
    np.testing.assert_allclose(loads["top-load"][1], [0.0, -(0.2**2) * 0.8**2], rtol=1e-14)


def test_one_word_or_a_table_name_a_solver() -> None:
    table = 'solver = { kind = "augmented-lagrangian", rho_n = 1e4, rho_t = 100 }'
    assert scene_from_toml(BLOCK).solver == SemismoothNewton()
    changed = BLOCK.replace('solver = "semismooth-newton"', table)
    assert scene_from_toml(changed).solver == AugmentedLagrangian(rho_n=1e4, rho_t=100.0)
    assert scene_from_toml(BLOCK.replace('solver = "semismooth-newton"', "")).solver == Fallbacks()


def test_a_list_names_solvers_one_after_the_other() -> None:
    listed = 'solver = ["semismooth-newton", { kind = "solution-path", from_start = true }]'
    scene = scene_from_toml(BLOCK.replace('solver = "semismooth-newton"', listed))
    assert scene.solver == Fallbacks((SemismoothNewton(), SolutionPath(from_start=True)))
    assert scene_from_toml(scene_to_toml(scene)).solver == scene.solver
    with pytest.raises(SceneError, match=r"solver\[1\].kind: unknown solver 'newton'"):
        scene_from_toml(BLOCK.replace('solver = "semismooth-newton"', 'solver = ["lemke", "newton"]'))
    with pytest.raises(SceneError, match="solver: drivers is empty; give at least one solver"):
        scene_from_toml(BLOCK.replace('solver = "semismooth-newton"', "solver = []"))


def test_friction_may_vary_from_node_to_node() -> None:
    scene = scene_from_toml(BLOCK.replace("= 0.5\n", "= [0.5, 0.25]\n"))
    assert isinstance(scene.law, Coulomb)
    np.testing.assert_array_equal(scene.law.friction_coefficient, [0.5, 0.25])
    assert "0.25" in scene_to_toml(scene)


CONTACT = '{ kind = "contact", obstacle = { kind = "half-plane", point = [0.0, 0.0], normal = [0.0, 1.0] } }'


def test_mistakes_that_only_the_whole_scene_shows_are_listed_together() -> None:
    text = (
        BLOCK.replace('"bottom"', '"botom"').replace('"top"', '"tpo"')
        + "\n[[steps]]\ntime = 1.0\n[[steps]]\ntime = 2.0\n"
    )
    text = f"load_factors = [1.0, 2.0]\n{text}"
    with pytest.raises(SceneError) as caught:
        scene_from_toml(text, name="my.toml")
    heading, *mistakes = str(caught.value).splitlines()
    assert heading == "my.toml: 3 mistakes"
    assert mistakes[0].startswith("  load_factors is (1.0, 2.0) besides 2 steps: give each step its load_factor")
    assert mistakes[1].startswith("  part 'foundation': unknown side 'botom'")
    assert mistakes[2].startswith("  part 'top-load': unknown side 'tpo'")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("title = ", "friction = 0.3\ntitle = ", "friction: unknown key.*did you mean 'law'"),
        ("title = ", "titel = ", "titel: unknown key.*did you mean 'title'"),
        ("youngs_modulus", "youngs_modulos", "material.youngs_modulos: unknown key.*did you mean 'youngs_modulus'"),
        ("[mesh]", "[mesh]\nlength = 3", "mesh.length: unknown key: the keys are elements, grading"),
        ("[material]\nyoungs_modulus = 10000.0\n", "[material]\n", "material.youngs_modulus: missing"),
        ("[law]", "[laws]", "laws: unknown key"),
        ("10000.0", "-1", r"material: youngs_modulus is -1\.0"),
        ("10000.0", "'stiff'", "material.youngs_modulus: 'stiff' is not a number"),
        ("10000.0", "true", "material.youngs_modulus: True is not a number"),
        ("10000.0", "nan", "material.youngs_modulus: nan is not a usable number"),
        ("10000.0", "1" + "0" * 400, "material.youngs_modulus: 1000.* is not a usable number"),
        ("0.2\n", "0.7\n", r"material: poisson_ratio is 0\.7"),
        ("0.2\n", "-1\n", "material: poisson_ratio is -1"),
        ('"strain"', '"stran"', "material.plane: 'stran' is unknown: give one of strain, stress; did you mean"),
        ("= 320", "= 2", "mesh: elements is 2: give a number from 3"),
        ("= 320", "= 1000000000", "mesh: elements is 1000000000: give a number from 3"),
        ("= 320", "= 3.5", "mesh.elements: 3.5 does not fit: give a whole number"),
        ('"uniform"', '"unifrom"', "mesh.grading.kind: unknown grading 'unifrom'.*did you mean 'uniform'"),
        (
            '"constant"',
            '"konstant"',
            "discretisation.kind: unknown discretisation.*linear, quadratic, .*constant",
        ),
        (
            '"semismooth-newton"',
            '"newton"',
            "solver.kind: unknown solver 'newton': the known ones are fallbacks, semismooth-newton",
        ),
        ('"coulomb"', '"culomb"', "law.kind: unknown friction law 'culomb'.*did you mean 'coulomb'"),
        ("friction_coefficient = 0.5", "", "law.friction_coefficient: missing"),
        ("friction_coefficient = 0.5", "friction_coefficient = -1", "law: friction_coefficient"),
        ("width = 1.0", "width = -1.0", "shape: .*width"),
        ('"rectangle"', '"square"', "shape.kind: unknown shape 'square'"),
        ('kind = "rectangle"\n', "", "shape: kind is missing"),
        ('sides = ["bottom"]', 'sides = ["botom"]', "part 'foundation': unknown side 'botom'.*did you mean 'bottom'"),
        ('sides = ["bottom"]', "sides = 3", "parts.foundation.sides: 3 does not fit: give a list"),
        ('sides = ["bottom"]', "sides = [3]", r"parts.foundation.sides\[0\]: 3 does not fit"),
        (CONTACT, '"contact"', "parts.foundation.condition.obstacle: missing: add obstacle = "),
        (CONTACT, '"clamped"', "no part is in contact"),
        ("normal = [0.0, 1.0]", "normal = [0.0, 0.0]", "condition.obstacle: normal is"),
        ("normal = [0.0, 1.0]", "normal = [1.0]", "condition.obstacle.normal: .* has 1 entries: give 2"),
        ("[parts.wall]\n", "[parts.wall]\nname = 'w'\n", r"parts.wall: unknown key 'name'.*\[parts.NAME\]"),
        ('"roller"', '"rollers"', "parts.wall.condition.kind: unknown condition.*did you mean 'roller'"),
        ('"roller"', "{ y = 0.0 }", "parts.wall.condition: kind is missing"),
        ('"roller"', "{ kind = 'displacement' }", "parts.wall.condition: neither x nor y is given"),
        ("x > 0.5", "x.real > 0.5", "parts.top-load.where: expression .*not allowed"),
        ("x > 0.5", "x + 1", "parts.top-load: where is 'x [+] 1', which is a number"),
        ("-1.0 }", "'x > 1' }", "parts.top-load.condition: y = 'x > 1' is a condition"),
        ("-1.0 }", "[1.0] }", "parts.top-load.condition.y: .* does not fit: give a number or a formula"),
        ("-1.0 }", "inf }", "parts.top-load.condition: y = inf is not finite"),
        ("-1.0 }", "\"__import__('os').system('true')\" }", "parts.top-load.condition.y: expression .*not allowed"),
        ("= 320", "= " + "[" * 100_000, "nested too deeply"),
        ("= 320", "= " + "9" * 10_000, "too many digits"),
        ("= 320", "= = 320", r"not valid TOML: .*line \d+"),
        ("[parts.wall]", "[parts.foundation]", "not valid TOML: .*twice"),
        ("[parts.wall]", '[parts."\\u001b[31m"]', "not printable"),
        ('title = "', 'title = "\\u001b[31m', "title is .*give one line of printable text"),
    ],
)
def test_each_mistake_gives_one_line_with_file_key_value_and_remedy(old: str, new: str, message: str) -> None:
    assert old in BLOCK
    with pytest.raises(SceneError, match=message) as caught:
        scene_from_toml(BLOCK.replace(old, new), name="my.toml")
    text = str(caught.value)
    assert text.startswith("my.toml: ")
    assert text.isprintable()
    assert len(text) < 500


def test_all_mistakes_of_a_file_are_listed_with_their_keys() -> None:
    text = BLOCK.replace("youngs_modulus = 10000.0", "E = 10000.0").replace('"coulomb"', '"culomb"')
    text = text.replace("width = 1.0", "width = -1.0").replace('"roller"', "3").replace("elements = 320\n", "")
    text = text.replace("x > 0.5", "x.real > 0.5") + "\n[parts.extra]\nname = 'one'\n[parts.other]\n"
    with pytest.raises(SceneError) as caught:
        scene_from_toml(text, name="my.toml")
    heading, *mistakes = str(caught.value).splitlines()
    assert heading == f"my.toml: {len(mistakes)} mistakes"
    keys = ["shape", "material.E", "law.kind", "parts.extra", "parts.wall.condition", "parts.top-load.where"]
    assert sorted(line.split(": ")[0].strip() for line in mistakes) == sorted([*keys, "parts.other.condition"])
    assert all(line.isprintable() for line in mistakes)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("youngs_modulus", "E", "material.E: unknown key.*did you mean 'youngs_modulus'"),
        ("poisson_ratio", "nu", "material.nu: unknown key.*did you mean 'poisson_ratio'"),
        ("friction_coefficient", "mu", "law.mu: unknown key.*did you mean 'friction_coefficient'"),
        ("friction_coefficient", "friction", "law.friction: unknown key.*did you mean 'friction_coefficient'"),
        ("elements = 320", "tolerance = 1e-3", "mesh.tolerance: unknown key.*did you mean 'accuracy'"),
        ('"rectangle"', '"square"', "shape.kind: unknown shape 'square'.*did you mean 'rectangle'"),
        ('"roller"', '"fixed"', "parts.wall.condition.kind: unknown condition 'fixed'.*did you mean 'clamped'"),
    ],
)
def test_synonyms_name_the_key_or_word_that_is_meant(old: str, new: str, message: str) -> None:
    with pytest.raises(SceneError, match=message) as caught:
        scene_from_toml(BLOCK.replace(old, new))
    assert "\n" not in str(caught.value)  # a key that is missing because it is misspelt is one mistake


def test_words_of_degrees_stand_for_galerkin_elements() -> None:
    for word, degree in (("linear", 1), ("quadratic", 2)):
        for written in (f'"{word}"', f'{{ kind = "{word}" }}', f'{{ kind = "galerkin", degree = {degree} }}'):
            scene = scene_from_toml(BLOCK.replace('"constant"', written))
            assert scene.discretisation == Galerkin(degree)
            assert f'discretisation = "{word}"' in scene_to_toml(scene)
    with pytest.raises(SceneError, match="discretisation: 'linear' has no keys, but degree is given: remove it, or"):
        scene_from_toml(BLOCK.replace('"constant"', '{ kind = "linear", degree = 3 }'))


def test_rising_degrees_are_those_of_all_bodies() -> None:
    text = BLOCK.replace('"constant"', '"hp"').replace('elements = 320\ngrading = "uniform"', "accuracy = 1e-3")
    scene = scene_from_toml(text)
    assert (scene.discretisation, scene.mesh) == (Galerkin(2), MeshOptions(accuracy=1e-3, rising_degrees=True))
    assert 'discretisation = "hp"' in scene_to_toml(scene)
    with pytest.raises(SceneError, match=r"discretisation .hp. is a choice for all bodies .*: set mesh"):
        scene_from_toml(text.replace('"hp"', '{ kind = "hp" }'))
    with pytest.raises(SceneError, match=r"mesh.rising_degrees is True: ConstantCollocation.* has no degree"):
        scene_from_toml(text.replace('"hp"', '"constant"').replace("[mesh]", "[mesh]\nrising_degrees = true"))


def test_errors_of_tables_can_be_sent_to_other_processes() -> None:
    error = StructureError(["one: wrong", "two: wrong"])
    again = pickle.loads(pickle.dumps(error))
    assert (again.mistakes, str(again)) == (error.mistakes, "one: wrong\ntwo: wrong")


@pytest.mark.parametrize("section", ["shape", "material"])
def test_a_missing_section_says_what_to_add(section: str) -> None:
    kept = [block for block in BLOCK.split("\n[") if not block.startswith(section)]
    with pytest.raises(SceneError, match=rf"{section} is missing: .*\[{section}\]"):
        scene_from_toml("\n[".join(kept))


def test_parts_in_a_list_are_told_their_headings() -> None:
    text = BLOCK[: BLOCK.index("[parts")] + "[[parts]]\nname = 'wall'\n"
    with pytest.raises(SceneError, match=r"write \[parts.NAME\], in one of several bodies \[bodies.BODY.parts.NAME\]"):
        scene_from_toml(text)


def test_outlines_that_are_no_boundary_are_refused() -> None:
    bow_tie = "kind = 'polygon'\nvertices = [[0, 0], [1, 1], [1, 0], [0, 1]]"
    text = BLOCK.replace('kind = "rectangle"\nwidth = 1.0\nheight = 1.0', bow_tie)
    with pytest.raises(SceneError, match=r"my\.toml: "):
        scene_from_toml(text, name="my.toml")


def test_python_functions_cannot_be_written() -> None:
    scene = load_scene("paper-1")
    parts = (*scene.parts, Part("more", Traction(x=lambda x, y: x), ("left",), Expression("y < 0.5")))
    with pytest.raises(SceneError, match=r"parts\[4\].condition.x: a Python function .*Expression"):
        scene_to_toml(dataclasses.replace(scene, parts=parts))
    parts = (*scene.parts, Part("more", Traction(), ("left",), lambda x, y: y < 0.5))
    with pytest.raises(SceneError, match=r"parts\[4\].where: a Python function"):
        scene_to_toml(dataclasses.replace(scene, parts=parts))


def test_classes_without_a_word_cannot_be_written() -> None:
    @dataclasses.dataclass(frozen=True)
    class OwnLaw(Frictionless):
        pass

    with pytest.raises(SceneError, match=r"law: the friction law OwnLaw has no name .*'bemkit\.laws'"):
        scene_to_toml(dataclasses.replace(load_scene("paper-1"), law=OwnLaw()))


def test_scenes_are_found_by_name_or_path(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(BLOCK, "utf-8")
    assert load_scene(file) == load_scene(str(file)) == scene_from_toml(BLOCK)
    with pytest.raises(SceneError, match=r"papr-1: no such file.*paper-1, paper-2.*did you mean 'paper-1'"):
        load_scene("papr-1")
    with pytest.raises(SceneError, match="cannot be read"):
        load_scene(tmp_path)
    with pytest.raises(SceneError, match="cannot be read"):
        load_scene("a\0b")
    file.write_bytes(b"\xff\xfe")
    with pytest.raises(SceneError, match="not UTF-8"):
        load_scene(file)
    file.write_bytes(b"#" * 1_000_001)
    with pytest.raises(SceneError, match="larger than"):
        load_scene(file)


def test_overrides_of_the_command_line() -> None:
    scene = load_scene("paper-1")
    changed = with_overrides(scene, elements=64, discretisation="linear", solver="augmented-lagrangian", rho=10.0)
    assert changed.mesh.elements == 64
    assert changed.discretisation == Galerkin(1)
    assert changed.solver == AugmentedLagrangian(rho_n=10.0, rho_t=10.0)
    assert with_overrides(scene, rho=2.0).solver == Fallbacks((SemismoothNewton(rho=2.0), *Fallbacks().drivers[1:]))
    assert with_overrides(scene) == scene
    with pytest.raises(SceneError, match="elements is 1"):
        with_overrides(scene, elements=1)
    with pytest.raises(SceneError, match="unknown solver 'bogus'"):
        with_overrides(scene, solver="bogus")
    with pytest.raises(SceneError, match="fixed-point has no penalty"):
        with_overrides(scene, solver="fixed-point", rho=1.0)
    with pytest.raises(SceneError, match="rho"):
        with_overrides(scene, rho=-1.0)
