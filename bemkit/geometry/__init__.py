"""Curves, shapes, selections, gradings and boundary meshes."""

from bemkit.geometry.curve import Arc as Arc
from bemkit.geometry.curve import Curve as Curve
from bemkit.geometry.curve import ParametricCurve as ParametricCurve
from bemkit.geometry.curve import Segment as Segment
from bemkit.geometry.discretise import discretise as discretise
from bemkit.geometry.errors import GeometryError as GeometryError
from bemkit.geometry.errors import UnknownPartError as UnknownPartError
from bemkit.geometry.grading import Algebraic as Algebraic
from bemkit.geometry.grading import Geometric as Geometric
from bemkit.geometry.grading import Grading as Grading
from bemkit.geometry.grading import Uniform as Uniform
from bemkit.geometry.mesh import BoundaryMesh as BoundaryMesh
from bemkit.geometry.meshfile import read_mesh as read_mesh
from bemkit.geometry.meshfile import write_mesh as write_mesh
from bemkit.geometry.outline import Outline as Outline
from bemkit.geometry.outline import Side as Side
from bemkit.geometry.selection import Selection as Selection
from bemkit.geometry.selection import breakpoints as breakpoints
from bemkit.geometry.shapes import Disk as Disk
from bemkit.geometry.shapes import ExteriorOf as ExteriorOf
from bemkit.geometry.shapes import PlateWithHole as PlateWithHole
from bemkit.geometry.shapes import Polygon as Polygon
from bemkit.geometry.shapes import Rectangle as Rectangle
from bemkit.geometry.shapes import Ring as Ring
from bemkit.geometry.shapes import Shape as Shape
