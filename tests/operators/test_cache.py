"""Operators kept in files: used when they fit, refused when stale or damaged, never half written."""

from __future__ import annotations

import dataclasses
import logging
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from bemkit.atomic_files import OutputFileError
from bemkit.geometry import BoundaryMesh, Disk, Rectangle, discretise
from bemkit.geometry.neighbours import corner_nodes
from bemkit.geometry.spaces import ConstantSpace, LinearSpace, QuadraticSpace
from bemkit.hdf5 import seal
from bemkit.operators import cache
from bemkit.operators.boundary import Mass, double_layer, hypersingular, mass, single_layer
from bemkit.operators.cache import CachedOperator, DamagedCacheError, MissingCacheError, StaleCacheError
from bemkit.operators.material import Material, Plane
from bemkit.operators.steklov_poincare.maps import GalerkinMap

MATERIAL = Material(2.0, 0.3)


def mesh(n: int = 16, width: float = 1.0) -> BoundaryMesh:
    return discretise(Rectangle(width, 1.0).outline(), n_elements=n)


def galerkin(the_mesh: BoundaryMesh | None = None, material: Material = MATERIAL) -> GalerkinMap:
    return GalerkinMap(mesh() if the_mesh is None else the_mesh, material)


OPERATORS: dict[str, Callable[[], CachedOperator]] = {
    "single layer": lambda: (lambda t: single_layer(t, t, MATERIAL))(ConstantSpace(mesh())),
    "double layer": lambda: (lambda m: double_layer(LinearSpace(m), ConstantSpace(m), MATERIAL))(mesh()),
    "hypersingular": lambda: (lambda u: hypersingular(u, u, MATERIAL))(LinearSpace(mesh())),
    "mass": lambda: (lambda m: mass(LinearSpace(m), ConstantSpace(m)))(mesh()),
    "map": galerkin,
}


@pytest.mark.parametrize("make", OPERATORS.values(), ids=OPERATORS)
def test_what_is_read_is_what_was_written(make: Callable[[], CachedOperator], tmp_path: Path) -> None:
    written, fresh = make(), make()
    cache.save(tmp_path / "operator.h5", written)
    cache.load(tmp_path / "operator.h5", fresh)
    one, other = fresh.matrix(), written.matrix()
    if isinstance(fresh, Mass):
        np.testing.assert_array_equal(one.toarray(), other.toarray())
        one = one.data
    else:
        np.testing.assert_array_equal(one, other)
    assert not one.flags.writeable


def test_a_map_from_a_file_computes_nothing_and_gives_the_same_tractions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written, fresh = galerkin(), galerkin()
    u = np.random.default_rng(1).normal(size=(16, 2))
    expected = written.tractions(u)
    cache.save(tmp_path / "map.h5", written)
    monkeypatch.setattr(
        "bemkit.operators.steklov_poincare.layer_operators.assemble_together", lambda *_: pytest.fail("assembled again")
    )
    cache.load(tmp_path / "map.h5", fresh)
    # the same numbers, multiplied in another order
    np.testing.assert_allclose(fresh.tractions(u), expected, rtol=1e-11)


def with_broken_nodes() -> GalerkinMap:
    m = mesh()
    return GalerkinMap(m, MATERIAL, LinearSpace(m), LinearSpace(m, corner_nodes(m)))


def quadratic() -> GalerkinMap:
    m = mesh()
    return GalerkinMap(m, MATERIAL, QuadraticSpace(m), LinearSpace(m, corner_nodes(m)))


@pytest.mark.parametrize(
    ("other", "difference"),
    [
        (lambda: galerkin(mesh(width=1.0 + 1e-15)), "geometry"),
        (lambda: galerkin(mesh(20)), "geometry, spaces"),
        (lambda: galerkin(material=dataclasses.replace(MATERIAL, poisson_ratio=0.31)), "material"),
        (lambda: galerkin(material=dataclasses.replace(MATERIAL, plane=Plane.STRESS)), "material"),
        (with_broken_nodes, "spaces"),
        (quadratic, "spaces"),
        (OPERATORS["hypersingular"], "operator, spaces"),
    ],
)
def test_a_stale_file_is_refused_and_left_alone(
    other: Callable[[], CachedOperator], difference: str, tmp_path: Path
) -> None:
    path = tmp_path / "map.h5"
    cache.save(path, galerkin())
    before = path.read_bytes()
    with pytest.raises(StaleCacheError, match=rf"map.h5: belongs to another operator \(different {difference}\)"):
        cache.load(path, other())
    assert path.read_bytes() == before


