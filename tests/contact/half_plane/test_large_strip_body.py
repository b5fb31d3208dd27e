"""A large strip of a half-plane: its promises, and agreement of compressed equations with the whole flexibility."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.body import ContactState, SingularResponse, separated, slip, stick
from bemkit.contact.half_plane.large_strip_body import LargeStripBody
from bemkit.contact.half_plane.strip_body import StripBody
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.operators.half_plane.elasticity import LargeHalfPlane
from bemkit.testing import check_body
from tests.contact.half_plane.test_strip_body import DRIVES, LOAD
from tests.slow import slow_except

CYLINDER = bk.load_scene("cylinder-on-half-plane")


def bodies(far: bk.FarField | None, grading: float = 1.5) -> tuple[LargeStripBody, StripBody]:
    scene = bk.Scene(
        title="strip",
        shape=bk.ElasticHalfPlane(-1.0, 1.0),
        material=bk.Material(1.0, 0.3),
        law=bk.Coulomb(0.3),
        parts=(bk.Part("zone", bk.Contact(bk.Gap(0.0)), where=bk.Expression("abs(x) < 0.5")), LOAD),
        far=far,
        mesh=bk.MeshOptions(elements=500, grading=bk.Algebraic(grading)),
    )
    body = build_model(prepare(scene, scene.build_mesh())).body
    assert isinstance(body, StripBody)
    elastic = LargeHalfPlane(body.elastic.mesh, body.elastic.material, body.elastic.far_motion)
    return LargeStripBody(elastic, body.conditions, body.nodes, body.force), body


@pytest.mark.parametrize("drive", slow_except(DRIVES, "motion"))
def test_it_keeps_the_promises_of_a_body(drive: str) -> None:
    body, _ = bodies(DRIVES[drive])
    check_body(body, is_symmetric=True, reloaded=replace(body, force=2.0 * body.force + 0.01))


@pytest.mark.parametrize("grading", [1.0, 4.0])
def test_responses_are_those_of_the_whole_flexibility(grading: float) -> None:
    large, whole = bodies(DRIVES["force and moment"], grading)
    n, random = large.n_contact, np.random.default_rng(4)
    smooth = np.cos(np.linspace(0.0, 3.0, n))
    sliding = slip(smooth, np.sign(random.normal(size=n)), np.full(n, -0.3), np.zeros(n))
    rows = np.linspace(0.0, 1.0, n) < 0.5
    half = separated(n).replaced(np.stack([rows, rows], axis=1), sliding)
    for conditions in (stick(smooth, 0.1 * smooth), sliding, half):
        one, other = large.respond(conditions), whole.respond(conditions)
        # the compression leaves 1e-10 of displacements; tractions of the shortest elements are the largest
        np.testing.assert_allclose(one.displacement, other.displacement, atol=1e-9 * np.abs(other.displacement).max())
        np.testing.assert_allclose(one.traction, other.traction, atol=1e-8 * np.abs(other.traction).max())
        for mine, expected in zip(large.recover(one), whole.recover(other), strict=True):
            np.testing.assert_allclose(mine, expected, atol=1e-9 * np.abs(expected).max())
        assert large.imbalance(one).worst < 1e-10
    assert large.imbalance(ContactState(one.displacement, 1.001 * one.traction)).worst > 1e-5


def test_the_certificate_sees_errors_of_the_compression() -> None:
    large, _ = bodies(None)
    rough = replace(large, elastic=replace(large.elastic, tolerance=1e-4, last=[]))
    n = large.n_contact
    state = rough.respond(stick(np.linspace(-0.1, 0.1, n) ** 2, np.zeros(n)))
    assert 1e-8 < rough.imbalance(state).force < 1e-3


def test_a_change_at_few_nodes_touches_few_leaves() -> None:
    large, _ = bodies(None)
    n = large.n_contact
    conditions = stick(np.zeros(n), np.zeros(n))
    large.respond(conditions)
    first = np.zeros((n, 2), bool)
    first[0] = True
    large.respond(conditions.replaced(first, separated(n)))
    assert large.elastic.factor.n_factored == 1


def test_what_nothing_holds_is_singular() -> None:
    large, _ = bodies(DRIVES["force"])
    with pytest.raises(SingularResponse, match="leave a rigid motion free"):
        large.respond(separated(large.n_contact))


def test_compressed_equations_have_the_tractions_of_dense_equations(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = replace(CYLINDER, mesh=bk.MeshOptions(elements=500))
    monkeypatch.setattr("bemkit.operators.half_plane.elasticity.LARGEST_DENSE", 499)
    large = bk.run(scene)
    assert large.is_converged
    assert any(item.name == "tree of clusters" for item in large.plan.items)
    monkeypatch.setattr("bemkit.operators.half_plane.elasticity.LARGEST_DENSE", 500)
    dense = bk.run(scene)  # from the start: the solution compared with must not help
    assert not any(item.name == "tree of clusters" for item in dense.plan.items)
    for name in ("sigma_n", "sigma_t"):
        expected = getattr(dense.contact, name)
        np.testing.assert_allclose(getattr(large.contact, name), expected, atol=1e-9 * np.abs(expected).max())
