"""The generated pages: every public name has its place, formulas stay as they are, all shipped scenes are shown."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType

import pytest

import bemkit
from bemkit.scene.toml import shipped_files
from tests.docs.pages import DOCS
from tests.slow import slow_except


@pytest.fixture
def api(tmp_path: Path) -> Path:
    """The folder of the written reference."""
    import make_api

    make_api.main(tmp_path / "api")
    return tmp_path / "api"


def test_every_public_name_is_documented_once_and_listed(api: Path) -> None:
    pages = "".join(path.read_text("utf-8") for path in (api / "names").iterdir())
    documented = re.findall(r"^\.\. auto(?:class|function):: bemkit\.(\w+)$", pages, re.MULTILINE)
    assert sorted(documented) == bemkit.__all__
    listed = re.findall(r"^   (\w+)$", (api / "bemkit.rst").read_text("utf-8"), re.MULTILINE)
    assert sorted(listed) == bemkit.__all__


def test_every_module_that_researchers_extend_is_documented(api: Path) -> None:
    package = Path(bemkit.__file__).parent
    for folder in (
        "geometry",
        "operators",
        "contact",
        "solvers",
        "scene",
        "results",
        "pictures",
        "report",
        "studies",
        "testing",
        "reference",
    ):
        text = "".join(path.read_text("utf-8") for path in api.glob(f"bemkit.{folder}*.rst"))
        for path in (package / folder).rglob("*.py"):
            module = ".".join(("bemkit", *path.relative_to(package).with_suffix("").parts))
            assert path.stem == "__init__" or f".. automodule:: {module}\n" in text, module


def test_names_of_the_package_are_not_documented_twice(api: Path) -> None:
    text = (api / "bemkit.geometry.meshing.rst").read_text("utf-8")
    section = text.partition(".. automodule:: bemkit.geometry.meshing.discretise\n")[2].partition(".. automodule::")[0]
    assert "   :exclude-members: Algebraic, Geometric, Uniform, discretise\n" in section
    assert ":py:obj:`bemkit.Uniform`" in section


@pytest.mark.parametrize(
    ("lines", "shown"),
    [
        (["The size |x| of ``|y|`` and `|z|`."], [r"The size \|x\| of ``|y|`` and `|z|`."]),
        (["It is:", "", "    |a| = b", "", "So |c|."], ["It is::", "", "    |a| = b", "", r"So \|c\|."]),
        (["It is::", "", "    |a|"], ["It is::", "", "    |a|"]),
        (["These:", "", "  * |a|"], ["These:", "", r"  * \|a\|"]),
        (["x : float", "    Size:", "    |x|"], ["x : float", "    Size:", r"    \|x\|"]),
        (["Places.", "", "/a  |x|", "/b", "", "End."], ["Places.", "", "::", "", "    /a  |x|", "    /b", "", "End."]),
        ([], []),
    ],
    ids=["bars", "formula", "literal", "list", "parameter", "places", "nothing"],
)
def test_formulas_of_docstrings_stay_as_they_are(lines: list[str], shown: list[str]) -> None:
    from docstring_marks import as_restructured_text

    assert as_restructured_text(lines) == shown


def test_every_page_has_its_place_in_the_navigation() -> None:
    index = (DOCS / "index.md").read_text("utf-8")
    for page in DOCS.glob("*.md"):
        assert page.stem == "index" or re.search(rf"^{page.stem}$", index, re.MULTILINE), page.name
    for name in re.findall(r"^([\w/-]+)$", index, re.MULTILINE):
        assert (DOCS / f"{name}.md").exists() or name.startswith(("api/", "gallery/")), name


@pytest.fixture
def make_gallery() -> ModuleType:
    import make_gallery

    return make_gallery


def test_the_gallery_shows_every_shipped_scene_and_every_file_of_its_folder(make_gallery: ModuleType) -> None:
    names = [entry.name for entry in make_gallery.entries()]
    files = [path.name for path in (DOCS / "gallery").iterdir() if path.suffix in (".toml", ".py")]
    assert sorted(names) == sorted([*shipped_files(), *(name for name in files if name != "entries.toml")])
    assert len(names) >= 20


@pytest.mark.parametrize(
    "name", slow_except(["uniform-slip", "wedge-in-groove.toml", "friction-sweep.py"], "uniform-slip")
)
def test_a_page_of_the_gallery_has_text_picture_and_code(name: str, make_gallery: ModuleType, tmp_path: Path) -> None:
    for path in (DOCS / "gallery").glob("*.*"):
        if path.suffix in (".toml", ".py"):
            (tmp_path / path.name).write_bytes(path.read_bytes())
    entry = next(entry for entry in make_gallery.entries() if entry.name == name)
    title = make_gallery.write(entry, tmp_path)
    page = (tmp_path / f"{entry.page}.rst").read_text("utf-8")
    assert page.startswith(f"{title}\n====")
    assert f"**What to look at.** {entry.look}" in page
    for picture in re.findall(r"^\.\. image:: (.*)$", page, re.MULTILINE):
        assert (tmp_path / picture).stat().st_size > 5_000
    assert "friction_coefficient = " in page or "bk.sweep(" in page
    assert f":img-bottom: {entry.page}.png" in make_gallery.index({entry.page: title})


def test_a_scene_of_the_gallery_that_fails_stops_the_build(make_gallery: ModuleType, tmp_path: Path) -> None:
    text = shipped_files()["paper-1"].read_text("utf-8")
    scene = f'solver = {{ kind = "semismooth-newton", max_steps = 1 }}\n{text}'
    (tmp_path / "short.toml").write_text(scene, "utf-8")
    with pytest.raises(RuntimeError, match=r"short\.toml ended with MAX_STEPS"):
        make_gallery.write(make_gallery.Entry("short.toml", "nothing"), tmp_path)
