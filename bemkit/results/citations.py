"""The works to cite for the methods of a scene or of a run, as entries of a BibTeX file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType

from bemkit.geometry.curves import Segment
from bemkit.geometry.shapes import ElasticHalfPlane, PeriodicHalfPlane
from bemkit.results.solution import Solution
from bemkit.scene.discretisation import ConstantCollocation, Discretisation, Galerkin
from bemkit.scene.registry import LAWS, SOLVERS
from bemkit.scene.scene import Scene
from bemkit.solvers.fallbacks import drivers_at_work

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
"""The works behind each built-in solver, by its word in scene files."""

LAW_WORKS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"slip-weakening": ("Ida1972",), "rate-strengthening": ("Dieterich1979",)}
)
"""The works behind friction laws that are not in textbooks, by their words in scene files."""


@cache
def entries() -> Mapping[str, str]:
    """Return the entries of ``references.bib`` by their keys, as the file has them."""
    text = (resources.files("bemkit") / "results" / "references.bib").read_text("utf-8")
    found = (f"@{entry.strip()}" for entry in text.split("\n@")[1:])
    return MappingProxyType({entry[entry.index("{") + 1 : entry.index(",")]: entry for entry in found})


@dataclass(frozen=True)
class Method:
    """A method and the works behind it.

    Parameters
    ----------
    name : str
    keys : tuple of str
        In ``references.bib``; none for a method from elsewhere.
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
    def keys(self) -> tuple[str, ...]:
        """The keys of all works, each once."""
        return tuple(dict.fromkeys(key for method in self.methods for key in method.keys))

    def __str__(self) -> str:
        """Return the methods with their keys as comments of a BibTeX file, then the entries."""
        lines = [
            f"% {each.name}: {', '.join(each.keys) or 'not part of bemkit, ask its author'}" for each in self.methods
        ]
        if self.reference:
            lines.append(f"% the scene: {' '.join(self.reference.split())}")
        return "\n\n".join(["\n".join(lines), *(entries()[key] for key in self.keys)])


def cite(subject: Scene | Solution) -> Citations:
    """Return the references of the methods of a scene or of a result.

    Parameters
    ----------
    subject : Scene or Solution
        A solution contains more than its scene: the linear solver that was chosen, and which solvers took part.

    Returns
    -------
    Citations
        ``print`` shows a BibTeX file: the methods as comments, then the entries of their works.
    """
    stated = subject if isinstance(subject, Scene) else subject.stated
    messages = [] if isinstance(subject, Scene) else [record.message for record in subject.history]
    methods = [Method("bemkit", (PACKAGE,)), *_of_bodies(stated), *_of_contact(stated, messages)]
    if not isinstance(subject, Scene):
        methods += _of_run(subject)
    return Citations(tuple(dict.fromkeys(methods)), stated.reference)


def _of_bodies(stated: Scene) -> Iterator[Method]:
    bodies = stated.placed_bodies
    is_adaptive = stated.mesh.accuracy is not None
    with_boundary = [body for body in bodies if not isinstance(body.shape, ElasticHalfPlane | PeriodicHalfPlane)]
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
    elif isinstance(discretisation, Galerkin):
        yield Method("symmetric Galerkin boundary elements", ("Paper", "Steinbach2008", "SauterSchwab2011", "Han1994"))
    else:
        yield Method(f"{discretisation.method} of {type(discretisation).__module__}", ())
    if has_layers:
        yield Method("geometric layers and rising degrees", ("BabuskaGuo1986", "BanzStephan2015"))
        yield Method("error estimates from Legendre coefficients", ("Mavriplis1994",))
        yield Method("corners where contact tractions have no bound", ("Williams1952",))


def _of_contact(stated: Scene, messages: list[str]) -> Iterator[Method]:
    if stated.contacts or stated.touching is not None:
        yield Method(
            "mortar coupling with dual multipliers",
            ("Wohlmuth2000", "PusoLaursen2004", "PoppEtAl2010", "CichoszBischoff2011"),
        )
    if not stated.has_contact:
        return
    yield Method("contact and friction as projection equations", ("Paper", "AlartCurnier1991", "QiSun1993"))
    laws = [law for body in stated.placed_bodies for law in stated.scene_of(body).laws.values()]
    laws += [each.law for each in (*stated.contacts, stated.touching) if each is not None and each.law is not None]
    for law in (stated.law, *laws):
        if keys := LAW_WORKS.get(LAWS.name_of(law)):
            yield Method(f"law {LAWS.name_of(law)}", keys)
    for word in map(SOLVERS.name_of, drivers_at_work(stated.solver, messages)):
        yield Method(f"solver {word}", DRIVERS.get(word, ()))


def _of_run(solution: Solution) -> Iterator[Method]:
    if any("fast multipole" in item.reason for item in solution.plan.items):
        yield Method("products by the fast multipole method", ("GreengardRokhlin1987", "Muskhelishvili1953"))
        yield Method("GMRES with sums over a hierarchy", ("SaadSchultz1986", "BramblePasciakXu1990"))
    if any(item.is_needed and "multigrid" in item.name for item in solution.plan.items):
        yield Method("algebraic multigrid", ("RugeStueben1987",))
