"""High friction: what Newton's full steps leave wrong is mended by a short path, not by following all nodes."""

from dataclasses import replace

import pytest

import bemkit as bk
from bemkit.testing.independent_check import violations_of
from tests.slow import slow_except

ELEMENTS = [bk.ConstantCollocation(), bk.Galerkin(1), bk.Galerkin(2)]
MOST_SOLVES, MOST_ON_FINE_MESHES = 150, 250
"""The path from all nodes sticking takes 110 to 250 on Example 1."""
MOST_ON_WHOLE_PATHS = 6
"""Linear solves for each contact node; the whole path of the bonded punch has 2.4 segments a node."""


def bonded_punch(discretisation, friction_coefficient):
    """A block bonded to a punch that pushes it down onto a round support and along it: full steps wander."""
    return bk.Scene(
        title="bonded punch",
        shape=bk.Rectangle(1.0, 0.5),
        material=bk.Material(1e4, 0.3),
        law=bk.Coulomb(friction_coefficient),
        mesh=bk.MeshOptions(480),
        discretisation=discretisation,
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidCircle(centre=(0.5, -1.0), radius=1.0)), sides=("bottom",)),
            bk.Part(
                "punch",
                bk.PrescribedDisplacement(x=0.003, y=-0.002),
                ("top",),
                bk.Expression("x > 0.3 and x < 0.8"),
            ),
        ),
    )


def solved(scene):
    solution = bk.run(scene)
    assert solution.is_converged
    assert violations_of(solution).is_good
    return solution


@pytest.mark.parametrize("discretisation", slow_except(ELEMENTS, ELEMENTS[0]), ids=lambda kind: type(kind).__name__)
def test_example_1_is_solved_at_any_friction(discretisation):
    scene = replace(bk.load_scene("paper-1"), discretisation=discretisation)
    scene = replace(scene, mesh=replace(scene.mesh, elements=200))
    for friction_coefficient in (0.5, 5.0, 100.0, 1000.0):
        assert solved(replace(scene, law=bk.Coulomb(friction_coefficient))).linear_solves <= MOST_SOLVES


@pytest.mark.slow
def test_a_bonded_punch_is_solved_by_the_whole_path():
    """Newton's method wanders and the path from its statuses ends on a ray; two linear solves a segment remain."""
    solution = solved(bonded_punch(bk.ConstantCollocation(), 10.0))
    assert solution.linear_solves <= MOST_ON_WHOLE_PATHS * solution.contact.n_contact
    assert solution.history[-1].message.startswith("path of")


@pytest.mark.slow
@pytest.mark.parametrize("discretisation", ELEMENTS, ids=lambda kind: type(kind).__name__)
def test_high_friction_on_fine_meshes(discretisation):
    example = replace(bk.load_scene("paper-1"), discretisation=discretisation)
    example = replace(example, mesh=replace(example.mesh, elements=640))
    for friction_coefficient in (0.5, 1.0, 2.0, 5.0, 10.0, 100.0, 1000.0):
        law = bk.Coulomb(friction_coefficient)
        found = solved(replace(example, law=law))
        # where a path has more than 60 segments the whole one is followed, with up to two solves a node
        assert found.linear_solves <= max(MOST_ON_FINE_MESHES, 2.5 * found.contact.n_contact)
        punch = solved(bonded_punch(discretisation, friction_coefficient))
        assert punch.linear_solves <= MOST_ON_WHOLE_PATHS * punch.contact.n_contact
