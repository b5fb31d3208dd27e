"""Draw the figures of the documentation: ``python docs/make_images.py`` writes them to ``docs/images``."""

from __future__ import annotations

from pathlib import Path

import bemkit as bk
from bemkit.results.assembly_figures import draw_contact_map, draw_deformed_bodies
from bemkit.results.figures import draw_contact_displacement, draw_contact_traction, draw_deformation
from bemkit.results.history_figures import history_figures
from bemkit.scene.toml import with_overrides

IMAGES = Path(__file__).parent / "images"
DOTS_PER_INCH = 110  # sharp at the width of a page, and each file below 100 kB


def main() -> None:
    """Solve Example 1 of the paper with linear elements, an arch, a pin and a friction loop, and draw them."""
    solution = bk.run(with_overrides(bk.load_scene("paper-1"), discretisation="linear"))
    arch, pin = bk.run(bk.load_scene("masonry-arch")), bk.run(bk.load_scene("pin-in-plate"))
    figures = {
        "paper-1-deformed": draw_deformation(solution),
        "paper-1-displacement": draw_contact_displacement(solution, "foundation"),
        "paper-1-traction": draw_contact_traction(solution, "foundation"),
        "masonry-arch-deformed": draw_deformed_bodies(arch),
        "masonry-arch-contacts": draw_contact_map(arch),
        "pin-in-plate-contacts": draw_contact_map(pin),
    }
    drawn = history_figures(bk.run(bk.load_scene("friction-loop")))
    figures |= {"friction-loop": drawn["friction-loop"], "friction-loop-status": drawn["status-over-time"]}
    IMAGES.mkdir(exist_ok=True)
    for name, figure in figures.items():
        # without the time and version stamps the same picture is the same file
        figure.savefig(IMAGES / f"{name}.png", dpi=DOTS_PER_INCH, metadata={"Software": None})


if __name__ == "__main__":
    main()
