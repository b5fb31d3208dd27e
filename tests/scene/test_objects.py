"""Words, numbers and classes in the place of objects are refused, and never taken for something that does nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

import bemkit as bk
from bemkit.errors import InputError

SCENE = bk.load_scene("paper-1")
WALL = SCENE.parts[1]
PAIR = bk.ContactPair(("upper.bottom", "lower.top"))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: replace(SCENE, law="coulomb"), r"^law is 'coulomb': give an object, such as Coulomb\("),
        (
            lambda: bk.Contact(object()),
            r"^obstacle is <object .*, which has no method gap\(points, normals\): give one as",
        ),
        (lambda: replace(SCENE, law=0.3), r"^law is 0.3: give an object, such as Coulomb\("),
        (lambda: replace(SCENE, law=bk.Coulomb), "^law is the class Coulomb: give an object"),
        (lambda: replace(SCENE, solver="lemke"), r"^solver is 'lemke': give an object, such as Fallbacks\("),
        (
            lambda: replace(SCENE, solver=(bk.SemismoothNewton(),)),
            r"^solver is \(SemismoothNewton.*such as Fallbacks\(\(",
        ),
        (lambda: replace(SCENE, discretisation="linear"), "^discretisation is 'linear': give an object"),
        (lambda: replace(SCENE, linear_solver="automatic"), "^linear_solver is 'automatic': give an object"),
        (lambda: replace(SCENE, mesh=100), r"^mesh is 100: give an object, such as MeshOptions\(elements=320\)"),
        (lambda: bk.MeshOptions(elements="100"), "^elements is '100': give a number"),
        (lambda: bk.scene_from_toml(SCENE), r"^scene is Scene\(.*: give the text of a scene file"),
        (lambda: replace(SCENE, shape="disk"), "^shape is 'disk': give an object"),
        (lambda: replace(SCENE, material={"youngs_modulus": 1.0}), "^material is {'youngs_modulus': 1.0}: give an obj"),
        (lambda: replace(SCENE, symmetry=0.5), r"^symmetry is 0.5: give an object, such as Symmetry\(x=0.5\)"),
        (lambda: replace(SCENE, far="fixed"), "^far is 'fixed': give an object"),
        (lambda: replace(SCENE, units="mm"), r"^units is 'mm': give an object, such as UnitNames\("),
        (lambda: replace(SCENE, parts=WALL), r"^parts is Part\(name='wall'.*: give a tuple, such as \(Part\("),
        (lambda: replace(SCENE, load_factors=2.0), r"^load_factors is 2.0: give a tuple, such as \(2.0,\)"),
        (
            lambda: replace(SCENE, contacts=(("a.top", "b.bottom"),)),
            r"^contacts contains \('a.top', 'b.bottom'\): give objects, such as ContactPair\(",
        ),
        (lambda: replace(SCENE, parts=[bk.Part]), r"^parts contains <class .*>: give objects, such as Part\("),
        (
            lambda: bk.ContactPair("a.top", "b.bottom"),
            r"^contact: sides is 'a.top': give a tuple, such as \('a.top',\)",
        ),
        (lambda: replace(WALL, condition="roller"), "^part 'wall': condition is 'roller': give an object"),
        (lambda: replace(WALL, condition=bk.Roller), "^part 'wall': condition is the class Roller: give an object"),
        (lambda: replace(WALL, sides="right"), r"^part 'wall': sides is 'right': give a tuple, such as \('right',\)"),
        (lambda: replace(WALL, where="y > 0.5"), r"^part 'wall': where is the text 'y > 0.5': give Expression\("),
        (lambda: bk.Contact("half-plane"), r"^obstacle is 'half-plane': give an object, such as RigidHalfPlane\(\)"),
        (lambda: bk.Touching(0.1, law="frictionless"), "^touching: law is 'frictionless': give an object"),
        (lambda: replace(PAIR, law="frictionless"), "^contact: law is 'frictionless': give an object"),
        (
            lambda: bk.Body(name="b", shape=bk.Disk(1.0), material="steel"),
            "^body 'b': material is 'steel': give an object",
        ),
        (lambda: bk.RigidBody(name="r", obstacle="circle"), "^rigid body 'r': obstacle is 'circle': give an object"),
        (lambda: bk.Material(1.0, 0.3, "stress"), "^plane is 'stress': give Plane.STRAIN or Plane.STRESS"),
        (
            lambda: bk.Coulomb("0.1 * x"),
            r"^friction_coefficient = '0.1 \* x' is not a number; give a number, Expression",
        ),
        (lambda: bk.run("paper-1"), r"^scene is 'paper-1': give a Scene; load_scene\('paper-1'\) reads"),
        (lambda: bk.run(None), r"^scene is None: give a Scene; load_scene\(path\) reads one"),
        (lambda: bk.critical_friction("wedged-leg"), "^scene is 'wedged-leg': give a Scene"),
        (lambda: bk.sweep("paper-1", {"law.friction_coefficient": (0.1,)}), "^scene is 'paper-1': give a Scene"),
    ],
)
def test_what_is_no_object_is_named(make: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


def test_lists_become_tuples() -> None:
    wall = replace(WALL, sides=list(WALL.sides))
    assert wall == WALL
    assert replace(SCENE, parts=[*SCENE.parts], load_factors=[1.0]) == SCENE
