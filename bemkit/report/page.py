"""Reports: a result as one page that needs nothing else."""

from __future__ import annotations

from pathlib import Path

from bemkit.atomic_files import check_target
from bemkit.pictures.shown import Result
from bemkit.report.html import Element, element, facts, render
from bemkit.report.pictures import has_pictures, picture_elements
from bemkit.report.sections import (
    badge,
    certificate_section,
    convergence_section,
    forces_section,
    headline_rows,
    plan_section,
    scene_section,
    timing_section,
    version_section,
    warnings_section,
)
from bemkit.results.outputs import begins_with, write_text

_START = "<!DOCTYPE html>"
_STYLE = """
:root { color-scheme: light dark; --ink: #1b1f24; --page: #ffffff; --faint: #57606a; --line: #d0d7de; --tint: #f6f8fa; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6edf3; --page: #0d1117; --faint: #9ba7b4; --line: #3d444d; --tint: #161b22; }
}
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1rem; max-width: 72rem; color: var(--ink); background: var(--page);
  font: 1rem/1.5 system-ui, sans-serif; overflow-wrap: break-word; }
h1 { font-size: 1.6rem; line-height: 1.25; } h2 { font-size: 1.25rem; margin-top: 2.2rem;
  border-bottom: 1px solid var(--line); }
a { color: inherit; } nav ul { display: flex; flex-wrap: wrap; gap: .25rem 1.2rem; padding: 0; list-style: none; }
.badge { padding: .1rem .6rem; border-radius: 1rem; color: #ffffff; }
.good { background: #1a7f37; } .doubtful { background: #9a6700; } .bad { background: #cf222e; }
.scroll { overflow-x: auto; margin: 1rem 0; } table { border-collapse: collapse; font-size: .9rem; }
caption { text-align: left; color: var(--faint); padding-bottom: .3rem; }
th, td { padding: .25rem .7rem; border-bottom: 1px solid var(--line); text-align: left; vertical-align: top; }
thead th { background: var(--tint); } .number { text-align: right; font-variant-numeric: tabular-nums; }
pre { overflow-x: auto; padding: .8rem; background: var(--tint); border: 1px solid var(--line); font-size: .85rem; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 27rem), 1fr)); gap: 1rem; }
figure { margin: 0; break-inside: avoid; } figcaption { color: var(--faint); font-size: .9rem; }
img { width: 100%; height: auto; background: #ffffff; border: 1px solid var(--line); }
@media print { :root { --ink: #000000; --page: #ffffff; --faint: #333333; --line: #999999; --tint: #ffffff; }
  nav { display: none; } body { max-width: none; font-size: 10pt; } .scroll, pre { overflow: visible; }
  pre { white-space: pre-wrap; } .badge { border: 1px solid; color: #000000; background: none; }
  tr, h2 { break-inside: avoid; } h2 { break-after: avoid; } }
"""


def report(result: Result) -> str:
    """Return a page of HTML on a result: summary, pictures, tables, certificate, plan, scene and versions.

    Parameters
    ----------
    result : Solution or AssemblySolution

    Returns
    -------
    str
        The page loads nothing from elsewhere: pictures are inside, if matplotlib is installed.
    """
    sections: dict[str, list[Element]] = {
        "Summary": [facts(headline_rows(result), "The result in numbers")],
        "Warnings": warnings_section(result),
        "Pictures": _pictures(result),
        "Forces": forces_section(result),
        "Certificate": certificate_section(result),
        "Convergence": convergence_section(result),
        "Plan": plan_section(result.plan),
        "Scene": scene_section(result),
        "Run times": timing_section(result),
        "Versions": version_section(),
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
        element("style", _STYLE),
    )
    return f"{_START}\n{render(element('html', head, body, lang='en'))}\n"


def save_report(path: str | Path, result: Result) -> Path:
    """Write the report of a result to a file, replacing an older report at once or not at all; see `report`.

    Raises
    ------
    OutputFileError
        If the file cannot be written, or a file that is no page stands in the way.
    """
    target = check_report(path)
    write_text(str(target), report(result))
    return target


def check_report(path: str | Path) -> Path:
    """Find out whether a report can be written, and return its path; OutputFileError if not."""
    return check_target(Path(path), "report", lambda existing: begins_with(existing, _START))


def _pictures(result: Result) -> list[Element]:
    if not has_pictures():
        return [element("p", 'Pictures need matplotlib: pip install "bemkit[plot]".')]
    return [element("div", *picture_elements(result), class_="pictures")]


def _section(name: str, content: list[Element]) -> Element:
    place = _identifier(name)
    return element("section", element("h2", name, id=place), *content, aria_labelledby=place)


def _identifier(name: str) -> str:
    return name.lower().replace(" ", "-")
