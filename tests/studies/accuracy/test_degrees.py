"""Degrees as element types of an error study."""

from __future__ import annotations

import pytest

import bemkit as bk
from bemkit.studies.accuracy.options import StudyOptions
from bemkit.studies.engine import StudyError

GIVEN = {
    "sizes": "20",
    "accuracies": "1e-1,1e-2",
    "discretisations": None,
    "degrees": "1,2,4,hp",
    "meshes": "uniform,adaptive",
    "solvers": "semismooth-newton",
    "exponent": 3.0,
    "most_elements": 200,
    "over_resolve": None,
    "repeat": None,
}


def options(**changes: object) -> StudyOptions:
    return StudyOptions(**(GIVEN | changes))  # type: ignore[arg-type]


def test_degrees_are_element_types_with_names_of_their_own() -> None:
    runs = options().runs(bk.load_scene("paper-1"))
    names = [run.discretisation for run in runs]
    assert list(dict.fromkeys(names)) == ["linear", "quadratic", "degree 4", "hp"]
    # degrees that rise need an accuracy
    assert {run.meshes for run in runs if run.discretisation == "hp"} == {"adaptive"}
    assert {run.meshes for run in runs if run.discretisation == "degree 4"} == {"uniform", "adaptive"}
    assert next(run for run in runs if run.discretisation == "degree 4").scene.discretisation == bk.Galerkin(4)


def test_wrong_degrees_are_named() -> None:
    scene = bk.load_scene("paper-1")
    with pytest.raises(StudyError, match=r"degrees is '1,2' and discretisations is 'linear': give one"):
        options(degrees="1,2", discretisations="linear").runs(scene)
    with pytest.raises(StudyError, match=r"degrees is '2\.5': give numbers with commas between them"):
        options(degrees="2.5").runs(scene)
    with pytest.raises(ValueError, match="degree is 13: give a whole number from 1 to 12"):
        options(degrees="13").runs(scene)
    with pytest.raises(StudyError, match=r"no run is possible: .* and with 'hp' adaptive ones"):
        options(degrees="hp", meshes="uniform").runs(scene)
