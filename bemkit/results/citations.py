"""The works that bemkit builds on, as text and as BibTeX, and which of them stand behind a scene or a run of it."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType

from bemkit.geometry.curves import Segment
from bemkit.geometry.shapes import HalfPlaneBody, PeriodicHalfPlaneBody
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.solution import Solution
from bemkit.scene.assembly import Assembly
from bemkit.scene.body import Body
from bemkit.scene.discretisation import ConstantCollocation, Discretisation, Galerkin
from bemkit.scene.registry import LAWS, SOLVERS
from bemkit.scene.scene import Scene
from bemkit.solvers.fallbacks import drivers_at_work
from bemkit.version import __version__

PACKAGE = "bemkit"
"""The key of the package itself."""
_NEWTON = ("HintermuellerItoKunisch2002", "HueeberStadlerWohlmuth2008", "ChristensenEtAl1998")
DRIVERS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "semismooth-newton": _NEWTON,
        "springs": ("Rockafellar1976",),
        "solution-path": ("Lemke1965", "CottlePangStone1992"),
        "augmented-lagrangian": ("Paper", "Stadler2004"),
        "fixed-point": ("NecasJarusekHaslinger1980", *_NEWTON),
        "lemke": ("Lemke1965", "CottlePangStone1992", "StewartTrinkle1996"),
    }
)
"""The works behind each built-in driver, by its word in scene files."""

LAW_WORKS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"slip-weakening": ("Ida1972",), "rate-strengthening": ("Dieterich1979",)}
)
"""The works behind friction laws that are no textbook matter, by their words in scene files."""


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


@dataclass(frozen=True)
class Method:
    """A method and the works behind it.

    Parameters
    ----------
    name : str
    keys : tuple of str
        In the bibliography; none of a method that bemkit does not come with.
    """

    name: str
    keys: tuple[str, ...]


@dataclass(frozen=True)
class Citations:
    """Methods of a scene or of a run, the package first.

    Parameters
    ----------
    methods : tuple of Method
    reference : str
        Where the scene comes from, in its own words; may be empty.
    """

    methods: tuple[Method, ...]
    reference: str = ""

    @property
    def works(self) -> tuple[Work, ...]:
        """The works of all methods, each once."""
        return tuple(works()[key] for key in dict.fromkeys(key for method in self.methods for key in method.keys))

    def __str__(self) -> str:
        """Return the methods, each with its works, as text."""
        lines = []
        for method in self.methods:
            lines.append(method.name)
            lines += [f"    {works()[key].text()}" for key in method.keys] or ["    not part of bemkit: ask its author"]
        if self.reference:
            lines += ["the scene", f"    {' '.join(self.reference.split())}"]
        return "\n".join(lines)

    def bibtex(self) -> str:
        """Return the works as entries of a BibTeX file."""
        return "\n\n".join(work.bibtex() for work in self.works)


def cite(subject: Scene | Assembly | Solution | AssemblySolution) -> Citations:
    """Name the works to cite for a scene, or for what a run of it used.

    Parameters
    ----------
    subject : Scene, Assembly, Solution or AssemblySolution
        A solution tells more than its scene: the linear solver that was chosen, and which drivers took part.

    Returns
    -------
    Citations
        ``print`` shows the methods with their works; `Citations.bibtex` has them for a BibTeX file.
    """
    stated = subject if isinstance(subject, Scene | Assembly) else subject.stated
    messages = [] if isinstance(subject, Scene | Assembly) else [record.message for record in subject.history]
    methods = [Method("bemkit", (PACKAGE,)), *_of_bodies(stated), *_of_contact(stated, messages)]
    if not isinstance(subject, Scene | Assembly):
        methods += _of_run(subject)
    return Citations(tuple(dict.fromkeys(methods)), stated.reference)


def _of_bodies(stated: Scene | Assembly) -> Iterator[Method]:
    bodies: tuple[Scene | Body, ...] = stated.bodies if isinstance(stated, Assembly) else (stated,)
    is_adaptive = stated.mesh.accuracy is not None
    with_boundary = [body for body in bodies if not isinstance(body.shape, HalfPlaneBody | PeriodicHalfPlaneBody)]
    if len(with_boundary) < len(bodies):
        yield Method("flexibility of the surface of a half-plane in closed form", ("Johnson1985",))
    for discretisation in (body.discretisation or stated.discretisation for body in with_boundary):
        degree = discretisation.largest_degree if isinstance(discretisation, Galerkin) else 0
        has_layers = is_adaptive and (stated.mesh.rising_degrees or degree > 2)
        yield from _of_discretisation(discretisation, has_layers=has_layers)
    sides = [side for body in with_boundary for side in body.shape.outline().sides]
    if any(not isinstance(side.curve, Segment) for side in sides):
        yield Method("integrals near curved elements", ("AfKlintebergBarnett2021",))
    if any(body.body_forces for body in bodies):
        yield Method("body forces in closed form", ("TimoshenkoGoodier1970",))


def _of_discretisation(discretisation: Discretisation, *, has_layers: bool) -> Iterator[Method]:
    if isinstance(discretisation, ConstantCollocation):
        yield Method("collocation with constant elements", ("Paper", "Somigliana1885", "Betti1872"))
    elif discretisation.is_symmetric:
        yield Method("symmetric Galerkin boundary elements", ("Paper", "Steinbach2008", "SauterSchwab2011", "Han1994"))
    else:
        yield Method(f"{discretisation.method} of {type(discretisation).__module__}", ())
    if has_layers:
        yield Method("geometric layers and rising degrees", ("BabuskaGuo1986", "BanzStephan2015"))
        yield Method("error estimates from Legendre coefficients", ("Mavriplis1994",))
        yield Method("corners where contact tractions have no bound", ("Williams1952",))


def _of_contact(stated: Scene | Assembly, messages: list[str]) -> Iterator[Method]:
    if isinstance(stated, Assembly) and (stated.contacts or stated.touching is not None):
        yield Method(
            "mortar coupling with dual multipliers",
            ("Wohlmuth2000", "PusoLaursen2004", "PoppEtAl2010", "CichoszBischoff2011"),
        )
    if isinstance(stated, Scene) and not stated.contact_parts:
        return
    yield Method("contact and friction as projection equations", ("Paper", "AlartCurnier1991", "QiSun1993"))
    if isinstance(stated, Scene):
        own = list(stated.laws.values())
    else:
        own = [each.law for each in (*stated.contacts, stated.touching) if each is not None and each.law is not None]
    for law in (stated.law, *own):
        if keys := LAW_WORKS.get(LAWS.word_of(law)):
            yield Method(f"law {LAWS.word_of(law)}", keys)
    for word in map(SOLVERS.word_of, drivers_at_work(stated.solver, messages)):
        yield Method(f"driver {word}", DRIVERS.get(word, ()))


def _of_run(solution: Solution | AssemblySolution) -> Iterator[Method]:
    if any("fast multipole" in item.reason for item in solution.plan.items):
        yield Method("products by the fast multipole method", ("GreengardRokhlin1987", "Muskhelishvili1953"))
        yield Method("GMRES with sums over a hierarchy", ("SaadSchultz1986", "BramblePasciakXu1990"))
    if any(item.is_needed and "multigrid" in item.name for item in solution.plan.items):
        yield Method("algebraic multigrid", ("RugeStueben1987",))
