"""Configuration of the documentation: ``python -m sphinx -W -b html docs html``."""

import json
import sys
from pathlib import Path

from sphinx.application import Sphinx

from bemkit.scene.schema import scene_schema
from bemkit.version import __version__

sys.path.insert(0, str(Path(__file__).parent))

import make_api
import make_gallery
from docstring_marks import as_restructured_text

project = "bemkit"
author = "The bemkit developers"
copyright = author
release = __version__
version = release

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_design",
]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb", ".rst": "restructuredtext"}
nb_execution_mode = "force"  # notebooks are kept without outputs
nb_execution_raise_on_error = True
nb_execution_in_temp = True  # what they write is not of the documentation
nb_execution_timeout = 300
exclude_patterns = ["html", "_build"]

default_role = "py:obj"
suppress_warnings = ["ref.python"]  # names such as n_contact in types, which several classes have
autodoc_typehints = "none"  # docstrings say types with shapes and units
autodoc_mock_imports = ["numba"]  # an extra: without it the kernels run in numpy
autodoc_preserve_defaults = True
autosummary_generate = False
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
napoleon_use_param = False  # types are words and shapes: nothing to link

PUBLISHED = Path(__file__).parent / "_build" / "published"
PUBLISHED.mkdir(parents=True, exist_ok=True)
html_extra_path = [str(PUBLISHED)]
html_static_path = ["static"]
html_css_files = ["gallery.css"]
html_theme = "furo"
html_title = f"bemkit {release}"


def shorten_defaults(*event: object) -> tuple[str, object] | None:
    """Write ``...`` for defaults that are made anew for each object."""
    *_, signature, result = event
    return (signature.replace("<factory>", "..."), result) if isinstance(signature, str) else None


def protect_formulas(*event: object) -> None:
    """Protect the formulas of a docstring, before its sections are read."""
    lines = event[-1]
    assert isinstance(lines, list)
    lines[:] = as_restructured_text(lines)


def skip_what_matplotlib_writes(*event: object) -> bool | None:
    """Skip the method ``set`` that matplotlib writes into each subclass of its figures, with markup of its own."""
    member = event[3]
    return True if getattr(member, "__module__", None) == "matplotlib.artist" else None


def make_pages() -> None:
    """Write the pages that are made of the package, and the schema of scene files."""
    make_api.main()
    make_gallery.main()
    (PUBLISHED / "scene.schema.json").write_text(json.dumps(scene_schema(), indent=1, allow_nan=False), "utf-8")


def setup(app: Sphinx) -> None:
    """Make the generated pages."""
    app.connect("builder-inited", lambda app: make_pages())
    app.connect("autodoc-skip-member", skip_what_matplotlib_writes)
    app.connect("autodoc-process-signature", shorten_defaults)
    app.connect("autodoc-process-docstring", protect_formulas, priority=100)  # sections are read at 500
