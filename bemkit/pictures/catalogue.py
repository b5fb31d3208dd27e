"""All pictures by name: their subject, their conditions, and which are drawn by default."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from bemkit.errors import InputError
from bemkit.formulas import closest
from bemkit.pictures.boundary_traction import draw_boundary_traction
from bemkit.pictures.contact_curves import (
    draw_contact_clearance,
    draw_contact_displacement,
    draw_contact_traction,
    draw_friction_cone,
)
from bemkit.pictures.contact_map import draw_contact_map, draw_zoom, is_short
from bemkit.pictures.convergence import draw_convergence
from bemkit.pictures.deformation import draw_deformation, draw_scene
from bemkit.pictures.drawing import Axes, Figure
from bemkit.pictures.load_history import draw_friction_loop, draw_status_over_time, draw_work, has_friction
from bemkit.pictures.pressure_distribution import draw_pressure_distribution
from bemkit.pictures.stress import draw_stress
from bemkit.results.solution import Solution
from bemkit.results.stress_measures import STRESSES
from bemkit.stopwatch import announce

_FEW = 2048
_MANY_ZONES = 20
"""Least number of changes of status along a rough contact."""
MOST_CONTACTS = 6
"""Largest number of contacts that have default pictures of their own."""


@dataclass(frozen=True)
class Picture:
    """A picture of the catalogue.

    Parameters
    ----------
    name : str
        Also of its file, without ending.
    shows : str
        What, in a few words.
    draw : callable (result) -> Axes, or (result, part) -> Axes
        The latter of pictures along contacts.
    why_not : callable (result) -> str
        Why there is no such picture, empty if there is one.
    is_default : callable (result) -> bool
        Whether it is drawn by default.
    is_along_contacts : bool
        Whether each contact has one.
    """

    name: str
    shows: str
    draw: Callable[..., Axes]
    why_not: Callable[[Solution], str] = lambda result: ""
    is_default: Callable[[Solution], bool] = lambda result: True
    is_along_contacts: bool = False

    def axes(self, result: Solution) -> dict[str, Axes]:
        """Draw it, and return what was drawn by endings of file names: one, empty, or a number for each contact."""
        if not self.is_along_contacts:
            return {"": self.draw(result)}
        parts = result.contact.parts
        endings = [f"-{number}" for number in range(1, len(parts) + 1)] if len(parts) > 1 else [""]
        return {ending: self.draw(result, part) for ending, part in zip(endings, parts, strict=True)}


def figures(result: Solution, what: Sequence[str] | None = None) -> dict[str, Figure]:
    """Draw pictures of a result.

    Parameters
    ----------
    result : Solution
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
        for ending, axes in picture.axes(result).items():
            found[picture.name + ending] = axes.get_figure(root=True)
    return found  # type: ignore[return-value]


def plot(result: Solution, what: str, part: str | None = None) -> Figure:
    """Return one picture; see `Solution.plot`."""
    picture, parts = find_picture(what), result.contact.parts
    if reason := picture.why_not(result):
        raise InputError(f"there is no picture {what!r} of {result.title!r}: {reason}")
    if not picture.is_along_contacts:
        axes = picture.draw(result)
    elif part in parts or (part is None and len(parts) == 1):
        axes = picture.draw(result, part or parts[0])
    else:
        raise InputError(f"part is {part!r}: name one of the contacts {', '.join(map(repr, parts))}")
    return axes.get_figure(root=True)  # type: ignore[return-value]


def default_pictures(result: Solution) -> list[Picture]:
    """Return the pictures that suit a result."""
    return [picture for picture in PICTURES.values() if not picture.why_not(result) and picture.is_default(result)]


def find_picture(name: str) -> Picture:
    """Return a picture by its name; InputError if it is unknown."""
    if name not in PICTURES:
        raise InputError(f"{name!r} is not a picture: choose from {', '.join(PICTURES)}{closest(name, [*PICTURES])}")
    return PICTURES[name]


def _without_contact(result: Solution) -> str:
    return "" if result.contact.n_contact else "nothing is in contact"


def _without_history(result: Solution) -> str:
    return _without_contact(result) or ("" if result.loading is not None else "it has no load history")


def _of_several_bodies(result: Solution) -> str:
    return "it shows one body, and there are several" if len(result.bodies) > 1 else ""


def _has_few_contacts(result: Solution) -> bool:
    return len(result.contact.parts) <= MOST_CONTACTS


def _has_steps(result: Solution) -> bool:
    return result.loading is not None and len(result.loading.steps) > 1


def _is_loop(result: Solution) -> bool:
    """Whether a load history of more than two steps has friction."""
    return result.loading is not None and len(result.loading.steps) > 2 and has_friction(result.loading)


def _is_fast(result: Solution) -> bool:
    """Whether stress inside is fast: below a half-plane each point needs all elements."""
    return all(body.mesh.surface is None or body.mesh.n_elements <= _FEW for body in result.bodies.values())


def _is_rough(result: Solution) -> bool:
    """Whether contact has so many zones that a distribution is clearer than a curve."""
    return _has_few_contacts(result) and len(result.transitions) > _MANY_ZONES * len(result.contact.parts)


def _never(result: Solution) -> bool:
    return False


_contact = partial(Picture, why_not=_without_contact, is_default=_has_few_contacts, is_along_contacts=True)


def _stress(name: str) -> Picture:
    shows = f"{STRESSES[name].symbol.replace('$', '').replace(chr(92), '')} inside the bodies"
    is_default = name == "von-mises"
    return Picture(
        name, shows, partial(draw_stress, measure=name), is_default=lambda result: is_default and _is_fast(result)
    )


_ALL = (
    Picture("deformation", "bodies before and after, supports, loads", draw_deformation),
    Picture("zoom", "the zone of contact from near by", draw_zoom, _without_contact, is_short),
    Picture(
        "contacts",
        "status and pressure in the plane",
        draw_contact_map,
        _without_contact,
        lambda result: "" not in result.bodies,
    ),
    Picture(
        "boundary-traction",
        "tractions along the whole boundary",
        draw_boundary_traction,
        _of_several_bodies,
        lambda result: bool(_without_contact(result)),
    ),
    _contact("displacement", "displacements and gap along each contact", draw_contact_displacement),
    _contact("traction", "tractions and friction bound along each contact", draw_contact_traction),
    _contact("status", "pressure and clearance along each contact", draw_contact_clearance),
    _contact("friction-cone", "friction over pressure, along each contact", draw_friction_cone, is_default=_never),
    _contact(
        "pressures", "distribution of the pressures on each contact", draw_pressure_distribution, is_default=_is_rough
    ),
    *map(_stress, STRESSES),
    Picture("scene", "bodies, supports, loads and obstacles", draw_scene, is_default=_never),
    Picture("convergence", "violations over the solver's steps", draw_convergence, is_default=_never),
    Picture("friction-loop", "friction over displacement", draw_friction_loop, _without_history, _is_loop),
    Picture("work", "work and energy over time", draw_work, _without_history, _has_steps),
    _contact(
        "status-over-time",
        "status over the time of a load history along each contact",
        draw_status_over_time,
        why_not=_without_history,
        is_default=lambda result: _has_steps(result) and _has_few_contacts(result),
    ),
)
PICTURES: Mapping[str, Picture] = {picture.name: picture for picture in _ALL}
