"""HTML put together from elements, so that every text is escaped; no page loads anything from elsewhere."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from io import BytesIO
from typing import TypeAlias
from xml.etree import ElementTree

from bemkit.pictures.drawing import Figure

Element: TypeAlias = "ElementTree.Element[str]"
Content: TypeAlias = "Element | str"

_FORBIDDEN = re.compile(r"[^\t\n\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that no page may hold."""


def element(tag: str, *content: Content, **attributes: str) -> Element:
    """Return an element with texts and elements inside; attributes such as ``class_`` lose their underscore."""
    made = ElementTree.Element(tag, {name.rstrip("_").replace("_", "-"): value for name, value in attributes.items()})
    last: Element | None = None
    for each in content:
        if not isinstance(each, str):
            made.append(each)
            last = each
        elif last is None:
            made.text = (made.text or "") + _FORBIDDEN.sub("\ufffd", each)
        else:
            last.tail = (last.tail or "") + _FORBIDDEN.sub("\ufffd", each)
    return made


def render(root: Element) -> str:
    """Return an element as text."""
    return ElementTree.tostring(root, encoding="unicode", method="html")


def facts(rows: Iterable[tuple[str, str]], caption: str) -> Element:
    """Return a table of names and values, each row with a header of its own."""
    lines = [element("tr", element("th", name, scope="row"), element("td", value)) for name, value in rows]
    return _scrolling(element("table", element("caption", caption), element("tbody", *lines)), caption)


def table(rows: Sequence[Mapping[str, object]], caption: str, units: Mapping[str, str] | None = None) -> Element:
    """Return a table of rows that share their keys, which head the columns with their units.

    Numbers are aligned to the right.
    """
    names = list(rows[0]) if rows else []
    of_names = {name: f" [{units[name]}]" for name in names if units and units.get(name)}
    heads = (name.replace("_", " ") + of_names.get(name, "") for name in names)
    head = element("tr", *(element("th", each, scope="col") for each in heads))
    lines = [element("tr", *(_cell(row[name]) for name in names)) for row in rows]
    whole = element("table", element("caption", caption), element("thead", head), element("tbody", *lines))
    return _scrolling(whole, caption)


def image(figure: Figure, alternative: str, dots_per_inch: int = 110) -> Element:
    """Return a figure as a picture inside the page; the alternative says in words what it shows."""
    stream = BytesIO()
    figure.savefig(stream, format="png", dpi=dots_per_inch, metadata={"Software": None}, bbox_inches="tight")
    data = b64encode(stream.getvalue()).decode("ascii")
    return element("img", src=f"data:image/png;base64,{data}", alt=alternative)


def number(value: object, digits: int = 6) -> str:
    """Return a value as text, numbers with some digits."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def _cell(value: object) -> Element:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return element("td", number(value), **({"class_": "number"} if is_number else {}))


def _scrolling(content: Element, name: str) -> Element:
    """Return a region that scrolls sideways where a table is wider than the screen, by keys too."""
    return element("div", content, class_="scroll", role="region", aria_label=name, tabindex="0")
