"""Result files: everything comes back, and a file that is wrong or hostile is refused in one line."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import time
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path

import h5py
import numpy as np
import pytest

import bemkit.results.result_file
from bemkit.contact.laws import Coulomb
from bemkit.hdf5 import Reader
from bemkit.results.result_file import OutputFileError, ResultFileError, read_result, write_result
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.scene.conditions import Part, Traction
from bemkit.scene.toml import SceneError, load_scene, scene_from_toml, scene_to_toml, with_overrides
from bemkit.solvers.base import Status
from tests.sealed import seal

DISC = """
title = "Disc between plates"
discretisation = "linear"
shape = { kind = "disk", radius = 1.0, centre = [0.0, 1.0] }
material = { youngs_modulus = 1.0, poisson_ratio = 0.3 }
mesh = { elements = 32 }
law = "frictionless"
[parts.floor]
sides = ["arc-3", "arc-4"]
condition = { kind = "contact", obstacle = "half-plane" }
[parts.press]
sides = ["arc-1", "arc-2"]
where = "y > 1.9"
condition = { kind = "displacement", x = 0.0, y = -0.01 }
"""


@pytest.fixture(scope="module")
def solution() -> Solution:
    return run(with_overrides(load_scene("paper-1"), elements=40, discretisation="linear"))


@pytest.fixture
def file(tmp_path: Path, solution: Solution) -> Path:
    path = tmp_path / "result.h5"
    write_result(path, solution)
    return path


def assert_same(one: Solution, other: Solution) -> None:
    for name, column in one.contact.columns().items():
        np.testing.assert_array_equal(other.contact.columns()[name], column, err_msg=name)
    for name in ("points", "displacement", "centres", "traction", "traction_dofs"):
        np.testing.assert_array_equal(getattr(other.boundary, name), getattr(one.boundary, name))
    for name in ("nodes", "elements", "lengths", "normals"):
        np.testing.assert_array_equal(getattr(other.mesh, name), getattr(one.mesh, name))
    assert {name: list(part) for name, part in other.mesh.parts.items()} == {
        name: list(part) for name, part in one.mesh.parts.items()
    }
    assert scene_to_toml(other.scene) == scene_to_toml(one.scene)
    assert other.contact.part == one.contact.part
    assert (other.history, other.transitions, other.plan) == (one.history, one.transitions, one.plan)
    assert other.summary() == one.summary()
    assert list(other.timings) == list(one.timings)  # in the order of the stages


def test_a_result_comes_back_bit_for_bit(file: Path, solution: Solution) -> None:
    assert_same(solution, read_result(file))


def test_curved_meshes_and_infinite_gaps_come_back(tmp_path: Path) -> None:
    solution = run(scene_from_toml(DISC))
    assert not solution.mesh.is_straight.any()
    assert np.isinf(solution.contact.gap).any()
    write_result(tmp_path / "disc.h5", solution)
    assert_same(solution, read_result(tmp_path / "disc.h5"))


def test_a_failed_solution_comes_back_as_failed(tmp_path: Path, solution: Solution) -> None:
    write_result(tmp_path / "r.h5", dataclasses.replace(solution, status=Status.CYCLING, message="round and round"))
    again = read_result(tmp_path / "r.h5")
    assert (again.status, again.message, again.is_converged) == (Status.CYCLING, "round and round", False)


def test_scenes_that_follow_each_other_come_back(tmp_path: Path, solution: Solution) -> None:
    scenes = [dataclasses.replace(solution.scene, law=Coulomb(friction)) for friction in (0.3, 0.4)]
    first, last = run(scenes)
    write_result(tmp_path / "r.h5", last)
    again = read_result(tmp_path / "r.h5")
    assert isinstance(again, Solution)
    assert_same(last, again)
    assert again.at_step(1).scene.law == first.scene.law == Coulomb(0.3)


def test_provenance_names_versions_but_neither_people_nor_places(file: Path) -> None:
    with h5py.File(file) as stored:
        provenance = dict(stored["provenance"].attrs)
        assert stored.attrs["schema_version"] == 7
    assert set(provenance) == {"bemkit", "python", "numpy", "scipy", "h5py", "platform", "created"}
    text = " ".join(map(str, provenance.values()))
    assert str(Path.home()) not in text
    assert str(file.parent) not in file.read_bytes().decode("latin-1")


def test_an_older_result_is_replaced_and_other_files_are_not(file: Path, solution: Solution) -> None:
    write_result(file, dataclasses.replace(solution, message="second"))
    assert read_result(file).message == "second"
    assert os.listdir(file.parent) == ["result.h5"]
    for content in (b"my thesis", b""):
        file.write_bytes(content)
        with pytest.raises(OutputFileError, match="exists and is not a bemkit result"):
            write_result(file, solution)
        assert file.read_bytes() == content
    with h5py.File(file, "w") as other:
        other["data"] = np.zeros(3)
    with pytest.raises(OutputFileError, match="exists and is not a bemkit result"):
        write_result(file, solution)


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_an_interrupt_while_writing_leaves_the_old_result(
    file: Path, solution: Solution, error: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*arguments: object) -> None:
        raise error

    monkeypatch.setattr(bemkit.results.result_file, "write_array", interrupted)
    with pytest.raises(error):
        write_result(file, dataclasses.replace(solution, message="never"))
    assert os.listdir(file.parent) == ["result.h5"]
    assert read_result(file).message == solution.message


def test_a_scene_with_python_functions_is_refused_before_anything_is_written(
    tmp_path: Path, solution: Solution
) -> None:
    parts = (*solution.scene.parts, Part("more", Traction(x=lambda x, y: x), ("left",), lambda x, y: y < 0.1))
    with pytest.raises(SceneError, match="a Python function"):
        write_result(
            tmp_path / "r.h5", dataclasses.replace(solution, scene=dataclasses.replace(solution.scene, parts=parts))
        )
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.9, 0.999])
def test_cut_files_are_refused(file: Path, share: float) -> None:
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    with pytest.raises(ResultFileError, match=r"result\.h5: .*: "):
        read_result(file)


def test_no_damage_to_a_single_byte_raises_anything_else(file: Path) -> None:
    content = bytearray(file.read_bytes())
    rng = np.random.default_rng(5)
    for position in rng.choice(len(content), 30, replace=False):
        damaged = content.copy()
        damaged[position] ^= 0xFF
        file.write_bytes(damaged)
        # numbers may turn into nan or change unseen; what matters is that no other exception escapes
        with warnings.catch_warnings(), contextlib.suppress(ResultFileError):
            warnings.simplefilter("ignore")
            read_result(file)


def assert_same_or_named(file: Path, content: bytes, places: Iterable[int], expected: Solution) -> None:
    """Flip one bit of each byte at the places; what is read is the same, or an error with a name."""
    for place in places:
        damaged = bytearray(content)
        damaged[place] ^= 1 << (place % 8)
        file.write_bytes(damaged)
        try:
            assert_same(expected, read_result(file))
        except ResultFileError as error:
            assert str(error).isprintable()  # noqa: PT017 - either outcome is right


def test_any_flipped_bit_leaves_the_same_data_or_is_named(file: Path) -> None:
    content, expected = file.read_bytes(), read_result(file)
    places = np.random.default_rng(11).choice(len(content), 30, replace=False)
    assert_same_or_named(file, content, [*range(50), *places.tolist()], expected)


@pytest.mark.slow
def test_a_flipped_bit_in_any_byte_is_the_same_data_or_is_named(file: Path) -> None:
    content, expected = file.read_bytes(), read_result(file)
    assert_same_or_named(file, content, range(len(content)), expected)


def test_a_bit_that_drives_the_hdf5_library_into_an_endless_loop_is_named(file: Path) -> None:
    # without the checksum before the content, several bytes of its list of groups do so
    content = bytearray(file.read_bytes())
    content[512 + 2631 :] = bytes(len(content) - 512 - 2631)
    file.write_bytes(content)
    with pytest.raises(ResultFileError, match="does not match its checksum"):
        read_result(file)


def test_foreign_files_of_any_depth_and_size_are_refused_at_once(tmp_path: Path) -> None:
    deep, wide = tmp_path / "deep.h5", tmp_path / "wide.h5"
    with h5py.File(deep, "w") as stored:
        group = stored
        for _ in range(3000):
            group = group.create_group("a")
    with h5py.File(wide, "w", libver="latest") as stored:
        stored.create_dataset("huge", shape=(10**9,), dtype="f8")
        for k in range(3000):
            stored.create_group(f"g{k}")
    for path in (deep, wide):
        begin = time.perf_counter()
        with pytest.raises(ResultFileError, match="an HDF5 file, but not of bemkit: give a file written by"):
            read_result(path)
        with pytest.raises(OutputFileError, match="exists and is not a bemkit result"):
            bemkit.results.result_file.check_result_target(path)
        assert time.perf_counter() - begin < 1.0  # takes less than a millisecond


def test_escape_codes_of_strangers_are_not_handed_on(file: Path, solution: Solution) -> None:
    write_result(file, dataclasses.replace(solution, message="\x1b[31mred\u202e", timings={"total": 1.0}))
    assert read_result(file).message == "?[31mred?"


def replaced(name: str, **arguments: object) -> Callable[[h5py.File], None]:
    def change(stored: h5py.File) -> None:
        del stored[name]
        stored.create_dataset(name, **arguments)

    return change


def deleted(name: str) -> Callable[[h5py.File], None]:
    def change(stored: h5py.File) -> None:
        del stored[name]

    return change


def attribute(group: str, name: str, value: object) -> Callable[[h5py.File], None]:
    def change(stored: h5py.File) -> None:
        stored[group].attrs[name] = value

    return change


def changed(name: str, column: str, values: object) -> Callable[[h5py.File], None]:
    """Return the change of a column of a table."""

    def change(stored: h5py.File) -> None:
        table = stored[name][()]
        table[column] = values
        stored[name][...] = table

    return change


def said(name: str, key: str, value: object) -> Callable[[h5py.File], None]:
    """Return the change of an entry of a text in JSON."""

    def change(stored: h5py.File) -> None:
        entries = json.loads(stored[name][()]) | {key: value}
        del stored[name]
        stored[name] = np.bytes_(json.dumps(entries).encode())

    return change


def linked(link: object) -> Callable[[h5py.File], None]:
    def change(stored: h5py.File) -> None:
        del stored["points"]
        stored["points"] = link

    return change


def virtual(stored: h5py.File) -> None:
    shape = stored["points"].shape
    del stored["points"]
    layout = h5py.VirtualLayout(shape=shape, dtype="f8")
    layout[:] = h5py.VirtualSource("other.h5", "x", shape=shape)
    stored.create_virtual_dataset("points", layout)


def test_a_damaged_list_of_contents_is_named() -> None:
    class Damaged:
        def __contains__(self, name: str) -> bool:
            raise RuntimeError("unable to offset into local heap data block")

    reader = Reader("r.h5", 1, Damaged())  # type: ignore[arg-type]
    with pytest.raises(ResultFileError, match=r"r\.h5: mesh/element_curve cannot be read"):
        reader.has("mesh/element_curve")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (attribute("/", "schema_version", 3), "has layout version 3, this bemkit .* reads version 7: use the bemkit"),
        (attribute("/", "format", "other"), "not a bemkit result"),
        (said("outcome", "status", "GREAT"), "inconsistent content .*GREAT"),
        (said("outcome", "energies", ["much"]), "inconsistent content"),
        (said("outcome", "certificate", 3.0), "inconsistent content"),
        (said("outcome", "work", {"element_pairs": "many"}), "'many' is not a whole number"),
        (attribute("steps", "n_steps", np.zeros(3)), "'n_steps' of steps is not a single text or number"),
        (attribute("steps", "n_steps", 3), "steps/0001/scene is missing"),
        (attribute("steps", "n_steps", 1), "steps/0001/outcome is missing"),
        (deleted("points"), "points is missing"),
        (deleted("steps/0001"), "steps/0001/contact is missing"),
        (deleted("plan"), "plan is missing"),
        (replaced("plan", data=np.bytes_(b"{")), "inconsistent content"),
        (replaced("plan", data=np.bytes_(b"[" * 100_000)), "inconsistent content"),
        (replaced("plan", data=np.bytes_(b'{"items": 3}')), "inconsistent content .*linear_solver: missing"),
        (deleted("outcome"), "outcome is missing"),
        (replaced("contact_nodes", data=np.zeros(11, [("x", "f8")])), "column part of contact_nodes is missing"),
        (replaced("contact_nodes", data=np.zeros(11)), "contact_nodes holds .*float64"),
        (replaced("steps/0001/contact", data=np.zeros(11, [("u_n", "f4")])), "contact holds .*f4"),
        (replaced("steps/0001/contact", data=np.zeros(11, [("u_n", "i8")])), "column .* is missing|holds int64"),
        (replaced("points", data=np.zeros((3, 2))), r"points has the shape \(3, 2\), not"),
        (replaced("points", data=np.zeros((40, 2), "i8")), "points holds .*int64"),
        (replaced("points", data=np.zeros((40, 1, 1))), "points holds 3-dimensional"),
        (changed("steps/0001/contact", "status", 9), r"status\[0\] is 9"),
        (changed("bodies", "n_points", -1), "inconsistent content|points has the shape"),
        (changed("bodies", "n_traction_dofs", 10**15), "traction_dofs has the shape"),
        (replaced("meshes/0/nodes", data=np.zeros((40, 2))), "inconsistent content"),
        (replaced("meshes/0/elements", data=np.full((40, 2), 10**12)), "inconsistent content"),
        (replaced("meshes/0/part_elements", data=np.full(3, -5)), "inconsistent content"),
        (replaced("scene", data=np.bytes_(b"title = 3")), "scene inside: title: 3 does not fit"),
        (replaced("scene", data=np.bytes_(b"\xff\xfe")), "scene is not UTF-8"),
        (replaced("plan", data=np.bytes_(b"x" * 1_000_001)), "plan is not a text of at most"),
        (replaced("scene", data="text of variable length"), "scene holds .*object"),
        # bombs: huge but compressed, huge but never stored
        (replaced("points", shape=(10**9,), dtype="f8", compression="gzip"), "points is not stored plainly"),
        (replaced("points", shape=(10**9,), dtype="f8"), "points is not stored plainly"),
        # ways out of the file
        (linked(h5py.ExternalLink("other.h5", "/x")), "points is missing"),
        (linked(h5py.SoftLink("/centres")), "points is missing"),
        (virtual, "points is not stored plainly"),
        (replaced("points", shape=(40, 2), dtype="f8", external="other.bin"), "points is not stored plainly"),
    ],
)
def test_wrong_and_hostile_files_are_refused(file: Path, change: Callable[[h5py.File], None], message: str) -> None:
    with h5py.File(file, "a") as stored:
        change(stored)
    seal(file)  # as an attacker would
    with pytest.raises(ResultFileError, match=message) as caught:
        read_result(file)
    assert str(caught.value).isprintable()


def test_what_is_no_result_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ResultFileError, match=r"none\.h5: no such file"):
        read_result(tmp_path / "none.h5")
    with pytest.raises(ResultFileError, match="not a file"):
        read_result(tmp_path)
    with pytest.raises(ResultFileError, match=r"a\?b: no such file"):
        read_result("a\0b")
    (tmp_path / "text.h5").write_text("hello", "utf-8")
    with pytest.raises(ResultFileError, match="not an HDF5 file"):
        read_result(tmp_path / "text.h5")
