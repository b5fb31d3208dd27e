"""Scripts of the documentation can be imported."""

import sys

from tests.docs.pages import DOCS

sys.path.append(str(DOCS))
