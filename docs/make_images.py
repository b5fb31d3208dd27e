"""Draw the figures of the documentation: ``python docs/make_images.py`` writes them to ``docs/images``."""

from __future__ import annotations

from pathlib import Path

import bemkit as bk
from bemkit.results.figures import Units, draw_contact_displacement, draw_contact_traction, draw_deformation
from bemkit.scene.toml import with_overrides

IMAGES = Path(__file__).parent / "images"
DOTS_PER_INCH = 110  # sharp at the width of a page, and each file below 100 kB


def main() -> None:
    """Solve Example 1 of the paper with linear elements and draw it."""
    solution = bk.run(with_overrides(bk.load_scene("paper-1"), discretisation="linear"))
    units = Units(length="-", stress="-")  # the paper gives none
    figures = {
        "paper-1-deformed": draw_deformation(solution, units=units),
        "paper-1-displacement": draw_contact_displacement(solution, "foundation", units=units),
        "paper-1-traction": draw_contact_traction(solution, "foundation", units=units),
    }
    IMAGES.mkdir(exist_ok=True)
    for name, figure in figures.items():
        # without the time and version stamps the same picture is the same file
        figure.savefig(IMAGES / f"{name}.png", dpi=DOTS_PER_INCH, metadata={"Software": None})


if __name__ == "__main__":
    main()
