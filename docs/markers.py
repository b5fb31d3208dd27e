"""Pages with generated parts: the text between two markers is replaced."""

from __future__ import annotations

import re


def between(text: str, marker: str, content: str) -> str:
    """Replace the text between ``<!--  marker -->`` and ``<!-- end marker -->``."""
    pattern = rf"(<!-- {marker} -->\n).*?(<!-- end {marker} -->)"
    replaced, count = re.subn(pattern, lambda match: f"{match[1]}\n{content}\n\n{match[2]}", text, flags=re.DOTALL)
    if count != 1:
        raise ValueError(f"the page has {count} places marked {marker!r}: keep one")
    return replaced
