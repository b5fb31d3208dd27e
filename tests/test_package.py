"""The package as a whole: its public names, what importing it costs, which module may import which."""

from __future__ import annotations

import ast
import builtins
import re
import subprocess
import sys
from collections.abc import Iterable
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import bemkit
from tests.statements import statements

PACKAGE = Path(bemkit.__file__).parent

CONTRIBUTING = Path(__file__).parent.parent / "CONTRIBUTING.md"
NAME = "bemkit"
NOT_NEEDED = (
    *("operators.steklov_poincare.galerkin", "operators.forms", "operators.assembly"),
    "operators.matrix_free",
    *("operators.particular_solutions", "model.particular", "model.free_motion", "model.contact_free_body"),
    *("geometry.free_form", "geometry.files", "geometry.proximity"),
    *("geometry.meshing.partition", "geometry.meshing.layers"),
    *("model.joined", "contact.joined", "scene.keys", "scene.symmetry"),
    *("results.between_bodies", "results.contact_places", "results.zone_ends"),
    *("runs.warm_start", "solvers.homotopy", "solvers.multistart", "contact.further_laws", "contact.polygon"),
    "contact.rough_profile",
    *("model.obstacle_travel", "model.overlaps", "model.shapes", "results.load_history", "scene.written_tables"),
    *("operators.half_plane", "operators.kernels", "operators.collocation.curved_elements"),
    *("operators.steklov_poincare.forces_inside", "operators.steklov_poincare.rigid_connection"),
    *("operators.hierarchy", "model.matched_sides", "results.jumps"),
    *("geometry.symmetry", "scene.body_forces", "scene.contacts", "scene.copies"),
    *("scene.load_history", "scene.plane_motion", "scene.profiles", "scene.steps"),
    *("operators.integrals", "operators.collocation.images"),
    *("operators.null_space", "contact.held_friction", "table", "atomic_files"),
    *("model.finite_sliding", "results.moved_contacts", "results.solved_steps"),
)
"""Of a scene with one body of straight sides on one obstacle, solved by collocation from a number of elements."""
NOT_NEEDED_BY_COMMAND = (
    *("operators.somigliana.fields", "operators.somigliana.straight_fields", "operators.matrix_free.factor"),
    *("results.boundary_stress", "pictures.files", "results.result_file", "hdf5", "cli.console"),
    *("runs.adaptive", "contact.mortar", "geometry.free_form.drawn", "operators.forms", "solvers.homotopy"),
)
"""When a command solves such a scene and writes JSON."""
MOST_MODULES = 105
"""Modules of the package that may be loaded to solve a simple scene, packages and command line counted."""
OUTPUT = ("h5py", "matplotlib", "meshio", "rich")
HEAVY = (*OUTPUT, "scipy.sparse.linalg", "pyamg", "click")

MISTAKES_OF_THE_CALLER = {"TypeError", "AttributeError", "AssertionError", "NotImplementedError"}
"""Built-in errors that tell a programmer of a wrong call; no input of the command line leads to them."""


