"""The problems, by name. A new one is a function that returns its `Case`, and a line here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from bemkit.studies.verification.case import Case
from bemkit.studies.verification.cases import elastic, half_plane, layers, obstacles, pairs

CASES: Mapping[str, Callable[[], Case]] = MappingProxyType(
    {
        "lame-ring": elastic.lame_ring,
        "kirsch-hole": elastic.kirsch_hole,
        "brazilian-disc": elastic.brazilian_disc,
        "rotating-disc": elastic.rotating_disc,
        "uniform-slip": obstacles.uniform_slip,
        "gravity-column": obstacles.gravity_column,
        "westergaard": obstacles.westergaard,
        "disc-between-plates": obstacles.disc_between_plates,
        "receding-layer": layers.receding_layer,
        "ring-on-shaft": obstacles.ring_on_shaft,
        "paper-1": obstacles.paper_1,
        "paper-2": obstacles.paper_2,
        "pair-patch": pairs.patch,
        "gravity-columns": pairs.columns,
        "shrink-fit": pairs.shrink_fit,
        "hertz-cylinders": pairs.hertz_cylinders,
        "cattaneo-mindlin": pairs.cattaneo_mindlin,
        "pin-in-hole": pairs.pin_of_the_same,
        "pin-in-stiffer-hole": pairs.pin_of_another,
        "receding-pair": layers.receding_pair,
        "hertz-half-plane": half_plane.hertz,
        "flat-punch": half_plane.flat_punch,
        "tilted-punch": half_plane.tilted_punch,
        "sliding-punch": half_plane.sliding_punch,
        "bonded-punch": half_plane.bonded_punch,
        "blunt-wedge": half_plane.blunt_wedge,
        "rounded-punch": half_plane.rounded_punch,
        "spence-punch": half_plane.spence_punch,
        "static-cylinder": half_plane.static_cylinder,
        "growing-cylinder": half_plane.growing_cylinder,
        "sheared-cylinder": half_plane.sheared_cylinder,
        "sheared-rounded-punch": half_plane.sheared_rounded_punch,
        "periodic-wave": half_plane.periodic_wave,
    }
)