def test_a_file_of_other_formulas_or_layout_is_stale(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "map.h5"
    cache.save(path, galerkin())
    with monkeypatch.context() as patch:
        patch.setattr(cache, "FORMULA_VERSION", cache.FORMULA_VERSION + 1)
        with pytest.raises(StaleCacheError, match="different formulas"):
            cache.load(path, galerkin())
    with h5py.File(str(path), "r+") as file:
        file.attrs["schema_version"] = 99
    seal(path, cache.MARKER)
    with pytest.raises(StaleCacheError, match="has layout version 99, this bemkit reads version 1"):
        cache.load(path, galerkin())


def test_curves_are_part_of_the_geometry() -> None:
    arcs = discretise(Disk(1.0).outline(), n_elements=8)
    chords = BoundaryMesh(arcs.nodes, arcs.elements)
    spaces = [ConstantSpace(m) for m in (arcs, chords)]
    curved, straight = (cache.fingerprints(mass(space, space)) for space in spaces)
    assert curved["geometry"] != straight["geometry"]
    assert curved["spaces"] == straight["spaces"]


def test_a_truncated_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.h5"
    cache.save(path, galerkin())
    content = path.read_bytes()
    for length in (600, len(content) // 2, len(content) - 1):
        path.write_bytes(content[:length])
        with pytest.raises(DamagedCacheError, match="damaged"):
            cache.load(path, galerkin())


def test_flipped_bits_never_pass(tmp_path: Path) -> None:
    path = tmp_path / "map.h5"
    operator = galerkin()
    cache.save(path, operator)
    content = bytearray(path.read_bytes())
    refused = 0
    positions = np.random.default_rng(2).integers(0, len(content), 50).tolist() + list(range(512, 1500, 62))
    for position in positions:
        damaged = content.copy()
        damaged[position] ^= 0x10
        path.write_bytes(damaged)
        fresh = galerkin()
        try:
            cache.load(path, fresh)
        except (DamagedCacheError, StaleCacheError):
            refused += 1
        else:  # a byte of padding: the numbers are right
            np.testing.assert_array_equal(fresh.matrix(), operator.matrix())
    assert refused > 33  # most of the file is numbers


def test_an_array_of_another_shape_or_none_is_damage(tmp_path: Path) -> None:
    path = tmp_path / "map.h5"
    for damage in ("shape", "missing"):
        cache.save(path, galerkin())
        with h5py.File(str(path), "r+") as file:
            del file["arrays/strained"]
            if damage == "shape":
                file["arrays/strained"] = np.zeros((3, 3))
        seal(path, cache.MARKER)
        with pytest.raises(DamagedCacheError, match="the cache file is damaged"):
            cache.load(path, galerkin())


def test_missing_and_foreign_files(tmp_path: Path) -> None:
    with pytest.raises(MissingCacheError, match="no such file: write it with save"):
        cache.load(tmp_path / "none.h5", galerkin())
    foreign = tmp_path / "thesis.txt"
    foreign.write_text("chapter 1")
    with pytest.raises(DamagedCacheError, match="not a bemkit operator cache"):
        cache.load(foreign, galerkin())
    for write in (cache.save, cache.load_or_build):
        with pytest.raises(OutputFileError, match="exists and is not a bemkit operator cache"):
            write(foreign, galerkin())
    assert foreign.read_text() == "chapter 1"


def test_load_or_build_uses_rebuilds_and_says_so(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = tmp_path / "map.h5"
    caplog.set_level(logging.INFO, "bemkit")
    assert not cache.load_or_build(path, galerkin())
    assert "no cache file yet" in caplog.text
    assert cache.load_or_build(path, galerkin())
    assert caplog.records[-1].getMessage().endswith("operator read from its cache file")

    assert not cache.load_or_build(path, galerkin(mesh(20)))  # stale
    assert caplog.records[-1].levelno == logging.WARNING
    assert "different geometry, spaces" in caplog.records[-1].getMessage()
    assert cache.load_or_build(path, galerkin(mesh(20)))

    path.write_bytes(path.read_bytes()[:-100])  # damaged
    assert not cache.load_or_build(path, galerkin(mesh(20)))
    assert "damaged" in caplog.records[-1].getMessage()
    assert cache.load_or_build(path, galerkin(mesh(20)))


def test_a_disk_without_room_is_named_before_anything_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "map.h5"
    cache.save(path, galerkin())
    before = path.read_bytes()
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr("bemkit.atomic_files.shutil.disk_usage", lambda _: usage._replace(free=70_000))
    # three matrices of order 40 take 38 kB besides the file's own overhead
    with pytest.raises(OutputFileError, match=r"0\.0001\d* GB are needed and 7e-05 GB free"):
        cache.save(path, galerkin(mesh(20)))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "map.h5"
    cache.save(path, galerkin())
    before = path.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("bemkit.operators.cache.write_table", full)
    with pytest.raises(OutputFileError, match="No space left"):
        cache.save(path, galerkin(mesh(20)))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