def order() -> list[str]:
    """Return leaves, folders and single files of folders from the first to the last, as CONTRIBUTING lists them."""
    tree = re.search(r"```text\nbemkit/\n(.*?)```", CONTRIBUTING.read_text(), re.DOTALL)
    assert tree
    return [line.split()[0].removesuffix(".py").removesuffix("/") for line in tree[1].splitlines()]


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def dotted(path: Path) -> str:
    return ".".join((NAME, *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")


def imports_of(nodes: Iterable[ast.AST], package: Path = PACKAGE) -> set[str]:
    """Return the modules of the package that the statements of a module import, in functions and for its types too."""
    found = set()
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == NAME:
            for alias in node.names:
                inner = Path(package, *node.module.split(".")[1:], alias.name)
                is_module = inner.with_suffix(".py").exists() or inner.is_dir()
                found.add(f"{node.module}.{alias.name}" if is_module else node.module)
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names if alias.name.split(".")[0] == NAME}
    return found


def raised_by(nodes: Iterable[ast.AST]) -> set[str]:
    """Return the names of the errors that the statements of a module raise."""
    raises = (node.exc for node in nodes if isinstance(node, ast.Raise))
    errors = (each.func if isinstance(each, ast.Call) else each for each in raises)
    return {error.id for error in errors if isinstance(error, ast.Name)}


@pytest.fixture(scope="module")
def imported_and_raised() -> dict[str, tuple[set[str], set[str]]]:
    """For each module what it imports and what it raises."""
    statements_of = ((path, list(statements(path))) for path in modules())
    return {dotted(path): (imports_of(nodes), raised_by(nodes)) for path, nodes in statements_of}


def layer_of(name: str, layers: list[str]) -> int:
    """Return the place of a module in the list: its own one, or that of its folder."""
    folder, *inner = name.split(".")[1:]
    own = "/".join([folder, *inner])
    return layers.index(own if own in layers else folder)


def wrong_imports(graph: dict[str, set[str]], layers: list[str]) -> list[str]:
    """Return the imports that point down the list or to the face of the package, and a circle if there is one."""
    wrong = [
        f"{name} imports {imported}"
        for name, targets in graph.items()
        for imported in targets
        if imported == NAME or layer_of(imported, layers) > layer_of(name, layers)
    ]
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        wrong.append(" -> ".join(error.args[1]))
    return wrong


def test_the_tree_of_contributing_is_the_tree_of_the_package() -> None:
    there = {path.stem for path in PACKAGE.iterdir() if path.is_dir() or path.suffix == ".py"}
    assert {name.split("/")[0] for name in order()} == {name for name in there if not name.startswith("_")}


def test_imports_point_up_only_and_in_no_circle(imported_and_raised: dict[str, tuple[set[str], set[str]]]) -> None:
    graph = {name: imported for name, (imported, _) in imported_and_raised.items()}
    faces = {name for name in graph if name == NAME or name.startswith(f"{NAME}._")}
    assert wrong_imports({name: imported for name, imported in graph.items() if name not in faces}, order()) == []


def test_no_module_raises_a_bare_built_in_error(imported_and_raised: dict[str, tuple[set[str], set[str]]]) -> None:
    raised = {(name, error) for name, (_, errors) in imported_and_raised.items() for error in errors}
    built_in = {(name, error) for name, error in raised if hasattr(builtins, error)}
    left = {pair for pair in built_in if pair[1] not in MISTAKES_OF_THE_CALLER}
    assert left == {("bemkit.interrupts", "KeyboardInterrupt")}


@pytest.mark.parametrize(
    ("graph", "found"),
    [
        ({"bemkit.a.x": {"bemkit.b.y"}, "bemkit.b.y": set()}, "bemkit.a.x imports bemkit.b.y"),
        ({"bemkit.b.early": {"bemkit.b.y"}, "bemkit.b.y": set()}, "bemkit.b.early imports bemkit.b.y"),
        ({"bemkit.a.x": {"bemkit"}}, "bemkit.a.x imports bemkit"),
        ({"bemkit.a.x": {"bemkit.a.y"}, "bemkit.a.y": {"bemkit.a.x"}}, " -> "),
    ],
    ids=["down", "down in a folder", "face", "circle"],
)
def test_wrong_imports_are_found(graph: dict[str, set[str]], found: str) -> None:
    assert any(found in line for line in wrong_imports(graph, ["b/early", "a", "b"]))


@pytest.mark.parametrize(
    "line",
    ["import bemkit", "import bemkit.geometry.mesh", "from bemkit.geometry import mesh", "from bemkit import run"],
)
def test_every_form_of_import_is_seen(line: str, tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text(f"def late():\n    {line}\n")
    assert imports_of(statements(tmp_path / "module.py"))


def test_files_stay_small() -> None:
    assert [dotted(path) for path in modules() if len(path.read_text().splitlines()) > 400] == []


def test_every_public_name_can_be_reached_and_is_listed() -> None:
    for name in bemkit.__all__:
        assert getattr(bemkit, name).__name__ == name
    assert [name for name in dir(bemkit) if not name.startswith("_")] == sorted(bemkit.__all__)
    with pytest.raises(AttributeError, match="no attribute 'penalty'"):
        _ = bemkit.penalty


def test_the_typed_exports_are_the_real_ones() -> None:
    tree = ast.parse((PACKAGE / "__init__.pyi").read_text())
    imports = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    assert len(imports) == len(tree.body)  # every line is read
    typed = {alias.asname: node.module for node in imports for alias in node.names}
    assert typed.pop("__version__") == "bemkit.version"
    assert typed == {name: getattr(bemkit, "_MODULE_OF")[name] for name in bemkit.__all__}  # noqa: B009


def loaded_after(code: str) -> set[str]:
    """Return which heavy modules a fresh interpreter holds after some code."""
    program = f"{code}\nimport sys\nprint([m for m in {HEAVY!r} if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(ast.literal_eval(result.stdout.splitlines()[-1]))


def test_importing_bemkit_loads_nothing_heavy() -> None:
    assert loaded_after("import bemkit") == set()


@pytest.fixture(scope="module")
def found_after_each() -> list[list[str]]:
    """What a fresh interpreter holds of modules that are not needed, after one run after the other."""
    code = f"""
import sys
from importlib.util import find_spec
import bemkit as bk
assert bk.run(bk.load_scene("paper-1")).is_converged
names = [f"bemkit.{{name}}" for name in {NOT_NEEDED!r}] + {["scipy.spatial", "scipy.sparse", *HEAVY]!r}
found = [[name for name in names if name in sys.modules]]
from bemkit.cli.main import main
try:
    main(["run", "paper-1", "--elements", "40", "--json", "-"])
except SystemExit as end:
    assert end.code == 0
others = {[*OUTPUT, "pyamg", "distributed", "scipy.sparse"]!r}
wanted = [*others, *(f"bemkit.{{name}}" for name in {NOT_NEEDED_BY_COMMAND!r})]
found.append([name for name in wanted if name in sys.modules])
of_command = set(sys.modules)
scene = bk.Scene(title="block", shape=bk.Rectangle(1.0, 1.0), material=bk.Material(1.0, 0.3), parts=(
    bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
    bk.Part("wall", bk.Roller(), sides=("right",)),
    bk.Part("load", bk.Traction(y=-1.0), sides=("top",)),
), mesh=bk.MeshOptions(elements=24))
assert bk.run(scene).is_converged
found.append([name for name in {HEAVY!r} if name in sys.modules and name not in of_command])
print(found, file=sys.stderr)
assert all(find_spec(name) for name in [*names, *wanted] if name.startswith("bemkit."))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    found: list[list[str]] = ast.literal_eval(done.stderr)
    return found


def test_what_a_scene_does_not_need_is_not_imported(found_after_each: list[list[str]]) -> None:
    assert found_after_each[0] == []


def test_a_command_that_writes_json_imports_nothing_without_need(found_after_each: list[list[str]]) -> None:
    assert found_after_each[1] == []


def test_solving_a_scene_from_objects_loads_no_output_library(found_after_each: list[list[str]]) -> None:
    assert found_after_each[2] == []


def test_the_command_line_loads_few_modules_for_a_simple_scene(tmp_path: Path) -> None:
    """Those of other files are not among them: a result goes into an HDF5 file in a second run."""
    code = """
import sys
from bemkit.cli.main import main
for more in ([], ["-o", sys.argv[1]]):
    try:
        main(["run", "paper-1", "--elements", "40", *more])
    except SystemExit as end:
        assert end.code == 0
    print(sum(name.split(".")[0] == "bemkit" for name in sys.modules))
print([name for name in ("bemkit.results.vtk", "bemkit.results.stress_mesh", "scipy.spatial") if name in sys.modules])
"""
    command = [sys.executable, "-c", code, str(tmp_path / "result.hdf5")]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert int(next(line for line in lines if line.isdigit())) <= MOST_MODULES
    assert lines[-1] == "[]"


def test_the_public_names_are_few() -> None:
    """What a scene and its results need; what extenders need has modules."""
    assert len(bemkit.__all__) <= 100
