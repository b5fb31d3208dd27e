"""Numbers beside axes, as plain text."""

from __future__ import annotations

from typing import Any

from matplotlib.ticker import ScalarFormatter


class PlainNumbers(ScalarFormatter):
    """Format numbers as plain text, and their common power of ten as mathematics, which takes long to lay out."""

    def __init__(self) -> None:
        super().__init__(useOffset=False, useMathText=True)
        self.set_powerlimits((-3, 4))  # 2500 MPa, not 2.5 times 10^3 MPa

    def __call__(self, x: float, pos: Any = None) -> str:
        """Return the text of a number."""
        return super().__call__(x, pos).removeprefix(r"$\mathdefault{").removesuffix("}$")
