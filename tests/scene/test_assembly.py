"""What several bodies may say, what they may not, and their text."""

from dataclasses import replace

import pytest

from bemkit import (
    Body,
    CircleCopies,
    Clamped,
    ConstantCollocation,
    ContactPair,
    Coulomb,
    Expression,
    Free,
    Galerkin,
    Gravity,
    GridCopies,
    InputError,
    ListedCopies,
    Material,
    MeshOptions,
    Part,
    Placement,
    Pressure,
    Rectangle,
    RigidBody,
    RigidHalfPlane,
    RigidSpline,
    Scene,
    SignedDistance,
    Touching,
    load_scene,
    scene_from_toml,
    scene_to_toml,
)
from bemkit.scene.conditions import Contact
from bemkit.scene.toml import SceneError, shipped_scenes, single_body

STEEL = Material(210e9, 0.3)
LOWER = Body(name="lower", shape=Rectangle(1.0, 1.0), material=STEEL, parts=(Part("base", Clamped(), ("bottom",)),))
UPPER = Body(
    name="upper",
    shape=Rectangle(1.0, 1.0),
    material=STEEL,
    parts=(Part("load", Pressure(1e6), ("top",)), Part("tip", Free(), ("bottom",), Expression("x > 0.5"))),
    placement=Placement((0.0, 1.0)),
)
PAIR = ContactPair(("upper.bottom", "lower.top"))
PUNCH = RigidBody(name="punch", obstacle=RigidHalfPlane((0.0, 2.0), (0.0, -1.0)), force_y=-2.0, turn=0.01)
SMALL = replace(UPPER, parts=UPPER.parts[:1])
BLOCKS = Scene(title="Two blocks", bodies=(LOWER, SMALL), contacts=(PAIR,))


def test_sides_in_contact_are_free_parts_of_the_scene_of_a_body() -> None:
    scene = BLOCKS.scene_of(SMALL)
    assert [(part.name, type(part.condition)) for part in scene.parts] == [("load", Pressure), ("bottom", Free)]
    assert BLOCKS.touching_parts(LOWER) == ("top",)


def test_copies_stand_in_a_grid_around_a_centre_or_in_a_list() -> None:
    grid = replace(UPPER, copies=GridCopies(2, 2, (3.0, 5.0)))
    assert [(one.name, one.placement.shift) for one in grid.copied()] == [
        ("upper-1-1", (0.0, 1.0)),
        ("upper-2-1", (3.0, 1.0)),
        ("upper-1-2", (0.0, 6.0)),
        ("upper-2-2", (3.0, 6.0)),
    ]
    circle = replace(UPPER, copies=CircleCopies(4, 90.0, (1.0, 1.0)))
    assert [one.placement for one in circle.copied()] == [
        Placement((0.0, 1.0), 0.0),
        Placement((1.0, 0.0), 90.0),
        Placement((2.0, 1.0), 180.0),
        Placement((1.0, 2.0), 270.0),
    ]
    listed = replace(UPPER, copies=ListedCopies((Placement((1.0, 1.0)), Placement(turn=90.0))))
    assert [one.placement for one in listed.copied()] == [Placement((1.0, 2.0)), Placement((-1.0, 0.0), 90.0)]


def test_copies_share_what_is_said_of_them() -> None:
    many = replace(BLOCKS, bodies=(LOWER, replace(SMALL, copies=GridCopies(3, 1, (2.0, 0.0)))), contacts=())
    assert len({id(many.scene_of(body)) for body in many.placed_bodies}) == 2


