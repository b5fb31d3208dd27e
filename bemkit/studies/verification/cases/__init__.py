"""Problems with known solutions: one function for each, which returns its scene, what is compared, and the bounds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from bemkit.studies.verification.case import Case
from bemkit.studies.verification.cases import elastic, friction, half_planes, obstacles, pairs

_FUNCTIONS: tuple[Callable[[], Case], ...] = (
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
    friction.complete_contact_60,
    friction.complete_contact_75,
    friction.complete_contact_90,
    friction.complete_contact_105,
    friction.complete_contact_120,
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
    half_planes.closed_cracks_10,
    half_planes.closed_cracks_25,
    half_planes.closed_cracks_40,
    half_planes.mindlin_cycle,
)

CASES: Mapping[str, Callable[[], Case]] = MappingProxyType(
    {function.__name__.replace("_", "-"): function for function in _FUNCTIONS}
)
"""The cases by name, each made when it is needed."""
