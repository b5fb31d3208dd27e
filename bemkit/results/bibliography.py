"""The works that bemkit builds on, by the keys that docstrings cite, as text and as BibTeX."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType

from bemkit.version import __version__

PACKAGE = "bemkit"
"""The key of the package itself."""


@dataclass(frozen=True, kw_only=True)
class Work:
    """A published work.

    Parameters
    ----------
    key : str
        Such as ``"AlartCurnier1991"``.
    topic : str
        The table of ``docs/references.md`` in which it stands.
    type : str
        Of the BibTeX entry: article, book, incollection or misc.
    title : str
    author : tuple of str
        Empty where unknown; braces hold a name together that is no person's.
    journal, volume, pages, publisher, booktitle, editor, edition, url, note : str
        Empty where they do not apply.
    year : int, optional
    about : str
        What it is cited for.
    """

    key: str
    topic: str
    type: str
    title: str
    author: tuple[str, ...] = ()
    journal: str = ""
    volume: str = ""
    pages: str = ""
    publisher: str = ""
    booktitle: str = ""
    editor: str = ""
    edition: str = ""
    url: str = ""
    note: str = ""
    year: int | None = None
    about: str = ""

    def text(self, emphasis: str = "") -> str:
        """Return authors, title, source and year in one line; marks such as ``*`` go around what is set in italics."""
        authors = ", ".join(name.strip("{}") for name in self.author).replace(", others", " and others")
        title, where = self.title, ""
        year = "" if self.year is None else str(self.year)
        if self.journal:
            where = f" {emphasis}{self.journal}{emphasis} {self.volume} ({year}) {self.pages}".rstrip()
        else:
            title = title if self.booktitle else f"{emphasis}{title}{emphasis}"
            edition = f", {self.edition} edition" if self.edition else ""
            booktitle = f"In {self.editor} (ed.): {emphasis}{self.booktitle}{emphasis}" if self.booktitle else ""
            pieces = (booktitle, self.publisher, self.url, self.note, year)
            where = f"{edition}. " + ", ".join(filter(None, pieces)) if any(pieces) else edition
        return f"{authors}: {title}{'.' if self.journal else ''}{where}.".removeprefix(": ")

    def bibtex(self) -> str:
        """Return the entry for a BibTeX file in UTF-8."""
        fields = {
            "author": " and ".join(self.author),
            "title": f"{{{self.title}}}",
            "pages": self.pages.replace("-", "--"),
            "year": "" if self.year is None else str(self.year),
        }
        for name in ("journal", "volume", "publisher", "booktitle", "editor", "edition", "url", "note"):
            fields[name] = getattr(self, name)
        lines = [f"  {name} = {{{value}}}," for name, value in fields.items() if value]
        return "\n".join((f"@{self.type}{{{self.key},", *lines, "}"))


@cache
def works() -> Mapping[str, Work]:
    """Return all works by their keys, that of the package with its version."""
    tables = tomllib.loads((resources.files("bemkit") / "results" / "bibliography.toml").read_text("utf-8"))
    tables[PACKAGE]["note"] = f"Version {__version__}"
    found = {
        key: Work(key=key, **(table | {"author": tuple(table.get("author", ()))})) for key, table in tables.items()
    }
    return MappingProxyType(found)
