"""What the command line says of an error that bemkit names."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from bemkit.errors import BemkitError


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
