"""One part in many files: a plate of 3 by 1.5 with a rounded corner and a hole, its area known in closed form."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path

import pytest

DATA = Path(__file__).parent / "data"
MESHES = ("untagged.msh", "saveall.msh", "version-2.msh", "version-4.msh", "quadratic.msh", "part.geo")
AREA = 3.0 * 1.5 - (1.0 - math.pi / 4.0) * 0.25 - math.pi * 0.09


def why_no(package: str) -> str:
    return "" if importlib.util.find_spec(package) else f"{package} is not installed"


needs_ezdxf = pytest.mark.skipif(bool(why_no("ezdxf")), reason="ezdxf is not installed")
needs_svgpathtools = pytest.mark.skipif(bool(why_no("svgpathtools")), reason="svgpathtools is not installed")


def dxf(*entities: str, unit: int = 0) -> str:
    """Return a DXF file of the entities, each ``KIND code value code value ...``."""
    pairs = [
        "0 SECTION",
        "2 HEADER",
        "9 $ACADVER",
        "1 AC1015",
        "9 $INSUNITS",
        f"70 {unit}",
        "0 ENDSEC",
        "0 SECTION",
        "2 ENTITIES",
    ]
    for entity in entities:
        kind, *fields = entity.split()
        pairs += [f"0 {kind}", *(f"{code} {value}" for code, value in zip(fields[::2], fields[1::2], strict=True))]
    return "\n".join(line for pair in [*pairs, "0 ENDSEC", "0 EOF"] for line in pair.split(" ", 1)) + "\n"


def line(layer: str, x: float, y: float, x_end: float, y_end: float) -> str:
    return f"LINE 8 {layer} 10 {x} 20 {y} 11 {x_end} 21 {y_end}"


PART_DXF = (
    line("FOOT", 0.0, 0.0, 3.0, 0.0),
    line("WALL", 3.0, 1.0, 3.0, 0.0),
    "ARC 8 BODY 10 2.5 20 1.0 40 0.5 50 0 51 90",
    line("BODY", 0.0, 1.5, 2.5, 1.5),
    line("WALL", 0.0, 1.5, 0.0, 0.0),
    "CIRCLE 8 HOLE 10 1.0 20 0.75 40 0.3",
    "TEXT 8 BODY 10 0 20 0 40 1 1 part",
)
PART_SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="30mm" height="15mm" viewBox="0 0 300 150">
<g id="part" transform="translate(0, 150) scale(100, -100)">
<path id="plate" d="M0 0 H3 V1 A0.5 0.5 0 0 1 2.5 1.5 H0 Z"/><circle id="hole" cx="1" cy="0.75" r="0.3"/>
</g><rect id="frame" x="-10" y="-10" width="400" height="300"/></svg>"""
"""Ten times as large as the part, in mm."""
