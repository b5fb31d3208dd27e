"""Words that bemkit does not use in prose: code, documentation and README say the same in the terms of the field."""

import io
import re
import tokenize
from pathlib import Path

import pytest

TOP = Path(__file__).parents[1]
NEVER = re.compile(
    r"\b(?:told|tells?|telling|left out|left over|leav(?:e|es|ing) (?:[\w`.']+ ){0,3}out\b(?! of)|doubt\w*|befits?"
    r"|worth its name|whatever|stands|stand|alone)\b",
    re.IGNORECASE,
)
"""Household words: say "known" or "report", "skip" or "exclude", "warning", "is" or "represents", "any", "only"."""
FILES = [
    path
    for pattern in ("bemkit/**/*.py*", "bemkit/**/*.toml", "docs/**/*.md", "docs/**/*.py", "docs/**/*.toml", "*.md")
    for path in sorted(TOP.glob(pattern))
    if path.suffix in (".py", ".pyi", ".toml", ".md") and not {"_build", "generated"} & set(path.parts)
]
_PROSE = {tokenize.COMMENT, tokenize.STRING} | {
    getattr(tokenize, name) for name in ("FSTRING_MIDDLE",) if hasattr(tokenize, name)
}


def prose_of(path: Path) -> str:
    """Return the words of a file that people read: of code its comments and texts, of others all but code."""
    text = path.read_text("utf-8")
    if path.suffix in (".py", ".pyi") and found_in(words_of(text)):  # reading tokens takes long
        tokens = tokenize.generate_tokens(io.StringIO(text).readline)
        text = "\n".join(token.string for token in tokens if token.type in _PROSE)
    return words_of(text)


def words_of(text: str) -> str:
    return re.sub(r"[\s#]+", " ", text)


def found_in(text: str) -> list[str]:
    return [text[max(match.start() - 40, 0) : match.end() + 40] for match in NEVER.finditer(text)]


@pytest.mark.parametrize("directory", ["bemkit", "docs", "."])
def test_household_words_are_not_used(directory: str) -> None:
    files = [path for path in FILES if path.relative_to(TOP).parts[0] == directory or path.parent == TOP / directory]
    assert files
    found = {path.relative_to(TOP).as_posix(): found_in(prose_of(path)) for path in files}
    assert {name: words for name, words in found.items() if words} == {}


def test_docstrings_begin_with_a_noun_or_a_verb() -> None:
    begins = re.compile(r'^\s*r?"""(Of|What|Where)\b.*', re.MULTILINE)
    texts = {path.relative_to(TOP).as_posix(): path.read_text("utf-8") for path in (TOP / "bemkit").rglob("*.py")}
    assert [(name, match[0]) for name, text in texts.items() for match in begins.finditer(text)] == []


def test_the_documentation_has_at_most_48000_words() -> None:
    pages = [path for path in TOP.glob("docs/**/*.md") if not {"_build", "generated"} & set(path.parts)]
    assert 40000 < sum(len(path.read_text("utf-8").split()) for path in pages) <= 48000


@pytest.mark.parametrize("text", ["What is left out", "It leaves the second row out", "Whatever holds", "by V alone"])
def test_household_words_are_found(text: str) -> None:
    assert found_in(text)


@pytest.mark.parametrize("text", ["It leaves the forces out of equilibrium", "a standalone file", "the left side"])
def test_other_words_are_not_found(text: str) -> None:
    assert not found_in(text)


def test_the_readme_fits_a_screen_or_two() -> None:
    lines = (TOP / "README.md").read_text("utf-8").splitlines()
    assert len(lines) <= 80
    assert max(map(len, lines)) <= 120


def test_the_changelog_has_at_most_25_entries_for_a_version() -> None:
    versions = re.split(r"^## ", (TOP / "CHANGELOG.md").read_text("utf-8"), flags=re.MULTILINE)[1:]
    assert versions
    assert all(len(re.findall(r"^- ", version, re.MULTILINE)) <= 25 for version in versions)
