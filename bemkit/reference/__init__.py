"""Exact and reference solutions of contact problems, which share no code with the boundary elements."""

from bemkit.reference.compare import MEASURES as MEASURES
from bemkit.reference.compare import Answer as Answer
from bemkit.reference.compare import Places as Places
from bemkit.reference.compare import Reference as Reference
from bemkit.reference.compare import Zone as Zone
from bemkit.reference.compare import answer_of as answer_of
from bemkit.reference.compare import errors_of as errors_of
from bemkit.reference.compare import over_resolved as over_resolved
from bemkit.reference.disc import DiscBetweenPlates as DiscBetweenPlates
from bemkit.reference.shipped import find_reference as find_reference
from bemkit.reference.wavy import WavyObstacle as WavyObstacle
from bemkit.reference.wavy import westergaard_half_width as westergaard_half_width
from bemkit.reference.wavy import westergaard_pressure as westergaard_pressure
