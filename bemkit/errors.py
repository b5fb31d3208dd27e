"""The base classes of all errors that bemkit raises on purpose."""


class BemkitError(Exception):
    """An error that bemkit names: its message says what is wrong, with its value, and what to do about it.

    Every error class of the package derives from it, most of them from a built-in class such as ``ValueError`` as
    well. The command line prints errors of this class as one line; anything else is a defect and keeps its traceback.
    """


class InputError(BemkitError, ValueError):
    """A value that bemkit was given and cannot work with."""


class NoResultError(BemkitError, RuntimeError):
    """A calculation that ended without a result: the input is well posed, but the method did not get there."""
