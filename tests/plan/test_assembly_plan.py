from bemkit.contact.joined.sparse_form import sparse_solver_name
from bemkit.plan import make_plan
from tests.runs.masonry import wall


def _contact_line(courses, per_course):
    items = {item.name: item for item in make_plan(wall(courses, per_course, push=False)).items}
    return items["contact system"].reason


def test_the_plan_says_how_the_contact_system_is_solved():
    assert "one dense matrix of relative displacements" in _contact_line(2, 3)
    assert f"a sparse system, factored in every step by {sparse_solver_name()}" in _contact_line(10, 10)
