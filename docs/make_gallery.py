"""Run the scenes and programs of the gallery, draw them and write their pages; `conf.py` does so before each build.

``docs/gallery/entries.toml`` lists them. A scene is one that comes with the package, or a file in that folder, and says
itself what it shows and where it comes from. A program there makes a ``figure``; its docstring says what it shows.
"""

from __future__ import annotations

import ast
import runpy
import tomllib
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import islice
from multiprocessing import get_context
from pathlib import Path

from matplotlib.figure import Figure

import bemkit as bk
from bemkit.pictures.catalogue import default_pictures, figures
from bemkit.scene.toml import shipped_files

FOLDER = Path(__file__).parent / "gallery"
DOTS_PER_INCH = 90
SECOND = ("friction-loop", "traction", "contacts", "boundary-traction")
"""Pictures besides the deformation, the first that there is."""


@dataclass(frozen=True)
class Entry:
    """A scene or a program of the gallery.

    Parameters
    ----------
    name : str
        Of a shipped scene, or of a file in ``docs/gallery`` with its ending.
    look : str
        What to look at.
    """

    name: str
    look: str

    @property
    def page(self) -> str:
        return self.name.partition(".")[0]


def entries() -> tuple[Entry, ...]:
    """Return the entries in the order of the list, and the shipped scenes that it does not name after them."""
    listed = tomllib.loads((FOLDER / "entries.toml").read_text("utf-8"))
    return tuple(
        Entry(name, look)
        for name, look in (listed | {name: "" for name in shipped_files() if name not in listed}).items()
    )


def main() -> None:
    """Write a page with pictures for each entry, and the page that lists them."""
    for old in (*FOLDER.glob("*.rst"), *FOLDER.glob("*.png")):
        old.unlink()
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as executor:
        titles = dict(zip((entry.page for entry in entries()), executor.map(write, entries()), strict=True))
    (FOLDER / "index.rst").write_text(index(titles), "utf-8")


def write(entry: Entry, folder: Path = FOLDER) -> str:
    """Run an entry of a folder, draw its pictures, write its page there, and return its title."""
    title, text, drawn = (run_program if entry.name.endswith(".py") else run_scene)(entry, folder)
    pictures = []
    for name, figure in drawn.items():
        pictures.append(f"{entry.page}-{name}.png")
        figure.savefig(folder / pictures[-1], dpi=DOTS_PER_INCH, bbox_inches="tight")
    (folder / pictures[0]).rename(folder / f"{entry.page}.png")
    shown = "".join(f".. image:: {name}\n   :alt: {title}\n\n" for name in (f"{entry.page}.png", *pictures[1:]))
    look = f"**What to look at.** {entry.look}\n\n" if entry.look else ""
    page = heading(title) + text.replace("PICTURES", look + shown)
    (folder / f"{entry.page}.rst").write_text(page, "utf-8")
    return title


def run_scene(entry: Entry, folder: Path) -> tuple[str, str, Mapping[str, Figure]]:
    """Solve a scene; return its title, its page and its pictures."""
    is_file = entry.name.endswith(".toml")
    source = (folder / entry.name) if is_file else shipped_files()[entry.name]
    scene = bk.load_scene(folder / entry.name if is_file else entry.name)
    solution = bk.run(scene)
    if not solution.is_converged:
        raise RuntimeError(f"the gallery's scene {entry.name} ended with {solution.status.name}: {solution.message}")
    command = f"bemkit run {entry.name} --plot figures"
    text = f"{' '.join(scene.description.split())}\n\nPICTURES"
    text += f".. code-block:: sh\n\n   {command}\n\n" + code("toml", source.read_text("utf-8"))
    if scene.reference:
        text += f"Source: {' '.join(scene.reference.split())}\n"
    return scene.title, text, chosen(solution)


def chosen(solution: bk.Solution) -> dict[str, Figure]:
    """Draw the deformation and the most informative other picture."""
    suiting = [picture.name for picture in default_pictures(solution)]
    second = next(name for name in SECOND if name in suiting)
    return dict(islice(figures(solution, ["deformation", second]).items(), 2))


def run_program(entry: Entry, folder: Path) -> tuple[str, str, Mapping[str, Figure]]:
    """Run a program; return the first line of its docstring, its page and its picture."""
    path = folder / entry.name
    program = path.read_text("utf-8")
    title, _, description = (ast.get_docstring(ast.parse(program)) or "").partition("\n\n")
    _, _, statements = program.partition('\n"""\n')
    figure = runpy.run_path(str(path))["figure"]
    text = f"{description}\n\nPICTURES" + code("python", statements.strip())
    return title, text, {"figure": figure}


def heading(text: str) -> str:
    return f"{text}\n{'=' * len(text)}\n\n"


def code(language: str, text: str) -> str:
    lines = "\n".join(f"   {line}".rstrip() for line in text.splitlines())
    return f".. code-block:: {language}\n\n{lines}\n\n"


def index(titles: Mapping[str, str]) -> str:
    """Return the page of all entries as cards with their pictures."""
    text = heading("Gallery") + "Every picture here was drawn when these pages were built, by the code on its page.\n\n"
    text += ".. toctree::\n   :hidden:\n\n" + "".join(f"   {page}\n" for page in titles) + "\n"
    text += ".. grid:: 1 2 3 3\n   :gutter: 2\n\n"
    for page, title in titles.items():
        text += f"   .. grid-item-card:: {title}\n      :link: {page}\n      :link-type: doc\n"
        text += f"      :img-bottom: {page}.png\n\n"
    return text


if __name__ == "__main__":
    main()
