"""Elasticity of a body seen from its boundary, from displacements to tractions, by Galerkin or by collocation.

Scenes take `galerkin.GalerkinElasticity` or `collocation.CollocationElasticity`; `maps` makes linear operators of scipy
of them.

On bounded bodies both maps hold their tractions in exact equilibrium of forces and moments, as the continuous map
does. Discretisation would break it slightly, and with it the independence of the arbitrary constant in the
logarithm of the single layer.

On the exterior of a body (`BoundaryMesh.is_exterior`) no motion is free of tractions, and tractions may have a
resultant F. The displacement then grows like F log(r / r0) with the distance r, and nothing but the choice of r0, the
diameter of the mesh, fixes its constant; without a resultant it vanishes at infinity, rotation included.
"""

from bemkit.operators.steklov_poincare.nodal_conditions import TractionField as TractionField
from bemkit.operators.steklov_poincare.protocol import CondensedMap as CondensedMap
from bemkit.operators.steklov_poincare.protocol import SteklovPoincare as SteklovPoincare
