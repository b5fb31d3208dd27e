"""What notebooks show of scenes, plans and results: a short table, and a picture if matplotlib is installed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from bemkit.errors import BemkitError
from bemkit.pictures.deformation import draw_deformation, draw_scene
from bemkit.pictures.shown import Result
from bemkit.plan import Plan
from bemkit.report.html import Element, element, facts, image, render
from bemkit.report.pictures import has_pictures
from bemkit.report.sections import badge, headline_rows, plan_section
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.solution import Solution
from bemkit.scene.assembly import Assembly
from bemkit.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DOTS_PER_INCH = 72


def notebook_html(value: object) -> str:
    """Return what a notebook shows of a value, its `repr` if nothing better is known."""
    match value:
        case Solution() | AssemblySolution():
            return _with_picture(_result(value), lambda: draw_deformation(value), value.title)
        case Scene() | Assembly():
            return _with_picture(facts(_scene_rows(value), "Scene"), lambda: draw_scene(value), value.title)
        case Plan():
            return render(element("div", *plan_section(value)))
    return render(element("pre", repr(value)))


def _result(result: Result) -> Element:
    warnings = [element("li", warning) for warning in result.warnings]
    doubts = [element("ul", *warnings)] if warnings else []
    return element("div", element("p", badge(result)), facts(headline_rows(result), "Result"), *doubts)


def _scene_rows(scene: Scene | Assembly) -> Iterable[tuple[str, str]]:
    if isinstance(scene, Assembly):
        yield "bodies", str(len(scene.placed_bodies))
        yield "contacts", str(len(scene.contacts)) + (", others are found" if scene.touching is not None else "")
    else:
        yield "shape", type(scene.shape).__name__
        material = scene.material
        yield "material", f"E = {material.youngs_modulus:g}, \u03bd = {material.poisson_ratio:g}"
        kinds = Counter(type(part.condition).__name__ for part in scene.parts)
        yield "parts", ", ".join(f"{count} {kind}" for kind, count in kinds.items()) or "none"
    yield "law", repr(scene.law)
    yield "discretisation", repr(scene.discretisation)
    accuracy, elements = scene.mesh.accuracy, scene.mesh.elements
    yield "mesh", f"accuracy {accuracy:g}" if accuracy is not None else f"{elements or 'default'} elements"


def _with_picture(table: Element, draw: Callable[[], Axes], title: str) -> str:
    """Put a picture beside a table, or why there is none."""
    content = [element("p", element("strong", title)), table]
    if has_pictures():
        try:
            figure = draw().get_figure(root=True)
            content.append(image(figure, f"Picture of {title}", _DOTS_PER_INCH))  # type: ignore[arg-type]
        except BemkitError as error:  # a scene that cannot be divided, say
            content.append(element("p", f"No picture: {error}"))
    style = "display: flex; flex-wrap: wrap; gap: 1em; align-items: flex-start;"
    return render(element("div", element("div", *content[:2]), *content[2:], style=style))
