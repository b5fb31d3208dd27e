"""HTML of scenes, plans and results in notebooks: a short table, and a picture if matplotlib is installed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence

from bemkit.errors import BemkitError
from bemkit.pictures.catalogue import find_picture
from bemkit.pictures.deformation import draw_deformation, draw_scene
from bemkit.pictures.drawing import Axes
from bemkit.pictures.load_history import draw_friction_loop
from bemkit.plan.plan import Plan
from bemkit.report.html import Element, element, facts, image, render, table
from bemkit.report.pictures import has_pictures
from bemkit.report.sections import badge, plan_section
from bemkit.results.solution import Solution
from bemkit.results.solved_steps import SolvedSteps
from bemkit.results.summary_rows import summary_rows
from bemkit.scene.scene import Scene

_DOTS_PER_INCH = 72
_MOST_STEPS = 12
"""That a table lists."""


def notebook_html(value: object) -> str:
    """Return the representation of a value in a notebook, by default its `repr`."""
    match value:
        case SolvedSteps():
            return _with_pictures(_steps(value), _pictures_of(value[-1]), value[-1].title)
        case Solution():
            return _with_pictures(_result(value), _pictures_of(value), value.title)
        case Scene():
            return _with_pictures(facts(_scene_rows(value), "Scene"), [lambda: draw_scene(value)], value.title)
        case Plan():
            return render(element("div", *plan_section(value)))
    return render(element("pre", repr(value)))


def _result(result: Solution) -> Element:
    warnings = [element("li", warning.text) for warning in result.warnings]
    lists = [element("ul", *warnings)] if warnings else []
    return element("div", element("p", badge(result)), facts(summary_rows(result), "Result"), *lists)


def _pictures_of(result: Solution) -> list[Callable[[], Axes]]:
    """Return how to draw the bodies, and the friction loop of a load history."""
    loop = find_picture("friction-loop")
    draws = [lambda: draw_deformation(result)]
    return draws if loop.why_not(result) else [*draws, lambda: draw_friction_loop(result)]


def _steps(steps: SolvedSteps) -> Element:
    """Return a table of the first and last steps."""
    numbers = [number for number in range(len(steps)) if min(number, len(steps) - 1 - number) < _MOST_STEPS // 2]
    rows = []
    for number in numbers:
        step = steps[number]
        words = step.contact.status_words()
        rows.append(
            {
                "step": number + 1,
                "status": step.status_words,
                "normal force": step.force_normal,
                "friction force": step.force_tangential,
                **{word: words.count(word) for word in ("separated", "slip", "stick")},
            }
        )
    caption = "Load steps" if len(rows) == len(steps) else f"The first and the last of {len(steps)} load steps"
    return element("div", element("p", badge(steps[-1])), table(rows, caption))


def _scene_rows(scene: Scene) -> Iterable[tuple[str, str]]:
    if scene.bodies:
        yield "bodies", str(len(scene.placed_bodies))
        yield "contacts", str(len(scene.contacts)) + (", others are found" if scene.touching is not None else "")
    else:
        body = scene.only
        yield "shape", type(body.shape).__name__
        material = body.material
        yield "material", f"E = {material.youngs_modulus:g}, \u03bd = {material.poisson_ratio:g}"
        kinds = Counter(type(part.condition).__name__ for part in scene.parts)
        yield "parts", ", ".join(f"{count} {kind}" for kind, count in kinds.items()) or "none"
    yield "law", repr(scene.law)
    yield "discretisation", repr(scene.discretisation)
    accuracy, elements = scene.mesh.accuracy, scene.mesh.elements
    yield "mesh", f"accuracy {accuracy:g}" if accuracy is not None else f"{elements or 'default'} elements"


def _with_pictures(content: Element, draw: Sequence[Callable[[], Axes]], title: str) -> str:
    """Put pictures beside a table, or the reason why there are none."""
    pictures = []
    try:
        for each in draw if has_pictures() else ():
            figure = each().get_figure(root=True)
            pictures.append(image(figure, f"Picture of {title}", _DOTS_PER_INCH))  # type: ignore[arg-type]
    except BemkitError as error:  # a scene that cannot be divided, say
        pictures.append(element("p", f"No picture: {error}"))
    style = "display: flex; flex-wrap: wrap; gap: 1em; align-items: flex-start;"
    words = element("div", element("p", element("strong", title)), content)
    return render(element("div", words, *pictures, style=style))
