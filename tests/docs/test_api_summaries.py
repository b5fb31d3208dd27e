"""The reference lists each public name with the first sentence of its docstring, which ends at the first full stop."""

import inspect
import re

import pytest

import bemkit


@pytest.mark.parametrize("name", bemkit.__all__)
def test_the_summary_is_a_whole_sentence(name: str) -> None:
    first_paragraph = (inspect.getdoc(getattr(bemkit, name)) or "").split("\n\n")[0]
    sentence = re.split(r"(?<=\.)\s", " ".join(first_paragraph.split()))[0]
    assert re.search(r"[\w)`\]|}]\.$", sentence), sentence
    assert sentence[0].isupper() or sentence.startswith("`")
    assert sentence.count("(") == sentence.count(")"), sentence
    assert not re.search(r"\b(eq|no|fig|p)\.$", sentence), sentence
    assert len(sentence) >= 12
