"""The body of a scene among others, so that faults are planted in one body and in one of several."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bemkit as bk
from bemkit.results.solved_body import SolvedBody


def in_company(scene: bk.Scene) -> bk.Scene:
    """Return a scene with its body beside two blocks, one pressed on the other, that carry less."""
    only = scene.only
    own = scene.bodies or (
        bk.Body(
            name="body",
            shape=only.shape,
            material=only.material,
            parts=only.parts,
            body_forces=only.body_forces,
            far=only.far,
            mesh=scene.mesh,
        ),
    )
    e = only.material.youngs_modulus
    square, base = bk.Rectangle(1.0, 1.0), (bk.Part("base", bk.Clamped(), ("bottom",)),)
    load = (bk.Part("load", bk.Pressure(1e-5 * e), ("top",)),)
    options: dict[str, Any] = {"shape": square, "material": only.material, "mesh": bk.MeshOptions(16)}
    lower = bk.Body(name="lower", parts=base, placement=bk.Placement((9.0, 0.0)), **options)
    upper = bk.Body(name="upper", parts=load, placement=bk.Placement((9.0, 1.0)), **options)
    pair = bk.ContactPair(("upper.bottom", "lower.top"), law=bk.Tresca(1e-4 * e))
    return bk.Scene(
        title="company",
        bodies=(*own, lower, upper),
        rigid=scene.rigid,
        contacts=(*scene.contacts, pair),
        law=scene.law,
        discretisation=scene.discretisation,
        load_factors=scene.load_factors,
    )


def first_body(solution: bk.Solution) -> SolvedBody:
    """Return the only body, or the one in company."""
    return next(iter(solution.bodies.values()))


def with_body(solution: bk.Solution, **entries: Any) -> bk.Solution:
    """Return a solution with other entries of its first body."""
    body = replace(first_body(solution), **entries)
    return replace(solution, bodies={**solution.bodies, body.name: body})
