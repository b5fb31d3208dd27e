"""The works that are named are those of what a scene asks for, and of what its run used."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

import bemkit as bk
from bemkit.cli.main import commands
from bemkit.contact.further_laws import SlipWeakening
from bemkit.results.citations import DRIVERS, LAW_WORKS, PACKAGE, Citations, Method, cite, entries
from bemkit.scene.registry import LAWS, SOLVERS
from bemkit.scene.toml import shipped_files, with_overrides
from bemkit.solvers.fallbacks import PATH_MESSAGE, SolutionPath, Springs
from bemkit.version import __version__

ROOT = Path(__file__).parents[2]
PAPER_1 = bk.load_scene("paper-1")
assert isinstance(PAPER_1, bk.Scene)
NEEDED = {
    "article": {"journal", "volume", "year"},
    "book": {"publisher", "year"},
    "incollection": {"booktitle", "year"},
}


def keys(citations: Citations) -> set[str]:
    return set(citations.keys)


@pytest.mark.parametrize("name", shipped_files())
def test_every_shipped_scene_cites_works_of_the_bibliography(name: str) -> None:
    citations = cite(bk.load_scene(name))
    assert citations.methods[0].keys == (PACKAGE,)
    assert len(citations.keys) > 3
    assert all(method.keys for method in citations.methods)


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"discretisation": "constant"}, "Betti1872"),
        ({"discretisation": "linear"}, "Steinbach2008"),
        ({"solver": "augmented-lagrangian"}, "Stadler2004"),
        ({"solver": "semismooth-newton"}, "HintermuellerItoKunisch2002"),
        ({"solver": "fixed-point"}, "NecasJarusekHaslinger1980"),
        ({"solver": "lemke"}, "CottlePangStone1992"),
        ({"degree": "hp", "accuracy": 1e-4}, "BabuskaGuo1986"),
    ],
)
def test_options_cite_works_that_other_options_do_not(options: dict[str, str], key: str) -> None:
    assert key in keys(cite(with_overrides(PAPER_1, **options)))  # type: ignore[arg-type]
    others = {"discretisation": "linear", "solver": "semismooth-newton"}
    if options.items() <= others.items():
        others = {"discretisation": "constant", "solver": "lemke"}
    assert key not in keys(cite(with_overrides(PAPER_1, **others)))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("two-cylinders", "Wohlmuth2000"),
        ("gravity-column", "TimoshenkoGoodier1970"),
        ("disc-between-plates", "AfKlintebergBarnett2021"),
        ("cylinder-on-half-plane", "Johnson1985"),
    ],
)
def test_what_scenes_hold_cites_works(name: str, key: str) -> None:
    assert key in keys(cite(bk.load_scene(name)))
    assert key not in keys(cite(PAPER_1))


def test_a_half_plane_cites_no_elements() -> None:
    assert not keys(cite(bk.load_scene("rough-surface"))) & {"Steinbach2008", "Betti1872"}


def test_a_law_cites_its_work() -> None:
    law = SlipWeakening(static_friction=0.5, kinetic_friction=0.3, slip_distance=1.0)
    assert "Ida1972" in keys(cite(replace(PAPER_1, law=law, steps=(bk.Step(1.0),))))
    assert "Ida1972" not in keys(cite(PAPER_1))
    assert LAW_WORKS.keys() <= LAWS.built_in.keys()


def test_the_law_of_contacts_that_are_found_cites_its_work() -> None:
    law = SlipWeakening(static_friction=0.5, kinetic_friction=0.3, slip_distance=1.0)
    arch = bk.load_scene("masonry-arch")
    assert arch.touching is not None
    assert "Ida1972" in keys(cite(replace(arch, touching=replace(arch.touching, law=law))))
    assert "Ida1972" not in keys(cite(arch))


def test_a_scene_without_contact_cites_nothing_of_contact() -> None:
    assert not keys(cite(bk.load_scene("bending"))) & {"AlartCurnier1991", *DRIVERS["semismooth-newton"]}


def test_a_run_without_stored_equations_cites_its_products_and_its_iteration() -> None:
    scene = replace(with_overrides(PAPER_1, elements=200, discretisation="constant"), linear_solver=bk.MatrixFree())
    works = {"GreengardRokhlin1987", "SaadSchultz1986", "BramblePasciakXu1990", "RugeStueben1987"}
    assert works <= keys(cite(bk.run(scene)))
    assert not works & keys(cite(bk.run(replace(scene, linear_solver=bk.DenseCholesky()))))


def test_a_run_cites_the_path_of_solutions_if_it_was_followed() -> None:
    scene = with_overrides(PAPER_1, elements=40)
    assert "Lemke1965" not in keys(cite(bk.run(scene)))
    solution = bk.run(replace(scene, solver=bk.Fallbacks((bk.SemismoothNewton(max_steps=1), SolutionPath()))))
    assert any(record.message.startswith(PATH_MESSAGE) for record in solution.history)
    assert "Lemke1965" in keys(cite(solution))
    assert "Rockafellar1976" not in keys(cite(solution))
    drivers = (bk.SemismoothNewton(max_steps=1), Springs(least_motions=4), bk.FixedPoint())
    solution = bk.run(replace(scene, solver=bk.Fallbacks(drivers)))
    assert not {"Rockafellar1976", "Lemke1965"} & keys(cite(solution))  # one body takes no springs
    assert "NecasJarusekHaslinger1980" in keys(cite(solution))


def test_every_driver_has_its_works() -> None:
    assert ["fallbacks", *DRIVERS] == list(SOLVERS.built_in)


def test_a_method_from_elsewhere_is_named_without_works() -> None:
    assert str(Citations((Method("solver of mine", ()),))) == "% solver of mine: not part of bemkit, ask its author"


@pytest.mark.parametrize("key", entries())
def test_entries_are_complete_and_balanced(key: str) -> None:
    entry = entries()[key]
    kind = re.match(r"@(\w+)\{", entry)
    assert kind is not None
    names = set(re.findall(r"^  (\w+) = \{.+\},$", entry, re.MULTILINE))
    assert names >= NEEDED.get(kind[1], set()) | {"title", "keywords"}
    assert entry.count("{") == entry.count("}")
    assert "author" in names or key == "Paper"


def test_the_text_is_a_file_for_bibtex_with_the_methods_as_comments() -> None:
    text = str(cite(PAPER_1))
    comments, *found = text.split("\n\n")
    assert all(line.startswith("% ") for line in comments.splitlines())
    assert "% bemkit: bemkit" in comments
    assert found == [entries()[key] for key in cite(PAPER_1).keys]
    assert found[0].startswith("@misc{bemkit,\n  author = {")


def test_the_package_is_cited_as_citation_cff_says() -> None:
    stated = dict(re.findall(r"^([\w-]+): \"?(.*?)\"?$", (ROOT / "CITATION.cff").read_text("utf-8"), re.MULTILINE))
    work = dict(re.findall(r"^  (\w+) = \{(.*)\},$", entries()[PACKAGE], re.MULTILINE))
    assert work["title"].strip("{}") == stated["title"]
    assert work["year"] == stated.get("date-released", work["year"])[:4]  # a version has a date once it is released
    assert stated["version"] == __version__
    assert work["note"] == f"Version {__version__}"


def test_the_command_takes_scenes_and_results(tmp_path: Path) -> None:
    def printed(*arguments: str) -> str:
        ran = CliRunner().invoke(commands, ["cite", *arguments])
        assert ran.exit_code == 0
        return ran.output

    path = tmp_path / "result.h5"
    solution = bk.run(with_overrides(PAPER_1, elements=40))
    bk.write_result(path, solution)
    assert printed("paper-1") == f"{cite(PAPER_1)}\n"
    assert printed(str(path)) == f"{cite(solution)}\n"
