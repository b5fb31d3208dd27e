"""Errors that bemkit names, turned into the one line that the command line prints."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import click


@contextmanager
def bad_input(prefix: str = "") -> Iterator[None]:
    """Turn the errors that bemkit itself names into one line; anything else is a defect and keeps its traceback.

    Parameters
    ----------
    prefix : str
        What the line begins with, such as the name of the scene.

    Raises
    ------
    click.ClickException
    """
    try:
        yield
    except (ValueError, OSError) as error:
        if type(error).__module__.partition(".")[0] != "bemkit":
            raise
        message = f"{prefix}: {error}" if prefix else str(error)
        raise click.ClickException(message) from error
