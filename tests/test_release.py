"""Version, changelog, citation, recipe and metadata agree."""

from __future__ import annotations

import re
import runpy
import tomllib
from pathlib import Path

import pytest

from bemkit.version import __version__

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
RECIPE = (ROOT / "conda" / "recipe.yaml").read_text("utf-8")
CHANGELOG = (ROOT / "CHANGELOG.md").read_text("utf-8")


def spaced(requirement: str) -> str:
    """Return a requirement as conda writes it."""
    return re.sub(r"^([\w-]+)", r"\1 ", requirement)


def listed(section: str) -> list[str]:
    """Return the entries of a list of the recipe."""
    found = re.search(rf"^ +{section}:\n((?: +- .*\n)+)", RECIPE, re.MULTILINE)
    assert found, section
    return [line.strip().removeprefix("- ") for line in found[1].splitlines()]


def headings() -> list[str]:
    """Return the headings of versions in the changelog, newest first."""
    return re.findall(r"^## (.*)$", CHANGELOG, re.MULTILINE)


def test_the_changelog_begins_with_this_version() -> None:
    assert headings()[0].split()[0] == __version__


def test_a_version_of_the_changelog_has_a_date_or_is_unreleased_and_newest() -> None:
    newest, *older = headings()
    assert re.fullmatch(r"\d+\.\d+\.\d+ \((unreleased|\d{4}-\d\d-\d\d)\)", newest)
    released = [re.fullmatch(r"(\d+)\.(\d+)\.(\d+) \(\d{4}-\d\d-\d\d\)", heading) for heading in older]
    assert all(released)
    numbers = [tuple(map(int, heading.split()[0].split("."))) for heading in headings()]
    assert numbers == sorted(numbers, reverse=True)


def test_the_changelog_lists_features_of_a_version_in_few_lines() -> None:
    for section in re.split(r"^## ", CHANGELOG, flags=re.MULTILINE)[1:]:
        entries = [line for line in section.splitlines() if line.startswith("- ")]
        assert 0 < len(entries) <= 25
        assert max(map(len, entries)) <= 120


def test_the_citation_names_this_version_and_its_date_once_it_is_released() -> None:
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    assert re.search(rf"^version: {re.escape(__version__)}$", citation, re.MULTILINE)
    date = re.search(r"^date-released: (.*)$", citation, re.MULTILINE)
    assert headings()[0] == f"{__version__} ({date[1] if date else 'unreleased'})"


def test_the_recipe_requires_what_the_project_requires() -> None:
    python, *libraries = listed("run")
    assert python == f"python {PROJECT['requires-python']}"
    assert libraries == [spaced(requirement) for requirement in PROJECT["dependencies"]]
    requires = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["build-system"]["requires"]
    oldest = PROJECT["requires-python"].removeprefix(">=")
    assert listed("host") == [f"python {oldest}.*", "pip", *(spaced(requirement) for requirement in requires)]


def test_the_recipe_has_the_version_program_and_licence_of_the_project() -> None:
    ((program, target),) = PROJECT["scripts"].items()
    assert listed("entry_points") == [f"{program} = {target}"]
    assert f'version: "{__version__}"\n' in RECIPE
    assert f"license: {PROJECT['license']}\n" in RECIPE
    assert f"summary: {PROJECT['description']}\n" in RECIPE


def test_the_classifiers_name_the_oldest_python() -> None:
    versions = re.findall(r"Python :: (3\.\d+)$", "\n".join(PROJECT["classifiers"]), re.MULTILINE)
    assert versions[0] == PROJECT["requires-python"].removeprefix(">=")
    assert versions == sorted(versions, key=lambda version: int(version.split(".")[1]))


@pytest.mark.parametrize("requirement", PROJECT["dependencies"])
def test_every_dependency_has_a_lower_bound(requirement: str) -> None:
    assert re.fullmatch(r"[\w-]+>=[\d.]+", requirement)


def test_the_address_makes_absolute_links_of_relative_ones_and_no_others() -> None:
    pytest.importorskip("hatchling")
    hook = runpy.run_path(str(ROOT / "hatch_build.py"))
    text = "![a](docs/a.png) [b](docs/b.md#c) [d](#e) [f](https://g.h) `pip install '.[plot]'` (see)"
    there = "https://host.example/who/bemkit"
    assert hook["absolute"](text, there, "v1.0.0") == (
        f"![a]({there}/raw/v1.0.0/docs/a.png) [b]({there}/blob/v1.0.0/docs/b.md#c) [d](#e) [f](https://g.h) "
        "`pip install '.[plot]'` (see)"
    )
    assert hook["absolute"](text, "", "v1.0.0") == text
    readme = hook["absolute"]((ROOT / "README.md").read_text("utf-8"), there, "v1.0.0")
    assert not re.search(r"\]\((?!https:)", readme)
    for link in re.findall(rf"{there}/(?:raw|blob)/v1\.0\.0/([^)#]+)", readme):
        assert (ROOT / link).exists(), link
    assert hook["urls"]("", "v1.0.0") == {}
    assert hook["urls"](there, "v1.0.0")["Changelog"] == f"{there}/blob/v1.0.0/CHANGELOG.md"


def test_rattler_build_reads_the_recipe() -> None:
    rattler_build = pytest.importorskip("rattler_build")
    (variant,) = rattler_build.Stage0Recipe.from_file(str(ROOT / "conda" / "recipe.yaml")).render()
    package = variant.recipe.package
    assert (str(package.name), str(package.version)) == ("bemkit", __version__)
