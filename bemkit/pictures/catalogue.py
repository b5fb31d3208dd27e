"""All pictures by name: what each shows, of what, and which are drawn where none is named."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from bemkit.errors import InputError
from bemkit.formulas import closest
from bemkit.operators.stopwatch import announce
from bemkit.pictures.boundary_traction import draw_boundary_traction
from bemkit.pictures.contact_curves import draw_contact_clearance, draw_contact_displacement, draw_contact_traction
from bemkit.pictures.contact_map import draw_contact_map
from bemkit.pictures.convergence import draw_convergence
from bemkit.pictures.deformation import draw_deformation, draw_scene
from bemkit.pictures.friction_cone import draw_friction_cone
from bemkit.pictures.load_history import draw_friction_loop, draw_work, has_friction
from bemkit.pictures.shown import Result
from bemkit.pictures.status_over_time import draw_status_over_time
from bemkit.pictures.stress import STRESSES, draw_stress
from bemkit.pictures.zoom import draw_zoom, is_short
from bemkit.results.assembly_solution import AssemblySolution

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_CONTACTS = 6
"""Contacts up to which each has pictures of its own where none is named."""


@dataclass(frozen=True)
class Picture:
    """A picture that can be asked for.

    Parameters
    ----------
    name : str
        Also of its file, without ending.
    shows : str
        What, in a few words.
    draw : callable (result) -> mapping of str to Axes
        By endings of file names: one, empty, or one for each contact if there are several.
    why_not : callable (result) -> str
        Why there is no such picture, empty if there is one.
    is_default : callable (result) -> bool
        Whether it is drawn where no picture is named; asked only where there is one.
    """

    name: str
    shows: str
    draw: Callable[[Result], Mapping[str, Axes]]
    why_not: Callable[[Result], str]
    is_default: Callable[[Result], bool]


def figures(result: Result, what: Sequence[str] | None = None) -> dict[str, Figure]:
    """Draw pictures of a result.

    Parameters
    ----------
    result : Solution or AssemblySolution
    what : sequence of str, optional
        Names of pictures, from `PICTURES`; by default those that suit the result.

    Returns
    -------
    dict of str to matplotlib.figure.Figure
        By names, with the number of the contact where there are several: ``traction-2``.

    Raises
    ------
    InputError
        If a name is unknown, or there is no such picture of the result.
    """
    chosen = default_pictures(result) if what is None else [find_picture(name) for name in dict.fromkeys(what)]
    found = {}
    for picture in chosen:
        if reason := picture.why_not(result):
            raise InputError(f"there is no picture {picture.name!r} of {result.title!r}: {reason}")
        announce(f"draw {picture.name}")
        for ending, axes in picture.draw(result).items():
            found[picture.name + ending] = axes.get_figure(root=True)
    return found  # type: ignore[return-value]


def default_pictures(result: Result) -> list[Picture]:
    """Return the pictures that suit a result."""
    return [picture for picture in PICTURES.values() if not picture.why_not(result) and picture.is_default(result)]


def find_picture(name: str) -> Picture:
    """Return a picture by its name; InputError if it is unknown."""
    if name not in PICTURES:
        raise InputError(f"{name!r} is no picture: the pictures are {', '.join(PICTURES)}{closest(name, [*PICTURES])}")
    return PICTURES[name]


def _always(result: Result) -> bool:
    return True


def _never(result: Result) -> bool:
    return False


def _possible(result: Result) -> str:
    return ""


def _without_contact(result: Result) -> str:
    return "" if result.contact.n_contact else "nothing is in contact"


def _without_history(result: Result) -> str:
    return _without_contact(result) or ("" if result.loading is not None else "it has no load history")


def _without_inside(result: Result) -> str:
    has_surface = any(body.mesh.surface is not None for body in result.solved_bodies)
    return "of a half-plane only the surface is known" if has_surface else ""


def _of_several_bodies(result: Result) -> str:
    return "it shows one body, and there are several" if isinstance(result, AssemblySolution) else ""


def _has_few_contacts(result: Result) -> bool:
    return len(result.contact.parts) <= MOST_CONTACTS


def _once(draw: Callable[[Result], Axes]) -> Callable[[Result], Mapping[str, Axes]]:
    return lambda result: {"": draw(result)}


def _of_contacts(draw: Callable[[Result, str], Axes]) -> Callable[[Result], Mapping[str, Axes]]:
    def drawn(result: Result) -> dict[str, Axes]:
        parts = result.contact.parts
        return {_ending(number, parts): draw(result, part) for number, part in enumerate(parts, start=1)}

    return drawn


def _ending(number: int, parts: Sequence[str]) -> str:
    return f"-{number}" if len(parts) > 1 else ""


def _is_several(result: Result) -> bool:
    return isinstance(result, AssemblySolution)


def _contact(name: str, shows: str, draw: Callable[[Result, str], Axes], default: Callable[[Result], bool]) -> Picture:
    return Picture(name, f"{shows} along each contact", _of_contacts(draw), _without_contact, default)


def _draw_tractions(result: Result) -> Axes:
    if isinstance(result, AssemblySolution):
        raise InputError("tractions along the whole boundary are those of one body")
    return draw_boundary_traction(result)


_ALL = (
    Picture("deformation", "bodies before and after, supports, loads", _once(draw_deformation), _possible, _always),
    Picture(
        "zoom",
        "the zone of contact from near by",
        _once(draw_zoom),
        _without_contact,
        lambda result: is_short(result),
    ),
    Picture("contacts", "status and pressure in the plane", _once(draw_contact_map), _without_contact, _is_several),
    Picture(
        "boundary-traction",
        "tractions along the whole boundary",
        _once(_draw_tractions),
        _of_several_bodies,
        lambda result: bool(_without_contact(result)),
    ),
    _contact("displacement", "displacements and gap", draw_contact_displacement, _has_few_contacts),
    _contact("traction", "tractions and friction bound", draw_contact_traction, _has_few_contacts),
    _contact("status", "pressure and clearance", draw_contact_clearance, _has_few_contacts),
    _contact("friction-cone", "friction over pressure,", draw_friction_cone, _never),
    *(
        Picture(
            name,
            f"{measure.symbol.replace('$', '').replace(chr(92), '')} inside the bodies",
            _once(partial(draw_stress, measure=name)),
            _without_inside,
            _always if name == "von-mises" else _never,
        )
        for name, measure in STRESSES.items()
    ),
    Picture("scene", "bodies, supports, loads and obstacles alone", _once(draw_scene), _possible, _never),
    Picture("convergence", "violations over the solver's steps", _once(draw_convergence), _possible, _never),
    Picture(
        "friction-loop",
        "friction over displacement",
        _once(draw_friction_loop),
        _without_history,
        lambda result: result.loading is not None and has_friction(result.loading),
    ),
    Picture("work", "work and energy over time", _once(draw_work), _without_history, _always),
    Picture(
        "status-over-time",
        "status over the time of a load history along each contact",
        _of_contacts(draw_status_over_time),
        _without_history,
        _has_few_contacts,
    ),
)
PICTURES: Mapping[str, Picture] = {picture.name: picture for picture in _ALL}
