"""The base of all errors that bemkit raises on purpose."""


class BemkitError(Exception):
    """An error that bemkit names: its message says what is wrong, with its value, and what to do about it.

    Every error class of the package derives from it, most of them from a built-in class such as ``ValueError`` as
    well. The command line prints errors of this class as one line; anything else is a defect and keeps its traceback.
    """
