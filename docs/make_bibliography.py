"""Fill the tables of ``docs/references.md`` from ``references.bib``: ``python docs/make_bibliography.py``."""

from __future__ import annotations

import re
from pathlib import Path

from markers import between

from bemkit.results.citations import entries

PAGE = Path(__file__).parent / "references.md"
TOPICS = ("contact", "closed-forms", "meshes", "operators")


def main() -> None:
    """Write the page."""
    PAGE.write_text(filled(PAGE.read_text("utf-8")), "utf-8")


def filled(page: str) -> str:
    """Return the page with a table for each topic."""
    works = {key: dict(re.findall(r"^  (\w+) = \{(.*)\},$", text, re.MULTILINE)) for key, text in entries().items()}
    for topic in TOPICS:
        rows = [f"| `[{key}]` | {line_of(work)} |" for key, work in works.items() if work["keywords"] == topic]
        page = between(page, topic, "\n".join(["| key | source |", "|---|---|", *rows]))
    return page


def line_of(work: dict[str, str]) -> str:
    """Return authors, title, source, year and remark of a work in one line."""
    authors = re.sub("[{}]", "", work.get("author", "")).replace(" and ", ", ").replace(", others", " and others")
    title = work["title"].strip("{}")
    if "journal" in work:
        where = " ".join(filter(None, (f"*{work['journal']}*", work.get("volume"), f"({work.get('year', '')})")))
        line = f"{title}. {where} {work.get('pages', '').replace('--', '-')}".rstrip()
    else:
        title = title if "booktitle" in work else f"*{title}*"
        edition = f", {work['edition']} edition" if "edition" in work else ""
        book = f"In {work['editor']} (ed.): *{work['booktitle']}*" if "booktitle" in work else ""
        pieces = (book, *(work.get(name, "") for name in ("publisher", "url", "note", "year")))
        line = f"{title}{edition}. {', '.join(filter(None, pieces))}".removesuffix(". ")
    return f"{authors}: {line}. {work.get('annote', '')}".removeprefix(": ").strip()


if __name__ == "__main__":
    main()
