"""Names of units stand wherever numbers are shown, and nowhere if the scene gives none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5py
import pytest

import bemkit as bk
from bemkit.cli.console import print_summary

SCENE = replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=40))
NAMES = bk.UnitNames("mm", "MPa", "N/mm")


@pytest.fixture(scope="module")
def solution() -> bk.Solution:
    return bk.run(replace(SCENE, units=NAMES))


def test_derived_names() -> None:
    assert bk.UnitNames("m", "Pa").as_dict() == {"length": "m", "stress": "Pa", "force": "N/m", "energy": "N m/m"}
    assert bk.UnitNames("mm", "MPa") == NAMES
    assert NAMES.as_dict()["energy"] == "N mm/mm"
    assert bk.UnitNames("in", "psi").force == "lbf/in"
    assert bk.UnitNames("furlong", "Pa").as_dict() == {
        "length": "furlong",
        "stress": "Pa",
        "force": "Pa furlong",
        "energy": "Pa furlong furlong",
    }


def test_names_change_no_number(solution: bk.Solution) -> None:
    plain = bk.run(SCENE)
    assert plain.contact.sigma_n.tolist() == solution.contact.sigma_n.tolist()
    assert plain.summary()["units"] is None
    assert solution.summary()["units"] == NAMES.as_dict()


def test_they_come_back_from_text_and_files(solution: bk.Solution, tmp_path: Path) -> None:
    assert bk.scene_from_toml(bk.scene_to_toml(solution.scene)).units == NAMES
    bk.write_result(tmp_path / "r.h5", solution)
    assert bk.read_result(tmp_path / "r.h5").units == NAMES


def test_every_array_of_a_file_says_what_it_is(solution: bk.Solution, tmp_path: Path) -> None:
    bk.write_result(tmp_path / "r.h5", bk.run(replace(solution.scene, load_factors=(0.5, 1.0))))
    with h5py.File(tmp_path / "r.h5") as file:
        table = file["last/contact"]
        units = dict(zip(table.dtype.names, table.attrs["units"], strict=True))
        assert (units["sigma_n"], units["u_t"], units["status"]) == ("MPa", "mm", "")
        assert file["last/reaction"].attrs["unit"] == "N/mm"
        assert "unit" not in file["meshes/0/elements"].attrs
        for group in (file, file["meshes/0"], file["last"]):
            for name, item in group.items():
                if isinstance(item, h5py.Dataset) and item.dtype.kind in "fi":
                    assert item.attrs["meaning"], name
        for item in (table, file["contact_nodes"]):
            assert len(item.attrs["meanings"]) == len(item.dtype.names)
    plain = bk.run(SCENE)
    bk.write_result(tmp_path / "p.h5", plain)
    with h5py.File(tmp_path / "p.h5") as file:
        assert "units" not in file["last/contact"].attrs
        assert "unit" not in file["last/reaction"].attrs


def test_the_summary_and_the_pictures_show_them(solution: bk.Solution, capsys: pytest.CaptureFixture[str]) -> None:
    print_summary(solution)
    assert "0.5 N/mm" in " ".join(capsys.readouterr().out.split())
    figures = pytest.importorskip("bemkit.pictures")
    assert figures.draw_deformation(solution).get_xlabel() == "$x$ [mm]"
    assert figures.draw_contact_traction(solution, "foundation").get_ylabel() == "traction [MPa]"
    plain = bk.run(SCENE)
    assert figures.draw_deformation(plain).get_xlabel() == "$x$"


@pytest.mark.parametrize("name", ["", "  ", "a" * 25, "m\n"])
def test_names_that_are_none_are_refused(name: str) -> None:
    with pytest.raises(bk.InputError, match=r"units\.stress is .*: give a short name"):
        bk.UnitNames("m", name)


def test_messages_name_them() -> None:
    lifted = replace(
        SCENE,
        units=NAMES,
        parts=(SCENE.parts[0], bk.Part("lift", bk.Traction(y=1.0), sides=("top",))),
    )
    with pytest.raises(bk.BemkitError, match="pushes the body upward with 1 N/mm; nothing holds it"):
        bk.run(lifted)
