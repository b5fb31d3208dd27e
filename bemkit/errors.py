"""The base classes of all errors that bemkit raises on purpose, and their messages as text that is fit to print."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class BemkitError(Exception):
    """Base class of all errors of bemkit; the message gives the cause, the value and the remedy.

    Every error class of the package derives from it, most of them from a built-in class such as ``ValueError`` as
    well. The command line prints the message of such an error; anything else is a defect and keeps its traceback.
    """


class InputError(BemkitError, ValueError):
    """An invalid value of an argument or a key."""


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