def test_every_key_survives_its_text() -> None:
    heavy = replace(
        UPPER,
        copies=CircleCopies(2, 45.0, (0.0, 1.0)),
        body_forces=(Gravity(7800.0),),
        discretisation=ConstantCollocation(),
        mesh=MeshOptions(elements=24),
    )
    held = replace(
        LOWER, parts=(Part("base", Contact(RigidHalfPlane(), Coulomb(0.2)), ("bottom",)),), copies=GridCopies(2)
    )
    scene = Scene(
        title="All keys",
        description="Two lines\nof text.",
        reference="nobody",
        bodies=(held, heavy),
        contacts=(
            ContactPair(("upper-1.tip", "lower-1-1.top"), Coulomb(0.3), 1e-6, 1e-5, "lower-1-1.top", 0.2),
            ContactPair(("upper-2.tip", "lower-2-1.top")),
            ContactPair(("curve", "lower-2-1.right")),
            ContactPair(("upper-2.tip", "level")),
        ),
        rigid=(
            RigidBody(
                name="curve",
                obstacle=RigidSpline(((0.0, 0.0), (1.0, 0.5), (0.0, 1.0)), is_closed=False),
                centre=(1.0, 2.0),
                x=0.0,
                force_y=-3.0,
                moment=0.5,
            ),
            RigidBody(name="level", obstacle=SignedDistance(Expression("y - x")), force_x=1.0, y=2.0, turn=-0.1),
        ),
        touching=Touching(0.01, Coulomb(0.1), 0.3, ("upper.bottom / lower.top",)),
        law=Coulomb(0.5),
        load_factors=(0.5, 1.0),
    )
    assert scene_from_toml(scene_to_toml(scene)) == scene
    assert scene_from_toml(scene_to_toml(BLOCKS)) == BLOCKS


