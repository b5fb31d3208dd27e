"""A strip of a half-plane as a body: its promises, its supports, and agreement with the condensed map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.body import ContactState, SingularResponse, separated, slip, stick
from bemkit.contact.half_plane.strip_body import StripBody
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.testing import check_body
from tests.handmade import condensed_body

DRIVES = {
    "at rest": None,
    "force": bk.FarField(force_x=0.01, force_y=0.05),
    "force and moment": bk.FarField(x=0.01, force_y=0.05, moment=0.002),
    "motion": bk.FarField(x=0.3, y=0.1, turn=0.02),
}
HELD = (
    bk.Part("held", bk.Clamped(), where=bk.Expression("x > 0.8")),
    bk.Part("rolling", bk.PrescribedDisplacement(x=0.01), where=bk.Expression("x < -0.8")),
)
LOAD = bk.Part("load", bk.Traction(x=0.01, y=-0.02), where=bk.Expression("x > 0.5 and x < 0.7"))


def body_of(far: bk.FarField | None, *parts: bk.Part, towards: tuple[str, str] = ("0.0", "1.0")) -> StripBody:
    gap = bk.Gap(bk.Expression("0.1 * x**2"), tuple(map(bk.Expression, towards)))
    contact = bk.Part("zone", bk.Contact(gap), where=bk.Expression("abs(x) < 0.5"))
    scene = bk.Scene(
        title="strip",
        shape=bk.ElasticHalfPlane(-1.0, 1.0),
        material=bk.Material(1.0, 0.3),
        law=bk.Coulomb(0.3),
        parts=(contact, *parts),
        far=far,
        mesh=bk.MeshOptions(elements=40, grading=bk.Algebraic(1.5)),
    )
    body = build_model(prepare(scene, scene.build_mesh())).body
    assert isinstance(body, StripBody)
    return body


@pytest.mark.parametrize(
    "parts",
    [
        pytest.param((), marks=pytest.mark.slow),
        pytest.param((LOAD,), marks=pytest.mark.slow),
        (LOAD, *HELD),
        pytest.param((HELD[1],), marks=pytest.mark.slow),
    ],
    ids=["free", "loaded", "held", "rolling"],
)
@pytest.mark.parametrize("drive", DRIVES)
def test_it_keeps_the_promises_of_a_body(drive: str, parts: tuple[bk.Part, ...]) -> None:
    body = body_of(DRIVES[drive], *parts)
    check_body(body, is_symmetric=True, reloaded=replace(body, force=2.0 * body.force + 0.01))


def test_contact_may_be_oblique() -> None:
    check_body(body_of(DRIVES["force"], *HELD, towards=("0.3", "1.0")), is_symmetric=True)


@pytest.mark.parametrize("towards", [("0.0", "1.0"), ("0.3", "1.0")])
def test_responses_are_those_of_the_condensed_map(towards: tuple[str, str]) -> None:
    body = body_of(None, LOAD, *HELD, towards=towards)
    condensed = condensed_body(body.elastic, body.conditions, body.nodes, body.force)
    n, random = body.n_contact, np.random.default_rng(4)
    sliding = slip(random.normal(size=n), np.sign(random.normal(size=n)), np.full(n, -0.3), np.zeros(n))
    rows = random.random(n) < 0.5
    for conditions in (
        stick(random.normal(size=n), random.normal(size=n)),
        sliding,
        separated(n).replaced(np.stack([rows, rows], axis=1), sliding),
    ):
        one, other = body.respond(conditions), condensed.respond(conditions)
        size = np.abs(other.traction).max()
        np.testing.assert_allclose(one.displacement, other.displacement, atol=1e-11 * size)
        np.testing.assert_allclose(one.traction, other.traction, atol=1e-11 * size)
        for mine, expected in zip(body.recover(one), condensed.recover(other), strict=True):
            np.testing.assert_allclose(mine, expected, atol=1e-11 * size)


def test_conditions_that_differ_in_values_take_the_same_factor() -> None:
    body = body_of(DRIVES["motion"])
    n = body.n_contact
    body.respond(stick(np.zeros(n), np.zeros(n)))
    factor = body.kept[0][1]
    replace(body, force=body.force + 0.1).respond(stick(np.ones(n), np.zeros(n)))
    assert body.kept[0][1] is factor
    body.respond(slip(np.zeros(n), np.ones(n), np.zeros(n), np.zeros(n)))
    assert body.kept[0][1] is not factor


@pytest.mark.parametrize("parts", [(), (LOAD, *HELD), (HELD[1],)], ids=["free", "held", "rolling"])
def test_a_state_that_is_no_response_is_out_of_balance(parts: tuple[bk.Part, ...]) -> None:
    body = body_of(DRIVES["force"], *parts)
    n = body.n_contact
    state = body.respond(stick(np.linspace(-0.1, 0.1, n), np.zeros(n)))
    assert body.imbalance(state).worst < 1e-13
    assert body.imbalance(ContactState(state.displacement, 1.001 * state.traction)).worst > 1e-5
    assert body.imbalance(ContactState(1.001 * state.displacement, state.traction)).worst > 1e-5


def test_what_nothing_holds_is_singular() -> None:
    with pytest.raises(SingularResponse, match="leave a rigid motion free"):
        body_of(DRIVES["force"]).respond(separated(20))
