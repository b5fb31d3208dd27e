"""Problems with known solutions: one function for each, which returns its scene, what is compared, and the bounds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType

from bemkit.studies.verification.case import Case
from bemkit.studies.verification.cases import elastic, friction, half_planes, obstacles, pairs


def _named(*functions: Callable[[], Case]) -> dict[str, Callable[[], Case]]:
    return {function.__name__.replace("_", "-"): function for function in functions}


_CRACKS = {10: (2.4e-2, 1.2e-2, 6e-3), 25: (1.1e-2, 5.5e-3, 2.7e-3), 40: (1e-2, 5e-3, 2.5e-3)}
"""Bounds of closed cracks, by their half-length in hundredths of the period."""

CASES: Mapping[str, Callable[[], Case]] = MappingProxyType(
    _named(
        elastic.lame_ring,
        elastic.kirsch_hole,
        elastic.brazilian_disc,
        elastic.rotating_disc,
        obstacles.uniform_slip,
        obstacles.gravity_column,
        obstacles.westergaard,
        obstacles.disc_between_plates,
        obstacles.receding_layer,
        obstacles.ring_on_shaft,
        obstacles.paper_1,
        obstacles.paper_2,
        pairs.pair_patch,
        pairs.gravity_columns,
        pairs.shrink_fit,
        pairs.hertz_cylinders,
        pairs.cattaneo_mindlin,
        pairs.pin_in_hole,
        pairs.pin_in_stiffer_hole,
        pairs.receding_pair,
        pairs.snug_disc,
        friction.stacked_cantilevers,
        friction.friction_limit_of_an_arch,
    )
    | {f"complete-contact-{angle}": partial(friction.complete_contact, angle) for angle in (60, 75, 90, 105, 120)}
    | _named(
        half_planes.hertz_half_plane,
        half_planes.flat_punch,
        half_planes.tilted_punch,
        half_planes.sliding_punch,
        half_planes.bonded_punch,
        half_planes.blunt_wedge,
        half_planes.rounded_punch,
        half_planes.spence_punch,
        half_planes.static_cylinder,
        half_planes.growing_cylinder,
        half_planes.sheared_cylinder,
        half_planes.sheared_rounded_punch,
        half_planes.periodic_wave,
    )
    | {f"closed-cracks-{k}": partial(half_planes.closed_cracks, k / 100, bounds) for k, bounds in _CRACKS.items()}
    | _named(half_planes.mindlin_cycle)
)
"""The cases by name, each made when it is needed."""
