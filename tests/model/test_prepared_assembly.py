"""What an assembly says on meshes: laws of many contacts in few, couplings kept from one load step to the next."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import bemkit as bk
from bemkit.contact.further_laws import PiecewiseLaw
from bemkit.contact.laws import Coulomb, LawOfCoefficients
from bemkit.model.fields import TractionRecovery
from bemkit.model.prepared import prepare_steps
from bemkit.scene.load_history import load_steps
from tests.runs.masonry import wall


def test_contacts_of_equal_laws_have_one_and_laws_of_the_place_each_their_own() -> None:
    assembly = wall(2, 2, push=True)
    prepared = prepare_steps([replace(assembly, load_factors=(1.0,))])[0]
    assert isinstance(prepared.law, Coulomb)
    pairs = prepared.scene.contacts
    other, placed = Coulomb(0.1), Coulomb(lambda x, y: 0.2 + 0.0 * x)
    laws = [placed, other, placed, *(Coulomb(0.1) for _ in pairs[3:])]
    listed = tuple(replace(pair, law=law) for pair, law in zip(pairs, laws, strict=True))
    mixed = prepare_steps([replace(assembly, touching=None, contacts=listed)])[0]
    law = mixed.law
    assert isinstance(law, PiecewiseLaw)
    assert [each.is_uniform for each in law.laws if isinstance(each, LawOfCoefficients)] == [False, True, False, True]
    expected = [0.2 if name in (pairs[0].name, pairs[2].name) else 0.1 for name in mixed.names]
    on_floor = np.array([name.endswith(".floor") for name in mixed.names])
    np.testing.assert_allclose(law.bound(np.full(mixed.n_contact, -1.0))[~on_floor], np.array(expected)[~on_floor])


def test_forces_of_contacts_are_spread_alike_in_all_steps_of_a_history() -> None:
    steps = prepare_steps(load_steps(replace(wall(2, 2, push=True), load_factors=(0.0, 1.0))))
    known = steps[0].recovery
    following = steps[0].under(steps[1].scene)
    assert following.recovery is known
    anew = TractionRecovery.of(following.bodies, following.rows)
    for one, other in zip(anew.sides, known.sides, strict=True):
        np.testing.assert_array_equal(one.by_force, other.by_force)
    # forces arrive whole: as many as there are on both sides, against each other
    forces = np.random.default_rng(0).normal(size=(following.n_contact, 2))
    sums = np.zeros((len(following.bodies), 2))
    for number, elements, values in known.tractions(forces):
        lengths = following.bodies[number].mesh.lengths[elements]
        sums[number] += np.einsum("e,elc->c", lengths, values) / values.shape[1]  # of linear elements: constants
    on_floor = np.array([name.endswith(".floor") for name in following.names])
    np.testing.assert_allclose(sums.sum(axis=0), forces[on_floor].sum(axis=0), atol=1e-12)


def test_a_law_that_a_later_step_changes_reaches_contacts_found_by_touching() -> None:
    steps = (bk.Step(1.0), bk.Step(2.0, {"law.friction_coefficient": 0.6}))
    first, last = prepare_steps(load_steps(replace(bk.load_scene("masonry-arch"), steps=steps)))
    assert first.law == bk.Coulomb(0.7)
    assert last.law == bk.Coulomb(0.6)
    own = (bk.Step(1.0), bk.Step(2.0, {"touching.law": {"kind": "coulomb", "friction_coefficient": 0.6}}))
    _, last = prepare_steps(load_steps(replace(bk.load_scene("masonry-arch"), steps=own)))
    between = [rows.law for rows in last.rows if rows.other >= 0]
    assert between == [bk.Coulomb(0.6)] * len(between)
    assert between
