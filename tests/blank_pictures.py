"""Pictures that are written without being drawn."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib.image
import numpy as np
import pytest
from matplotlib.figure import Figure


@contextmanager
def blank_pictures() -> Iterator[None]:
    """Write each figure as one white point, where a test looks at nothing in it: to draw one takes 0.3 s."""

    def save(figure: Figure, place: Any, *, format: str, **options: Any) -> None:
        if format == "png":
            matplotlib.image.imsave(place, np.ones((1, 1, 3)), format=format)
        else:
            drawn(figure, place, format=format, **options)

    drawn = Figure.savefig
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", save)
        yield
