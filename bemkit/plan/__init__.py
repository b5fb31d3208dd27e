"""Only what the scene needs: the cost of a scene, what is skipped, and why."""

from bemkit.operators.steklov_poincare.cost import PlanItem as PlanItem
from bemkit.plan.items import Sizes as Sizes
from bemkit.plan.plan import Plan as Plan
from bemkit.plan.plan import TooLargeError as TooLargeError
from bemkit.plan.plan import announce_plan as announce_plan
from bemkit.plan.plan import check_elements as check_elements
from bemkit.plan.plan import check_memory as check_memory
from bemkit.plan.plan import make_plan as make_plan
from bemkit.plan.plan import plan_steps as plan_steps
