"""Exact and reference solutions, which share no code with the boundary elements: one file for each family.

Each says where it holds and where it comes from; ``bemkit verify`` measures the boundary elements by them.
"""

from bemkit.reference.column import GravityColumn as GravityColumn
from bemkit.reference.column import uniaxial_strain_modulus as uniaxial_strain_modulus
from bemkit.reference.compare import MEASURES as MEASURES
from bemkit.reference.compare import Reference as Reference
from bemkit.reference.compare import SampledFields as SampledFields
from bemkit.reference.compare import SamplePoints as SamplePoints
from bemkit.reference.compare import ZoneEnd as ZoneEnd
from bemkit.reference.compare import errors_of as errors_of
from bemkit.reference.compare import over_resolved as over_resolved
from bemkit.reference.compare import sampled_fields as sampled_fields
from bemkit.reference.complete_contact import CompleteContact as CompleteContact
from bemkit.reference.disc import DiscBetweenPlates as DiscBetweenPlates
from bemkit.reference.elastic import BrazilianDisc as BrazilianDisc
from bemkit.reference.elastic import KirschHole as KirschHole
from bemkit.reference.friction import arch_friction_limit as arch_friction_limit
from bemkit.reference.friction import cantilevers_loss as cantilevers_loss
from bemkit.reference.friction import closed_cracks_slip as closed_cracks_slip
from bemkit.reference.friction import mindlin_loss as mindlin_loss
from bemkit.reference.hertz import BluntWedge as BluntWedge
from bemkit.reference.hertz import HertzLine as HertzLine
from bemkit.reference.hertz import LineContact as LineContact
from bemkit.reference.hertz import RoundedPunch as RoundedPunch
from bemkit.reference.hertz import pair_modulus as pair_modulus
from bemkit.reference.partial_slip import PartialSlip as PartialSlip
from bemkit.reference.partial_slip import hertz_slip as hertz_slip
from bemkit.reference.pin import PinInHole as PinInHole
from bemkit.reference.pin import persson_load as persson_load
from bemkit.reference.pin import persson_pressure as persson_pressure
from bemkit.reference.punches import BondedPunch as BondedPunch
from bemkit.reference.punches import FlatPunch as FlatPunch
from bemkit.reference.punches import SlidingPunch as SlidingPunch
from bemkit.reference.receding import RecedingLayer as RecedingLayer
from bemkit.reference.rings import LameRing as LameRing
from bemkit.reference.rings import RotatingDisc as RotatingDisc
from bemkit.reference.rings import ShrinkFit as ShrinkFit
from bemkit.reference.shipped import find_reference as find_reference
from bemkit.reference.spence import spence_stick_ratio as spence_stick_ratio
from bemkit.reference.spence import static_cylinder_stick_ratio as static_cylinder_stick_ratio
from bemkit.reference.wavy import WavyObstacle as WavyObstacle
from bemkit.reference.wavy import westergaard_half_width as westergaard_half_width
from bemkit.reference.wavy import westergaard_pressure as westergaard_pressure
