"""Pictures of results inside pages, with alternative texts."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec

from bemkit.pictures.catalogue import Picture, default_pictures, find_picture
from bemkit.report.html import Element, element, image
from bemkit.results.solution import Solution
from bemkit.scene.unit_names import amount
from bemkit.stopwatch import announce

FURTHER = ("friction-cone", "convergence")
"""Pictures of a report besides those that suit the result."""


def has_pictures() -> bool:
    """Whether matplotlib is installed."""
    return find_spec("matplotlib") is not None


def picture_elements(result: Solution) -> Iterator[Element]:
    """Yield each picture of a result with its caption."""
    chosen = default_pictures(result)
    further = [find_picture(name) for name in FURTHER]
    chosen += [picture for picture in further if not picture.why_not(result) and _suits(picture, result)]
    for picture in chosen:
        announce(f"draw {picture.name}")
        parts = result.contact.parts
        for number, axes in enumerate(picture.axes(result).values()):
            part = parts[number] if picture.is_along_contacts else None
            caption = _caption(picture, part)
            figure = axes.get_figure(root=True)
            alternative = f"{caption}. {_in_words(result, part)}"
            yield element("figure", image(figure, alternative), element("figcaption", caption))  # type: ignore[arg-type]


def _suits(picture: Picture, result: Solution) -> bool:
    """Whether another picture is useful: friction of few contacts, convergence of several steps."""
    if picture.name == "convergence":
        return len(result.history) > 1
    return result.friction_bound is not None and find_picture("traction").is_default(result)


def _caption(picture: Picture, part: str | None) -> str:
    shows = picture.shows.replace("along each contact", "").rstrip(", ")
    name = shows[0].upper() + shows[1:]
    return name if part is None else f"{name} along '{part}'"


def _in_words(result: Solution, part: str | None) -> str:
    """Return the most important numbers of a contact, or of all."""
    table = result.contact
    if not table.n_contact:
        return f"Of: {result.title}."
    rows = table.rows(part) if part is not None else table.weight >= 0.0
    words = [word for word, is_own in zip(table.status_words(), rows.tolist(), strict=True) if is_own]
    counts = ", ".join(f"{words.count(word)} {word}" for word in dict.fromkeys(words))
    peak = amount(float(max(-table.sigma_n[rows].min(), 0.0)), "stress", result.units)
    return f"Of: {result.title}. Contact nodes: {counts}. Largest pressure: {peak}."
