"""Frictional contact of elastic bodies by boundary elements.

>>> import bemkit
>>> bemkit.run(bemkit.load_scene("paper-1")).status.name
'CONVERGED'

The names below are imported when they are first used, so that importing bemkit costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from bemkit.version import __version__ as __version__

if TYPE_CHECKING:
    from bemkit.contact.further_laws import CohesiveCoulomb as CohesiveCoulomb
    from bemkit.contact.further_laws import RateStrengthening as RateStrengthening
    from bemkit.contact.further_laws import SlipWeakening as SlipWeakening
    from bemkit.contact.laws import Coulomb as Coulomb
    from bemkit.contact.laws import FrictionLaw as FrictionLaw
    from bemkit.contact.laws import Frictionless as Frictionless
    from bemkit.contact.laws import Tresca as Tresca
    from bemkit.contact.obstacle import Cavity as Cavity
    from bemkit.contact.obstacle import Circle as Circle
    from bemkit.contact.obstacle import Gap as Gap
    from bemkit.contact.obstacle import HalfPlane as HalfPlane
    from bemkit.contact.obstacle import Obstacle as Obstacle
    from bemkit.contact.polygon import PolygonalObstacle as PolygonalObstacle
    from bemkit.contact.rough_profile import Profile as Profile
    from bemkit.contact.rough_profile import SelfAffineProfile as SelfAffineProfile
    from bemkit.contact.signed_distance import SignedDistance as SignedDistance
    from bemkit.contact.spline import SplineObstacle as SplineObstacle
    from bemkit.errors import BemkitError as BemkitError
    from bemkit.errors import InputError as InputError
    from bemkit.errors import NoResultError as NoResultError
    from bemkit.formulas import Expression as Expression
    from bemkit.geometry.drawn import ArcTo as ArcTo
    from bemkit.geometry.drawn import LineTo as LineTo
    from bemkit.geometry.drawn import Loop as Loop
    from bemkit.geometry.drawn import NurbsTo as NurbsTo
    from bemkit.geometry.drawn import OutlineShape as OutlineShape
    from bemkit.geometry.drawn import SplineTo as SplineTo
    from bemkit.geometry.files.shape_file import DrawingFile as DrawingFile
    from bemkit.geometry.files.shape_file import MeshFile as MeshFile
    from bemkit.geometry.mesh import BoundaryMesh as BoundaryMesh
    from bemkit.geometry.meshing.discretise import Algebraic as Algebraic
    from bemkit.geometry.meshing.discretise import Geometric as Geometric
    from bemkit.geometry.meshing.discretise import Uniform as Uniform
    from bemkit.geometry.meshing.discretise import discretise as discretise
    from bemkit.geometry.neighbours import corner_nodes as corner_nodes
    from bemkit.geometry.outline import Selection as Selection
    from bemkit.geometry.placement import Placement as Placement
    from bemkit.geometry.shapes import Disk as Disk
    from bemkit.geometry.shapes import ExteriorOf as ExteriorOf
    from bemkit.geometry.shapes import HalfPlaneBody as HalfPlaneBody
    from bemkit.geometry.shapes import PeriodicHalfPlaneBody as PeriodicHalfPlaneBody
    from bemkit.geometry.shapes import PlateWithHole as PlateWithHole
    from bemkit.geometry.shapes import Polygon as Polygon
    from bemkit.geometry.shapes import Rectangle as Rectangle
    from bemkit.geometry.shapes import Ring as Ring
    from bemkit.geometry.shapes import Sector as Sector
    from bemkit.geometry.spaces import ConstantSpace as ConstantSpace
    from bemkit.geometry.spaces import LagrangeSpace as LagrangeSpace
    from bemkit.geometry.spaces import LinearSpace as LinearSpace
    from bemkit.geometry.spaces import QuadraticSpace as QuadraticSpace
    from bemkit.geometry.symmetry import Symmetry as Symmetry
    from bemkit.operators.boundary import adjoint_double_layer as adjoint_double_layer
    from bemkit.operators.boundary import assemble as assemble
    from bemkit.operators.boundary import double_layer as double_layer
    from bemkit.operators.boundary import hypersingular as hypersingular
    from bemkit.operators.boundary import mass as mass
    from bemkit.operators.boundary import single_layer as single_layer
    from bemkit.operators.linear.solvers import Automatic as Automatic
    from bemkit.operators.linear.solvers import DenseCholesky as DenseCholesky
    from bemkit.operators.linear.solvers import Hierarchical as Hierarchical
    from bemkit.operators.linear.solvers import MatrixFree as MatrixFree
    from bemkit.operators.material import Material as Material
    from bemkit.operators.material import Plane as Plane
    from bemkit.operators.somigliana.fields import InteriorFields as InteriorFields
    from bemkit.operators.somigliana.stress import principal_stresses as principal_stresses
    from bemkit.operators.somigliana.stress import von_mises as von_mises
    from bemkit.operators.steklov_poincare.maps import CollocationMap as CollocationMap
    from bemkit.operators.steklov_poincare.maps import GalerkinMap as GalerkinMap
    from bemkit.pictures.files import save_pictures as save_pictures
    from bemkit.plan import make_plan as make_plan
    from bemkit.reference.shipped import find_reference as find_reference
    from bemkit.results.assembly_solution import AssemblySolution as AssemblySolution
    from bemkit.results.citations import cite as cite
    from bemkit.results.export import export_result as export_result
    from bemkit.results.interior import interior_fields as interior_fields
    from bemkit.results.result_file import read_result as read_result
    from bemkit.results.result_file import write_result as write_result
    from bemkit.results.solution import Solution as Solution
    from bemkit.runs.assembly import run_assembly_history as run_assembly_history
    from bemkit.runs.checkpoint import run_to_file as run_to_file
    from bemkit.runs.collapse import largest_load_factor as largest_load_factor
    from bemkit.runs.critical_friction import CriticalFriction as CriticalFriction
    from bemkit.runs.critical_friction import critical_friction as critical_friction
    from bemkit.runs.history import run_history as run_history
    from bemkit.runs.nested import run_cascade as run_cascade
    from bemkit.runs.run import FailedRun as FailedRun
    from bemkit.runs.run import run as run
    from bemkit.runs.run import run_all as run_all
    from bemkit.runs.run import run_probe as run_probe
    from bemkit.scene.assembly import Assembly as Assembly
    from bemkit.scene.assembly import ContactPair as ContactPair
    from bemkit.scene.assembly import Touching as Touching
    from bemkit.scene.body import Body as Body
    from bemkit.scene.body_forces import Gravity as Gravity
    from bemkit.scene.body_forces import Heating as Heating
    from bemkit.scene.body_forces import Rotation as Rotation
    from bemkit.scene.conditions import Clamped as Clamped
    from bemkit.scene.conditions import Contact as Contact
    from bemkit.scene.conditions import Free as Free
    from bemkit.scene.conditions import Part as Part
    from bemkit.scene.conditions import PrescribedDisplacement as PrescribedDisplacement
    from bemkit.scene.conditions import Pressure as Pressure
    from bemkit.scene.conditions import Roller as Roller
    from bemkit.scene.conditions import Traction as Traction
    from bemkit.scene.copies import CircleCopies as CircleCopies
    from bemkit.scene.copies import GridCopies as GridCopies
    from bemkit.scene.copies import ListedCopies as ListedCopies
    from bemkit.scene.discretisation import ConstantCollocation as ConstantCollocation
    from bemkit.scene.discretisation import Galerkin as Galerkin
    from bemkit.scene.discretisation import HpGalerkin as HpGalerkin
    from bemkit.scene.discretisation import LinearGalerkin as LinearGalerkin
    from bemkit.scene.discretisation import QuadraticGalerkin as QuadraticGalerkin
    from bemkit.scene.mesh_options import MeshOptions as MeshOptions
    from bemkit.scene.plane_motion import FarField as FarField
    from bemkit.scene.plane_motion import RigidBody as RigidBody
    from bemkit.scene.scene import Scene as Scene
    from bemkit.scene.steps import Step as Step
    from bemkit.scene.toml import load_scene as load_scene
    from bemkit.scene.toml import scene_from_toml as scene_from_toml
    from bemkit.scene.toml import scene_to_toml as scene_to_toml
    from bemkit.scene.unit_names import UnitNames as UnitNames
    from bemkit.solvers.alm import AugmentedLagrangian as AugmentedLagrangian
    from bemkit.solvers.base import ContactSolver as ContactSolver
    from bemkit.solvers.base import Status as Status
    from bemkit.solvers.base import solve as solve
    from bemkit.solvers.fixed_point import FixedPoint as FixedPoint
    from bemkit.solvers.ssn import SemismoothNewton as SemismoothNewton
    from bemkit.studies.sweep.sweep import sweep as sweep
    from bemkit.studies.sweep.table import Sweep as Sweep
    from bemkit.studies.verification.verification import verify as verify
    from bemkit.testing.lemke import LemkePivoting as LemkePivoting

_HOME = {
    "contact.further_laws": ("CohesiveCoulomb", "RateStrengthening", "SlipWeakening"),
    "contact.laws": ("Coulomb", "FrictionLaw", "Frictionless", "Tresca"),
    "contact.obstacle": ("Cavity", "Circle", "Gap", "HalfPlane", "Obstacle"),
    "contact.polygon": ("PolygonalObstacle",),
    "contact.rough_profile": ("Profile", "SelfAffineProfile"),
    "contact.signed_distance": ("SignedDistance",),
    "contact.spline": ("SplineObstacle",),
    "errors": ("BemkitError", "InputError", "NoResultError"),
    "formulas": ("Expression",),
    "geometry.drawn": ("ArcTo", "LineTo", "Loop", "NurbsTo", "OutlineShape", "SplineTo"),
    "geometry.files.shape_file": ("DrawingFile", "MeshFile"),
    "geometry.mesh": ("BoundaryMesh",),
    "geometry.meshing.discretise": ("Algebraic", "Geometric", "Uniform", "discretise"),
    "geometry.placement": ("Placement",),
    "geometry.outline": ("Selection",),
    "geometry.shapes": (
        *("Disk", "ExteriorOf", "HalfPlaneBody", "PeriodicHalfPlaneBody", "PlateWithHole", "Polygon", "Rectangle"),
        *("Ring", "Sector"),
    ),
    "geometry.neighbours": ("corner_nodes",),
    "geometry.spaces": ("ConstantSpace", "LagrangeSpace", "LinearSpace", "QuadraticSpace"),
    "geometry.symmetry": ("Symmetry",),
    "operators.boundary": ("adjoint_double_layer", "assemble", "double_layer", "hypersingular", "mass", "single_layer"),
    "operators.linear.solvers": ("Automatic", "DenseCholesky", "Hierarchical", "MatrixFree"),
    "operators.material": ("Material", "Plane"),
    "operators.somigliana.fields": ("InteriorFields",),
    "operators.somigliana.stress": ("principal_stresses", "von_mises"),
    "operators.steklov_poincare.maps": ("CollocationMap", "GalerkinMap"),
    "pictures.files": ("save_pictures",),
    "plan": ("make_plan",),
    "reference.shipped": ("find_reference",),
    "results.assembly_solution": ("AssemblySolution",),
    "results.citations": ("cite",),
    "results.export": ("export_result",),
    "results.interior": ("interior_fields",),
    "results.result_file": ("read_result", "write_result"),
    "results.solution": ("Solution",),
    "runs.assembly": ("run_assembly_history",),
    "runs.checkpoint": ("run_to_file",),
    "runs.collapse": ("largest_load_factor",),
    "runs.critical_friction": ("CriticalFriction", "critical_friction"),
    "runs.history": ("run_history",),
    "runs.nested": ("run_cascade",),
    "runs.run": ("FailedRun", "run", "run_all", "run_probe"),
    "scene.assembly": ("Assembly", "ContactPair", "Touching"),
    "scene.body": ("Body",),
    "scene.body_forces": ("Gravity", "Heating", "Rotation"),
    "scene.conditions": (
        *("Clamped", "Contact", "Free", "Part", "PrescribedDisplacement", "Pressure", "Roller", "Traction"),
    ),
    "scene.copies": ("CircleCopies", "GridCopies", "ListedCopies"),
    "scene.discretisation": ("ConstantCollocation", "Galerkin", "HpGalerkin", "LinearGalerkin", "QuadraticGalerkin"),
    "scene.mesh_options": ("MeshOptions",),
    "scene.plane_motion": ("FarField", "RigidBody"),
    "scene.scene": ("Scene",),
    "scene.steps": ("Step",),
    "scene.toml": ("load_scene", "scene_from_toml", "scene_to_toml"),
    "scene.unit_names": ("UnitNames",),
    "solvers.alm": ("AugmentedLagrangian",),
    "solvers.base": ("ContactSolver", "Status", "solve"),
    "solvers.fixed_point": ("FixedPoint",),
    "solvers.ssn": ("SemismoothNewton",),
    "studies.sweep.sweep": ("sweep",),
    "studies.sweep.table": ("Sweep",),
    "studies.verification.verification": ("verify",),
    "testing.lemke": ("LemkePivoting",),
}
_MODULE_OF = {name: f"bemkit.{module}" for module, names in _HOME.items() for name in names}

__all__ = sorted(_MODULE_OF)


def __getattr__(name: str) -> Any:
    """Import a public name on first use."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'bemkit' has no attribute {name!r}")
    value = getattr(importlib.import_module(_MODULE_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return [*globals(), *__all__]
