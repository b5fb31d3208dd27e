"""Every Python block of the documentation and the README runs, page by page, in a folder of its own.

Blocks between outputs that a page shows run in `test_shown_outputs`.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from sybil import Sybil
from sybil.parsers.markdown import PythonCodeBlockParser

from tests.docs.pages import DOCS, OUTPUTS_SHOWN
from tests.slow import slow_only

ROOT = DOCS.parent
PAGES = [ROOT / "README.md", *sorted(set(DOCS.rglob("*.md")) - {DOCS / page for page in OUTPUTS_SHOWN})]


# what these show has quick tests of its own: in tests/pictures, tests/report, tests/studies, tests/runs, and beside
SLOW = [
    DOCS / name
    for name in (
        *("pictures.md", "reports.md", "error-against-run-time.md", "large-scenes.md"),
        *("tutorials/load-histories.md", "tutorials/a-matrix-free-body.md", "tutorials/rough-surfaces.md"),
        "tutorials/adding-a-driver.md",
        "tutorials/property-tests.md",
        *("several-bodies.md", "tutorials/a-body-of-ones-own.md", "tutorials/adding-a-discretisation.md"),
        *("theory.md", "how-to/read-a-certificate.md", "how-to/choose-elements.md", "tutorials/operators.md"),
    )
]


@pytest.mark.parametrize(
    "page",
    slow_only([page for page in PAGES if "```python" in page.read_text("utf-8")], *SLOW),
    ids=lambda page: page.stem,
)
@pytest.mark.usefixtures("here")
def test_page(page: Path) -> None:
    document = Sybil(parsers=[PythonCodeBlockParser()]).parse(page)  # one namespace for the page
    examples = list(document.examples())
    assert len(examples) == page.read_text("utf-8").count("\n```python\n")
    for example in examples:
        example.evaluate()


def test_a_block_that_is_wrong_fails(tmp_path: Path) -> None:
    page = tmp_path / "wrong.md"
    page.write_text("Text.\n\n```python\nvalue = 1\n```\n\nMore text.\n\n```python\nassert value == 2\n```\n")
    first, second = Sybil(parsers=[PythonCodeBlockParser()]).parse(page).examples()
    first.evaluate()
    with pytest.raises(AssertionError):
        second.evaluate()
