"""An independent check of a solution, from its own fields: no stiffness matrix, no active sets, no driver.

Only the physical fields of a `Solution`, the points of its mesh and the statement of its scene are read. Normals are
differentiated from the points, obstacles measured anew, and elasticity is tested with Kelvin's solution as printed in
textbooks. Resultants of forces inside are integrated anew; for Betti's theorem alone the particular solution of body
forces is taken off as the solver knows it. Whatever the drivers believe, these numbers say whether the fields obey
supports, contact and friction, whether forces and energy balance, and whether tractions and displacements belong to one
elastic body.
"""

from bemkit.studies.stability.independent_check.assembly_check import AssemblyCheck as AssemblyCheck
from bemkit.studies.stability.independent_check.assembly_check import check_assembly as check_assembly
from bemkit.studies.stability.independent_check.assembly_check import check_step as check_step
from bemkit.studies.stability.independent_check.boundary import CONTACT_LIMIT as CONTACT_LIMIT
from bemkit.studies.stability.independent_check.check import IndependentCheck as IndependentCheck
from bemkit.studies.stability.independent_check.check import check_solution as check_solution
from bemkit.studies.stability.independent_check.verdict import COARSE_LIMIT as COARSE_LIMIT
