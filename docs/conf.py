"""Configuration of the documentation: ``python -m sphinx -W -b html docs html``."""

from importlib.metadata import version as installed_version

project = "bemkit"
author = "The bemkit developers"
copyright = author
release = installed_version("bemkit")
version = release

extensions = ["myst_parser"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
source_suffix = {".md": "markdown"}
exclude_patterns = ["html"]

html_theme = "alabaster"
html_theme_options = {"description": "Frictional contact by boundary elements", "page_width": "1080px"}
