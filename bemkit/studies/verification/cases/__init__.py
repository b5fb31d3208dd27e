"""The problems, by name. A new one is a function that returns its `Case`, and a line here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from bemkit.studies.verification.case import Case
from bemkit.studies.verification.cases import elastic, obstacles, pairs

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
        "receding-layer": obstacles.receding_layer,
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
    }
)
