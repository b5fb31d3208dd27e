"""Maps of an elastic body from boundary displacements to tractions, by Galerkin or by collocation.

Scenes use `galerkin.GalerkinElasticity` or `collocation.CollocationElasticity`; `bemkit.operators.boundary` makes scipy
linear operators of them.

On bounded bodies the tractions of both maps are in exact equilibrium of forces and moments, as those of the continuous
map. A plain discretisation would violate equilibrium slightly, and results would depend on the arbitrary constant in
the logarithm of the single layer.

On the exterior of a body (`BoundaryMesh.is_exterior`) every rigid motion causes tractions, and tractions may have a
resultant F. The displacement then grows like F log(r / r0) with the distance r; its constant depends on the choice of
r0, the diameter of the mesh. Without a resultant, displacement and rotation vanish at infinity.
"""

from bemkit.operators.steklov_poincare.nodal_conditions import TractionField as TractionField
from bemkit.operators.steklov_poincare.protocol import CondensedMap as CondensedMap
from bemkit.operators.steklov_poincare.protocol import SteklovPoincare as SteklovPoincare
