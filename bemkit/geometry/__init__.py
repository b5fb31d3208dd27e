"""Curves, shapes, selections, gradings and boundary meshes."""

from typing import TYPE_CHECKING, Any

from bemkit.errors import GeometryError as GeometryError
from bemkit.errors import UnknownPartError as UnknownPartError
from bemkit.geometry.curves import Arc as Arc
from bemkit.geometry.curves import Curve as Curve
from bemkit.geometry.curves import ParametricCurve as ParametricCurve
from bemkit.geometry.curves import Segment as Segment
from bemkit.geometry.mesh import BoundaryMesh as BoundaryMesh
from bemkit.geometry.meshing.discretise import Algebraic as Algebraic
from bemkit.geometry.meshing.discretise import Geometric as Geometric
from bemkit.geometry.meshing.discretise import Grading as Grading
from bemkit.geometry.meshing.discretise import Uniform as Uniform
from bemkit.geometry.meshing.discretise import discretise as discretise
from bemkit.geometry.outline import Outline as Outline
from bemkit.geometry.outline import Selection as Selection
from bemkit.geometry.outline import Side as Side
from bemkit.geometry.outline import breakpoints as breakpoints
from bemkit.geometry.shapes import Disk as Disk
from bemkit.geometry.shapes import ExteriorOf as ExteriorOf
from bemkit.geometry.shapes import PlateWithHole as PlateWithHole
from bemkit.geometry.shapes import Polygon as Polygon
from bemkit.geometry.shapes import Rectangle as Rectangle
from bemkit.geometry.shapes import Ring as Ring
from bemkit.geometry.shapes import Sector as Sector
from bemkit.geometry.shapes import Shape as Shape

if TYPE_CHECKING:
    from bemkit.geometry.files.meshio_files import read_mesh as read_mesh
    from bemkit.geometry.files.meshio_files import write_mesh as write_mesh
    from bemkit.geometry.symmetry.lines import Symmetry as Symmetry
else:

    def __getattr__(name: str) -> Any:
        """Import symmetry, and what reads and writes files of meshes, when it is first used."""
        if name == "Symmetry":
            from bemkit.geometry.symmetry.lines import Symmetry

            return Symmetry
        if name not in ("read_mesh", "write_mesh"):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from bemkit.geometry.files import meshio_files

        return getattr(meshio_files, name)