@pytest.mark.parametrize("name", [name for name in shipped_scenes() if isinstance(load_scene(name), Scene)])
def test_shipped_assemblies_survive_their_text(name: str) -> None:
    scene = load_scene(name)
    assert scene_from_toml(scene_to_toml(scene)) == scene


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"load_factors": ()}, r"load_factors is (): give finite numbers such as (0.5, 1.0)"),
        ({"load_factors": (1.0, float("nan"))}, "load_factors is (1.0, nan): give finite numbers"),
        ({"title": ""}, "title is '': give one line of printable text"),
        ({"bodies": ()}, "shape is missing: give the body a shape and a material"),
        ({"bodies": (LOWER, SMALL, LOWER)}, "'lower' is the name of two bodies: give each its own name"),
        ({"contacts": (PAIR, ContactPair(PAIR.sides[::-1]))}, "contact 'upper.bottom / lower.top' is listed twice"),
        (
            {"contacts": (ContactPair(("uper.bottom", "lower.top")),)},
            "the bodies are lower, upper; did you mean 'upper'",
        ),
        (
            {"contacts": (ContactPair(("upper.botom", "lower.top")),)},
            "body 'upper' has no part or side 'botom': there are load, bottom, right, top, left; did you mean 'bottom'",
        ),
        ({"contacts": (ContactPair(("upper.load", "lower.top")),)}, "part upper.load is Pressure: a part in contact"),
        (
            {"contacts": (PAIR, ContactPair(("punch", "lower.top")))},
            "a contact names 'punch': there is no rigid body; write",
        ),
        (
            {"rigid": (PUNCH,), "contacts": (ContactPair(("punsh", "lower.top")),)},
            "a contact names 'punsh': the rigid bodies are punch; did you mean 'punch'?; write a side of",
        ),
        ({"rigid": (PUNCH,)}, "rigid body 'punch' touches nothing: list a contact with it, or remove it"),
        ({"rigid": (replace(PUNCH, name="lower"),)}, "'lower' is the name of two bodies: give each its own name"),
        ({"mesh": MeshOptions(accuracy=1e-3), "discretisation": ConstantCollocation()}, "has no error estimate"),
        (
            {
                "mesh": MeshOptions(accuracy=1e-3, rising_degrees=True),
                "bodies": (replace(LOWER, discretisation=Galerkin(1)), SMALL),
            },
            "body 'lower' has a fixed degree, the scene rising degrees: degrees rise for all bodies or for none",
        ),
        (
            {"mesh": MeshOptions(accuracy=1e-3), "bodies": (replace(LOWER, mesh=MeshOptions(elements=8)), SMALL)},
            "body 'lower' has mesh options of its own: give one of them",
        ),
        (
            {"bodies": (replace(LOWER, parts=(Part("base", Clamped(), ("botom",)),)), SMALL)},
            "body 'lower': part 'base': unknown side 'botom'",
        ),
    ],
)
def test_what_does_not_fit_together_is_named(change: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as caught:
        replace(BLOCKS, **change)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: replace(BLOCKS, bodies=(replace(LOWER, name=""),)),
            "the body name '' does not do: give printable text without a dot",
        ),
        (lambda: replace(LOWER, name="a.b"), "the body name 'a.b' does not do"),
        (lambda: replace(LOWER, parts=LOWER.parts * 2), "body 'lower': 'base' is the name of two parts"),
        (lambda: replace(LOWER, mesh=MeshOptions(accuracy=1e-3)), "body 'lower': an accuracy is that of all bodies"),
        (
            lambda: ContactPair(("upper", "lower")),
            "contact sides are ('upper', 'lower'): give two, each as 'body.side'",
        ),
        (
            lambda: ContactPair(("upper.top",)),
            "contact sides are ('upper.top',): give two, each as 'body.side', or one",
        ),
        (lambda: ContactPair(("upper.top", "upper.top")), "the contact of 'upper.top' is with itself: give two sides"),
        (lambda: ContactPair(PAIR.sides, gap=float("inf")), "gap = inf is not finite; give a finite number"),
        (lambda: ContactPair(PAIR.sides, interference=-1.0), "interference is -1.0: give a length, not negative"),
        (lambda: ContactPair(PAIR.sides, multipliers_on="x.y"), "multipliers_on is 'x.y': give one of the two sides"),
        (
            lambda: ContactPair(("punch", "lower.top"), multipliers_on="punch"),
            "contact 'punch / lower.top': multipliers_on is 'punch': give one of the two sides, and not a rigid body",
        ),
        (lambda: replace(PUNCH, name=""), "the rigid body name '' does not do: give printable text without a dot"),
        (lambda: replace(PUNCH, name="a.b"), "the rigid body name 'a.b' does not do"),
        (
            lambda: replace(PUNCH, centre=(0.0, float("nan"))),
            "rigid body 'punch': centre is (0.0, nan): give two finite",
        ),
        (lambda: replace(PUNCH, turn=float("inf")), "rigid body 'punch': turn is inf: give a finite number"),
        (lambda: replace(PUNCH, moment=float("nan"), turn=None), "rigid body 'punch': moment is nan: give a finite"),
        (lambda: replace(PUNCH, y=-1e-3), "rigid body 'punch': y is -0.001 and force_y is -2.0: give one of them"),
        (
            lambda: replace(PUNCH, force_x=0.0, x=0.0),
            "rigid body 'punch': x is 0.0 and force_x is 0.0: give one of them",
        ),
        (lambda: replace(PUNCH, moment=1.0), "rigid body 'punch': turn is 0.01 and moment is 1.0: give one of them"),
        (lambda: Touching(-1.0), "touching.within is -1.0: give a length, zero or positive"),
        (lambda: Touching(0.1, reach=0.0), "touching.reach is 0.0: give a positive length"),
        (lambda: ContactPair(PAIR.sides, reach=-1.0), "contact 'upper.bottom / lower.top': reach is -1.0: give a"),
        (lambda: GridCopies(0), "columns is 0: give a whole number from 1 to 100000"),
        (lambda: GridCopies(rows=2.0), "rows is 2.0: give a whole number"),  # type: ignore[arg-type]
        (lambda: GridCopies(1000, 1000), "columns times rows is 1000000: give a whole number"),
        (lambda: CircleCopies(0, 1.0), "count is 0: give a whole number"),
        (lambda: ListedCopies(()), "the number of places is 0: give a whole number"),
    ],
)
def test_bad_values_are_named(make: object, message: str) -> None:
    with pytest.raises(InputError) as caught:
        make()  # type: ignore[operator]
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "title = 'a'\n[bodies.one]\nmaterial = { youngs_modulus = 1.0, poisson_ratio = 0.3 }",
            "bodies.one.shape: missing",
        ),
        ("title = 'a'\n[bodies]", "or bodies"),
        ("title = 'a'\n[bodies]\n[rigid.one]\nx = 1.0", "rigid.one.obstacle: missing"),
        (
            "title = 'a'\n[bodies]\n[rigid.one]\nname = 'x'",
            "rigid.one: unknown key 'name': write the name of a rigid body",
        ),
        ("title = 'a'\n[bodies.one]\nname = 'x'", "bodies.one: unknown key 'name': write the name of a body in its"),
    ],
)
def test_texts_are_refused_by_key(text: str, message: str) -> None:
    with pytest.raises(SceneError) as caught:
        scene_from_toml(text)
    assert message in str(caught.value)


def test_commands_for_one_body_say_so() -> None:
    with pytest.raises(SceneError, match="two-cylinders: there are 2 bodies: only scenes of one body can do this"):
        single_body(load_scene("two-cylinders"), "two-cylinders")
