"""Draw the figures of the documentation: ``python docs/make_images.py`` writes them to ``docs/images``."""

from __future__ import annotations

from pathlib import Path

import bemkit as bk
from bemkit.pictures import (
    draw_contact_displacement,
    draw_contact_map,
    draw_contact_traction,
    draw_deformation,
    draw_friction_cone,
    draw_friction_loop,
    draw_status_over_time,
    draw_stress,
    draw_zoom,
)
from bemkit.pictures.figure_files import write_figures
from bemkit.scene.toml import with_overrides

IMAGES = Path(__file__).parent / "images"
DOTS_PER_INCH = 110  # sharp at the width of a page, and each file below 100 kB


def main() -> None:
    """Solve Example 1 of the paper with linear elements, an arch, a pin and a friction loop, and draw them."""
    solution = bk.run(with_overrides(bk.load_scene("paper-1"), discretisation="linear"))
    loop = bk.run(bk.load_scene("friction-loop"))
    rough = bk.run(with_overrides(bk.load_scene("rough-surface"), elements=1024))
    arch, pin = bk.run(bk.load_scene("masonry-arch")), bk.run(bk.load_scene("pin-in-plate"))
    pictures = {
        "paper-1-deformed": draw_deformation(solution),
        "paper-1-displacement": draw_contact_displacement(solution, "foundation"),
        "paper-1-traction": draw_contact_traction(solution, "foundation"),
        "rough-surface-displacement": draw_contact_displacement(rough, "zone"),
        "masonry-arch-deformed": draw_deformation(arch),
        "masonry-arch-contacts": draw_contact_map(arch),
        "pin-in-plate-contacts": draw_contact_map(pin),
        "pin-in-plate-von-mises": draw_stress(pin),
        "paper-1-friction-cone": draw_friction_cone(solution, "foundation"),
        "friction-loop": draw_friction_loop(loop),
        "friction-loop-status": draw_status_over_time(loop, "floor"),
        "two-cylinders-zoom": draw_zoom(bk.run(bk.load_scene("two-cylinders"))),
    }
    write_figures({name: axes.get_figure(root=True) for name, axes in pictures.items()}, IMAGES, DOTS_PER_INCH)


if __name__ == "__main__":
    main()
