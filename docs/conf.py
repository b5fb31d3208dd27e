"""Configuration of the documentation: ``python -m sphinx -W -b html docs html``."""

import sys
from importlib.metadata import version as installed_version
from pathlib import Path

from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parent))

import make_api

project = "bemkit"
author = "The bemkit developers"
copyright = author
release = installed_version("bemkit")
version = release

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon", "sphinx_design"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["html"]

default_role = "py:obj"
autodoc_typehints = "none"  # docstrings say types with shapes and units
autodoc_preserve_defaults = True
autosummary_generate = False
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = "furo"
html_title = f"bemkit {release}"


def shorten_defaults(*event: object) -> tuple[str, object] | None:
    """Write ``...`` for defaults that are made anew for each object."""
    *_, signature, result = event
    return (signature.replace("<factory>", "..."), result) if isinstance(signature, str) else None


def setup(app: Sphinx) -> None:
    """Make the generated pages."""
    app.connect("builder-inited", lambda app: make_api.main())
    app.connect("autodoc-process-signature", shorten_defaults)
