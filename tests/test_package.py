"""The package as a whole: its public names, what importing it costs, which module may import which."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import bemkit

PACKAGE = Path(bemkit.__file__).parent

# imports point up only: a module may import those of its own layer and of earlier ones
LAYERS = [
    {"arrays", "complaint", "errors", "expression", "files", "hdf5", "locks", "printable", "streams", "workers"},
    {"geometry"},
    {"operators"},
    {"contact"},
    {"solvers"},
    {"discretisations", "mesh_options", "scene", "scene_symmetry"},
    {
        "boundary_data",
        "contact_data",
        "elasticity",
        "estimate",
        "plan",
        "kinds",
        "model",
        "history",
        "structuring",
        "shipped",
    },
    {"clock", "solution", "scenefile", "escape"},
    {"warm_start", "held_friction", "contact_warnings", "energy", "solution_warnings", "totals"},
    {"planfile", "io", "tables", "boundary_figure", "plotting", "interior", "runner", "adaptive", "reference"},
    {"outputs", "report", "explain", "rowfile", "testing", "cascade"},
    {"study", "stability"},
    {"cli"},
]
HEAVY = ("scipy.sparse.linalg", "h5py", "pyamg", "matplotlib", "meshio", "rich", "click", "cattrs")


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def layer_of(module: str) -> int:
    first = module.split(".")[1]
    return next(number for number, names in enumerate(LAYERS) if first in names)


def imports_of(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("bemkit."):
            found.add(node.module)
    return found


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_point_up_only(path: Path) -> None:
    name = ".".join(("bemkit", *path.relative_to(PACKAGE).with_suffix("").parts))
    if name in {"bemkit.__init__", "bemkit.__main__"}:
        return
    for imported in imports_of(path):
        assert layer_of(imported) <= layer_of(name), f"{name} imports {imported}, which stands below it"


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_files_stay_small(path: Path) -> None:
    assert len(path.read_text().splitlines()) <= 400


def test_every_public_name_can_be_reached_and_is_listed() -> None:
    for name in bemkit.__all__:
        assert getattr(bemkit, name).__name__ == name
    assert set(bemkit.__all__) <= set(dir(bemkit))
    with pytest.raises(AttributeError, match="no attribute 'penalty'"):
        _ = bemkit.penalty


def test_the_typed_exports_are_the_real_ones() -> None:
    tree = ast.parse((PACKAGE / "__init__.py").read_text())
    typed = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("bemkit."):
            typed |= {alias.name: node.module for alias in node.names}
    assert typed == {name: getattr(bemkit, "_MODULE_OF")[name] for name in bemkit.__all__}  # noqa: B009


def loaded_after(code: str) -> set[str]:
    """Return which heavy modules a fresh interpreter holds after some code."""
    program = f"{code}\nimport sys\nprint([m for m in {HEAVY!r} if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(ast.literal_eval(result.stdout.splitlines()[-1]))


def test_importing_bemkit_loads_nothing_heavy() -> None:
    assert loaded_after("import bemkit") == set()


def test_solving_a_scene_from_objects_loads_no_output_library() -> None:
    code = """
import bemkit as bk
scene = bk.Scene(title="block", shape=bk.Rectangle(1.0, 1.0), material=bk.Material(1.0, 0.3), parts=(
    bk.Part("floor", bk.Contact(bk.HalfPlane()), sides=("bottom",)),
    bk.Part("wall", bk.Roller(), sides=("right",)),
    bk.Part("load", bk.Traction(y=-1.0), sides=("top",)),
), mesh=bk.MeshOptions(elements=24))
assert bk.run(scene).is_converged
"""
    assert loaded_after(code) == set()
