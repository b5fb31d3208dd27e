"""Fill the tables of ``docs/references.md`` from the package's bibliography: ``python docs/make_bibliography.py``."""

from __future__ import annotations

from pathlib import Path

from markers import between

from bemkit.results.citations import works

PAGE = Path(__file__).parent / "references.md"
TOPICS = ("contact", "closed-forms", "meshes", "operators")


def main() -> None:
    """Write the page."""
    PAGE.write_text(filled(PAGE.read_text("utf-8")), "utf-8")


def filled(page: str) -> str:
    """Return the page with a table for each topic."""
    for topic in TOPICS:
        lines = ["| key | source |", "|---|---|"]
        lines += [
            f"| `[{work.key}]` | {work.text(emphasis='*')} {work.about}".rstrip() + " |"
            for work in works().values()
            if work.topic == topic
        ]
        page = between(page, topic, "\n".join(lines))
    return page


if __name__ == "__main__":
    main()
