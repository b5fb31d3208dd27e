"""What a release says of where it lives: project URLs, and a README whose links and pictures are absolute.

All follow at build time from ``address`` in ``[tool.hatch.metadata.hooks.custom]`` of ``pyproject.toml``. While it is
empty there are no URLs, and the README is as it stands in the repository.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

_LINK = re.compile(r"(!?)(\[[^\]]*\])\((?![a-z]+:|#)([^)\s]+)\)")
"""Links and pictures of files in the repository."""


class AddressHook(MetadataHookInterface):
    """Sets the README, and the project URLs where there is an address."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add to the metadata of the project."""
        root = Path(self.root)
        address = str(self.config["address"]).rstrip("/")
        version = re.search(r'"(.*)"', (root / "bemkit" / "version.py").read_text("utf-8").split("__version__")[1])
        tag = f"v{version[1]}" if version else "HEAD"
        text = (root / "README.md").read_text("utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": absolute(text, address, tag)}
        metadata["urls"] = urls(address, tag)


def absolute(text: str, address: str, tag: str) -> str:
    """Return Markdown whose links and pictures lead to the files of a tag, as GitHub and GitLab serve them."""
    if not address:
        return text
    return _LINK.sub(lambda m: f"{m[1]}{m[2]}({address}/{'raw' if m[1] else 'blob'}/{tag}/{m[3]})", text)


def urls(address: str, tag: str) -> dict[str, str]:
    """Return the project URLs by their names on a package index."""
    if not address:
        return {}
    files = f"{address}/blob/{tag}"
    return {
        "Source": address,
        "Documentation": f"{files}/docs/index.md",
        "Changelog": f"{files}/CHANGELOG.md",
        "Issues": f"{address}/issues",
    }
