"""Base classes of the errors that bemkit raises, warnings of results as values, and text that is fit to print."""

from __future__ import annotations

import pickle
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bemkit.arrays import FloatArray

_MOST_OF_A_KIND = 3
"""Largest number of warnings of one kind that are listed."""
_ROUND_OFF = 1e-9
"""Coordinate that is written as zero, relative to the size of a body."""


class BemkitError(Exception):
    """Base class of all errors of bemkit; the message gives the cause, the value and the remedy.

    Every error class of the package derives from it, most of them from a built-in class such as ``ValueError`` as
    well. The command line prints the message of such an error; anything else is a defect and keeps its traceback.
    """


class InputError(BemkitError, ValueError):
    """An invalid value of an argument or a key."""


class GeometryError(InputError):
    """A curve, shape, selection or mesh that cannot be the boundary of a body."""


class UnknownPartError(GeometryError):
    """A boundary part was asked for by a name the mesh does not know."""


class NoResultError(BemkitError, RuntimeError):
    """A calculation without a result: the input is valid, but the method failed."""


CANNOT_BE_SENT = (pickle.PicklingError, AttributeError, TypeError)
"""Exceptions that Python raises for a value that cannot be pickled, among others."""


def why_not_sent(value: object) -> str:
    """Return why a value cannot be sent to another process; empty if it can."""
    try:
        pickle.dumps(value)
    except CANNOT_BE_SENT as error:
        return str(error)
    return ""


def printable(text: str) -> str:
    """Return a text with a space for every line break, and ``?`` for every other character that is not printable.

    Escape codes of a terminal and marks that turn the direction of writing are among these.
    """
    return "".join(c if c.isprintable() else " " if c.isspace() else "?" for c in text)


def shown_path(path: Path) -> str:
    """Return the name of a file for messages."""
    return printable(str(path))[:200]


def counted(number: int, noun: str) -> str:
    """Return a number with a noun, in the plural unless it is one."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def format_point(point: FloatArray | tuple[float, float], size: float = 0.0, digits: int = 9) -> str:
    """Write a point for a message; nine digits are enough to find it in a file.

    Parameters
    ----------
    point : (2,) array [m]
    size : float [m]
        Size of the body that the point is on. A coordinate that is round-off beside it is written as 0; by default none
        is.
    digits : int
    """
    least = _ROUND_OFF * max(size, abs(point[0]), abs(point[1])) if size else 0.0
    x, y = (0.0 if abs(coordinate) < least else coordinate for coordinate in point)
    return f"({x:.{digits}g}, {y:.{digits}g})"


def called(owner: object, method: str, arguments: tuple[Any, ...], remedy: str) -> Any:
    """Return what a method of an object of one's own returns.

    Parameters
    ----------
    owner : object
    method : str
    arguments : tuple
    remedy : str
        How the method is defined, to end the message with.

    Raises
    ------
    InputError
        If the method takes other arguments; an error inside it is raised as it is.
    """
    try:
        return getattr(owner, method)(*arguments)
    except TypeError as error:
        if error.__traceback__ is None or error.__traceback__.tb_next is not None:  # raised inside the method
            raise
        raise InputError(f"{type(owner).__name__}.{method} cannot be called ({error}): define {remedy}") from error


class Mistakes:
    """Collects the errors of checks that do not depend on each other, so that all are reported at once."""

    def __init__(self) -> None:
        self._found: list[InputError] = []

    @contextmanager
    def collected(self) -> Iterator[None]:
        """Keep an InputError of this context for later."""
        try:
            yield
        except InputError as error:
            self._found.append(error)

    def raise_all(self) -> None:
        """Raise the only error that was found, or one whose message has a line for each."""
        if len(self._found) == 1:
            raise self._found[0]
        messages = list(dict.fromkeys(map(str, self._found)))
        # one error may be found by a check of the scene and by one of its body
        lines = [each for each in messages if not any(other in each and each != other for other in messages)]
        if lines:
            raise InputError("\n".join(lines)) from self._found[0]


@contextmanager
def concerning(name: str) -> Iterator[None]:
    """Let the message of an error in this context begin with a name, such as that of the scene."""
    try:
        yield
    except BemkitError as error:
        error.add_note(name)
        raise


def one_line(error: BemkitError) -> str:
    """Return the names that an error concerns, the outermost first, and its message."""
    return ": ".join([*reversed(getattr(error, "__notes__", [])), str(error)])


@dataclass(frozen=True)
class ResultWarning:
    """A reason to check a result although it is certified.

    Parameters
    ----------
    kind : str
        Fixed name of the kind, such as ``"overlap between nodes"``.
    subject : str
        Name of the part, contact or body, or the point, that the warning is about; empty for the whole result.
    text : str
        A sentence with the value and the remedy.
    number : float, optional
        The value, in the unit that the text states; None if the kind has none.
    step : int, optional
        Number of the load step, counted from 1, if it is an earlier one than that of the result.
    """

    kind: str
    subject: str
    text: str
    number: float | None = None
    step: int | None = None

    def __str__(self) -> str:
        """Return the sentence."""
        return self.text

    def as_dict(self) -> dict[str, Any]:
        """Return the warning as JSON can hold it."""
        return asdict(self)


def without_duplicates(warnings: Iterable[ResultWarning]) -> tuple[ResultWarning, ...]:
    """Return the first warning of each kind and subject."""
    first: dict[tuple[str, str], ResultWarning] = {}
    for warning in warnings:
        first.setdefault((warning.kind, warning.subject), warning)
    return tuple(first.values())


def first_of_each_kind(warnings: Iterable[ResultWarning]) -> tuple[ResultWarning, ...]:
    """Return at most three warnings of each kind, and one that counts the others of that kind."""
    kinds: dict[str, list[ResultWarning]] = {}
    for warning in warnings:
        kinds.setdefault(warning.kind, []).append(warning)
    shown: list[ResultWarning] = []
    for kind, alike in kinds.items():
        shown += alike[:_MOST_OF_A_KIND]
        if n_more := len(alike[_MOST_OF_A_KIND:]):
            # as a kind of its own, so that it never replaces a warning about the whole result
            shown.append(ResultWarning(f"more of {kind}", "", f"{n_more} more warnings of this kind: {kind}.", n_more))
    return tuple(shown)
