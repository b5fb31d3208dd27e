"""Only what the scene needs: what a scene will take, what is left out, and why; the solver follows the plan."""

from bemkit.plan.costs import Cost as Cost
from bemkit.plan.costs import Stage as Stage
from bemkit.plan.decisions import Decisions as Decisions
from bemkit.plan.decisions import Formulation as Formulation
from bemkit.plan.items import PlanItem as PlanItem
from bemkit.plan.items import Wishes as Wishes
from bemkit.plan.machine import Machine as Machine
from bemkit.plan.machine import this_machine as this_machine
from bemkit.plan.make import Plan as Plan
from bemkit.plan.make import make_plan as make_plan
from bemkit.plan.memory import TooLargeError as TooLargeError
from bemkit.plan.memory import check_elements as check_elements
from bemkit.plan.memory import check_memory as check_memory
from bemkit.plan.sizes import Sizes as Sizes
