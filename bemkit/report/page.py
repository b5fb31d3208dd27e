"""Reports: a result as one page that needs nothing else."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from bemkit.atomic_files import OutputFileError, check_target, write_text
from bemkit.report.html import Element, element, facts, render
from bemkit.report.pictures import has_pictures, picture_elements
from bemkit.report.sections import (
    badge,
    certificate_section,
    convergence_section,
    forces_section,
    plan_section,
    scene_section,
    timing_section,
    version_section,
    warnings_section,
)
from bemkit.results.solution import Solution
from bemkit.results.summary_rows import summary_rows

_START = "<!DOCTYPE html>"


def report(result: Solution, *, interactive: bool = False) -> str:
    """Return a page of HTML on a result: summary, pictures, tables, certificate, plan, scene and versions.

    Parameters
    ----------
    result : Solution
    interactive : bool
        Whether a drawing to explore takes the place of the pictures; needs plotly.

    Returns
    -------
    str
        The page loads nothing from elsewhere: pictures are inside, if matplotlib is installed.

    Raises
    ------
    InputError
        If an interactive page is asked for and plotly is not installed.
    """
    sections: dict[str, list[Element]] = {
        "Summary": [facts(summary_rows(result), "The result in numbers")],
        "Warnings": warnings_section(result),
        "Pictures": _pictures(result, interactive),
        "Forces": forces_section(result),
        "Certificate": certificate_section(result),
        "Convergence": convergence_section(result),
        "Plan": plan_section(result.plan),
        "Scene": scene_section(result),
        "Run times": timing_section(result),
        "Versions": version_section(result),
    }
    links = [element("li", element("a", name, href=f"#{_identifier(name)}")) for name in sections]
    body = element(
        "body",
        element(
            "header",
            element("h1", result.title),
            element("p", badge(result), f" {result.message or result.status.value}"),
        ),
        element("nav", element("ul", *links), aria_label="Contents"),
        element("main", *(_section(name, content) for name, content in sections.items())),
    )
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("title", f"{result.title} \u2013 bemkit report"),
        element("style", _style()),
    )
    return f"{_START}\n{render(element('html', head, body, lang='en'))}\n"


def save_report(path: str | Path, result: Solution, *, interactive: bool = False) -> Path:
    """Write the report of a result to a file, replacing an older report at once or not at all; see `report`.

    Raises
    ------
    OutputFileError
        If the file cannot be written, or a file that is no page has its name.
    """
    target = check_report(path, interactive=interactive)
    write_text(target, report(result, interactive=interactive))
    return target


def check_report(path: str | Path, *, interactive: bool = False) -> Path:
    """Find out whether a report can be written, and return its path.

    Raises
    ------
    OutputFileError
    InputError
        If an interactive page is asked for and plotly is not installed.
    """
    if interactive:
        from bemkit.report.interactive import check_interactive

        check_interactive()
    if Path(path).suffix.lower() not in (".html", ".htm"):
        raise OutputFileError(f"{path}: a report is a page of HTML: give a name that ends in .html")
    return check_target(Path(path))


def _style() -> str:
    return (resources.files("bemkit") / "report" / "page.css").read_text("utf-8")


def _pictures(result: Solution, interactive: bool) -> list[Element]:
    if interactive:
        from bemkit.report.interactive import interactive_elements

        return interactive_elements(result)
    if not has_pictures():
        return [element("p", 'Pictures need matplotlib: pip install "bemkit[plot]".')]
    return [element("div", *picture_elements(result), class_="pictures")]


def _section(name: str, content: list[Element]) -> Element:
    place = _identifier(name)
    return element("section", element("h2", name, id=place), *content, aria_labelledby=place)


def _identifier(name: str) -> str:
    return name.lower().replace(" ", "-")
