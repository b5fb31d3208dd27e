"""An independent check of a solution, from its own fields: no stiffness matrix, no active sets, no solver.

Only the physical fields of a `Solution`, the points of its mesh and the statement of its scene are read. Normals are
differentiated from the points, obstacles measured anew, and elasticity is tested with Kelvin's solution as printed in
textbooks. Resultants of forces inside are integrated anew; only for Betti's theorem the particular solution of body
forces is that of the solver. Independent of the solvers, these numbers say whether the fields obey
supports, contact and friction, whether forces and energy balance, and whether tractions and displacements belong to one
elastic body.
"""

from bemkit.testing.independent_check.bodies import COARSE_LIMIT as COARSE_LIMIT
from bemkit.testing.independent_check.check import violations_of as violations_of
from bemkit.testing.independent_check.load_history import energy_fault as energy_fault
from bemkit.testing.independent_check.scales import CONTACT_LIMIT as CONTACT_LIMIT
from bemkit.testing.independent_check.verdict import Violations as Violations
