"""Every error that bemkit raises on purpose has one base class, and the command line one place where errors end."""

from __future__ import annotations

import importlib
import pickle
import pkgutil
from importlib.util import find_spec

import numpy as np
import pytest

import bemkit
import bemkit.runs.run
from bemkit.cli.main import main
from bemkit.errors import BemkitError, InputError, NoResultError, concerning, counted, format_point, one_line

COMPILED = "bemkit.operators.collocation.compiled_"


def all_modules() -> list[str]:
    """Return all modules that can be imported here; some need the extra ``fast``."""
    left_out = ("bemkit.__main__", *([COMPILED] if find_spec("numba") is None else []))
    names = (module.name for module in pkgutil.walk_packages(bemkit.__path__, "bemkit."))
    return [name for name in names if not name.startswith(left_out)]


def error_classes() -> set[type[BaseException]]:
    values = [value for name in all_modules() for value in vars(importlib.import_module(name)).values()]
    classes = {value for value in values if isinstance(value, type) and issubclass(value, BaseException)}
    return {value for value in classes if value.__module__.startswith("bemkit.")}


def test_every_error_class_derives_from_the_one_base() -> None:
    classes = error_classes()
    assert len(classes) > 30
    assert {value.__name__ for value in classes if not issubclass(value, BemkitError)} == set()


@pytest.mark.parametrize("kind", [InputError, NoResultError])
def test_errors_cross_the_border_of_a_process(kind: type[BemkitError]) -> None:
    assert str(pickle.loads(pickle.dumps(kind("rho is -1")))) == "rho is -1"


def test_what_an_error_concerns_stands_before_its_message() -> None:
    with pytest.raises(InputError) as caught, concerning("study"), concerning("paper-1"):
        raise InputError("rho is -1")
    assert one_line(caught.value) == "study: paper-1: rho is -1"


@pytest.mark.parametrize(("kind", "code"), [(InputError, 2), (BemkitError, 2), (NoResultError, 1)])
def test_the_command_line_ends_named_errors_without_a_traceback(
    kind: type[BemkitError], code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*arguments: object, **options: object) -> None:
        raise kind("the mesh is too coarse\n\nand the load too large")

    monkeypatch.setattr(bemkit.runs.run, "run", refuse)
    with pytest.raises(SystemExit) as end:
        main(["run", "paper-1"])
    assert end.value.code == code
    assert capsys.readouterr().err == "bemkit: error: paper-1: the mesh is too coarse\nand the load too large\n"


def test_the_command_line_leaves_defects_their_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: object, **options: object) -> None:
        raise ValueError("shapes do not match")  # as numpy says it

    monkeypatch.setattr(bemkit.runs.run, "run", fail)
    with pytest.raises(ValueError, match="shapes do not match"):
        main(["run", "paper-1"])


@pytest.mark.parametrize(
    ("point", "size", "digits", "words"),
    [
        ((2.856e-9, 0.0), 10.0, 9, "(0, 0)"),
        ((2.856e-9, 0.0), 1e-8, 9, "(2.856e-09, 0)"),
        ((1e5, -1e-5), 1.0, 9, "(100000, 0)"),
        ((1.0, 1e-15), 0.0, 9, "(1, 1e-15)"),
        ((1.0 / 3.0, -2.0 / 3.0), 1.0, 4, "(0.3333, -0.6667)"),
    ],
)
def test_round_off_beside_the_size_of_a_body_is_written_as_zero(
    point: tuple[float, float], size: float, digits: int, words: str
) -> None:
    assert format_point(np.array(point), size, digits) == words


def test_one_thing_is_counted_in_the_singular() -> None:
    assert [counted(number, "step") for number in (0, 1, 2)] == ["0 steps", "1 step", "2 steps"]
