"""Operators kept in files: dense matrices and factorisations that are read instead of computed again.

A cache file belongs to one operator. It carries a fingerprint of everything that the numbers depend on (geometry,
material, spaces, kind of operator, version of bemkit's formulas) and a checksum of the numbers themselves. A file with
another fingerprint is stale, one with another checksum is damaged; neither is ever used. It is a file of `bemkit.hdf5`
with a mark of its own. The layout, version 1:

    /                attributes format, schema_version, bemkit, checksum, and one fingerprint for each of FINGERPRINTS
    /arrays          one dataset for each array

Maps by collocation are not kept: assembling their matrices costs no more than reading them, and what else they compute
depends on supports.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import TypeAlias

import numpy as np
from scipy.sparse import csr_array

from bemkit.arrays import FloatArray, IntArray, read_only
from bemkit.atomic_files import check_target
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, local_coefficients
from bemkit.hdf5 import Reader, ResultFileError, created, opened, write_table
from bemkit.operators.boundary import Mass, PairOperator
from bemkit.operators.linear.dense import Cholesky
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare.galerkin import GalerkinFactors
from bemkit.operators.steklov_poincare.maps import GalerkinMap
from bemkit.version import __version__

FORMAT = "bemkit-operator"
SCHEMA_VERSION = 1
FORMULA_VERSION = 3
"""To be raised whenever a change of the code changes what an operator's matrix holds beyond round-off."""
FINGERPRINTS = ("operator", "geometry", "material", "spaces", "formulas")
MARKER = b"bemkit operator cache\n"
_CURVE_SAMPLES = 17

CachedOperator: TypeAlias = PairOperator | Mass | GalerkinMap

_logger = logging.getLogger(__name__)


class CacheError(InputError):
    """A cache file that cannot be used; one line with its name and the remedy."""


class MissingCacheError(CacheError):
    """There is no cache file of that name."""


class StaleCacheError(CacheError):
    """The cache file belongs to another operator; the message says what differs."""


class DamagedCacheError(CacheError):
    """The cache file is incomplete, its content has changed since it was written, or it is no cache file at all."""


def save(path: str | Path, operator: CachedOperator) -> None:
    """Write an operator to a cache file, computing it first if that has not been done.

    Parameters
    ----------
    path : str or Path
        An older cache file of that name is replaced at once or not at all.
    operator : CachedOperator

    Raises
    ------
    OutputFileError
        If the file cannot be written, or a file that is not an operator cache stands in the way.
    """
    target = check_target(Path(path), "bemkit operator cache", _is_own)
    arrays = _computed(operator)
    with created(target, MARKER, sum(array.nbytes for array in arrays.values())) as file:
        marks = {"format": FORMAT, "schema_version": SCHEMA_VERSION, "bemkit": __version__}
        file.attrs.update({**marks, **fingerprints(operator)})
        write_table(file.create_group("arrays"), arrays)


def load(path: str | Path, operator: CachedOperator) -> None:
    """Give an operator the numbers that a cache file holds for it, so that it need not be computed.

    Parameters
    ----------
    path : str or Path
        A file written by `save`.
    operator : CachedOperator
        Made from the same mesh, material and spaces as the one that was saved. It is untouched if this raises.

    Raises
    ------
    MissingCacheError
        If there is no such file.
    StaleCacheError
        If the file belongs to another operator, or to another version of bemkit's formulas.
    DamagedCacheError
        If the file is not a complete cache file, or its numbers are not those that were written.
    """
    path = Path(path)
    if not path.is_file():
        raise MissingCacheError(f"{path}: no such file: write it with save, or call load_or_build")
    if not _is_own(path):
        raise DamagedCacheError(f"{path}: not a bemkit operator cache: give a file written by save")
    try:
        with opened(path, mark=MARKER) as reader:
            marks = reader.attributes("/")
            _require_current(path, marks, fingerprints(operator))
            arrays = {name: _array(reader, name, shape) for name, shape in _shapes(operator).items()}
    except ResultFileError as error:
        raise DamagedCacheError(f"{path}: the cache file is damaged: delete it, or call load_or_build") from error
    _restore(operator, arrays)


def load_or_build(path: str | Path, operator: CachedOperator) -> bool:
    """Read an operator from its cache file, or compute it and write the file if that cannot be used.

    Parameters
    ----------
    path : str or Path
    operator : CachedOperator

    Returns
    -------
    bool
        Whether the file was used. Otherwise the reason is logged: as information if there was no file, as a warning
        if it was stale or damaged and has been replaced.

    Raises
    ------
    OutputFileError
        If the file cannot be written, or a file that is not an operator cache stands in the way.
    """
    check_target(Path(path), "bemkit operator cache", _is_own)
    try:
        load(path, operator)
    except MissingCacheError:
        _logger.info("%s: no cache file yet, the operator is computed", path)
    except CacheError as error:
        _logger.warning("%s; the operator is computed again and the file replaced", error)
    else:
        _logger.info("%s: operator read from its cache file", path)
        return True
    save(path, operator)
    return False


def fingerprints(operator: CachedOperator) -> dict[str, str]:
    """Return the SHA-256 fingerprints of what an operator's numbers depend on, under the names of `FINGERPRINTS`.

    Notes
    -----
    A curved element is described by points and derivatives at 17 places, which tells apart curves of any class, a
    space by its numbering and the coefficients of its basis, which does so for spaces of any class.
    """
    material: Material | None = None if isinstance(operator, Mass) else operator.material
    if isinstance(operator, GalerkinMap):
        mesh, spaces = operator.mesh, (operator.displacement_space, operator.traction_space)
    else:
        mesh, spaces = operator.trial.mesh, (operator.trial, operator.test)
    described = "" if material is None else repr((material.youngs_modulus, material.poisson_ratio, material.plane.name))
    values = (
        _digest(type(operator).__name__),
        _digest(*_geometry(mesh)),
        _digest(described),
        _digest(*(item for space in spaces for item in _space(space))),
        _digest(str(FORMULA_VERSION)),
    )
    return dict(zip(FINGERPRINTS, values, strict=True))


def _geometry(mesh: BoundaryMesh) -> list[str | FloatArray | IntArray]:
    curved = np.flatnonzero(~mesh.is_straight)
    xi = np.linspace(-1.0, 1.0, _CURVE_SAMPLES)
    shape = [mesh.points(curved, xi), mesh.derivatives(curved, xi)] if curved.size else []
    return [mesh.nodes, mesh.elements, curved, *shape, str(mesh.is_exterior)]


def _space(space: BoundarySpace) -> list[str | FloatArray | IntArray]:
    counts = f"{space.degree} {space.n_dofs} {space.is_continuous}"
    return [counts, space.element_dofs, local_coefficients(space)]


def _digest(*items: str | FloatArray | IntArray) -> str:
    digest = hashlib.sha256()
    for item in items:
        if isinstance(item, str):
            digest.update(f"text {len(item)} {item}".encode())
        else:
            plain = np.ascontiguousarray(item, dtype="<f8" if item.dtype.kind == "f" else "<i8")
            digest.update(f"array {plain.dtype.str} {plain.shape} ".encode())
            digest.update(plain.data)
    return digest.hexdigest()


def _is_own(path: Path) -> bool:
    """Tell a cache file, even a damaged one, from other files."""
    with path.open("rb") as raw:
        return raw.read(len(MARKER)) == MARKER


def _require_current(path: Path, marks: Mapping[str, object], expected: Mapping[str, str]) -> None:
    if marks.get("format") != FORMAT or marks.get("schema_version") != SCHEMA_VERSION:
        raise StaleCacheError(
            f"{path}: has layout version {marks.get('schema_version')}, this bemkit reads version {SCHEMA_VERSION}: "
            "delete it, or call load_or_build"
        )
    differing = [name for name in FINGERPRINTS if marks.get(name) != expected[name]]
    if differing:
        raise StaleCacheError(
            f"{path}: belongs to another operator (different {', '.join(differing)}): use another file name, "
            "or call load_or_build"
        )


def _array(reader: Reader, name: str, shape: tuple[int, int]) -> FloatArray:
    array = reader.floats(f"arrays/{name}")
    if array.shape != shape:
        raise reader.error(f"{name} has the shape {array.shape}")
    return array


def _shapes(operator: CachedOperator) -> dict[str, tuple[int, int]]:
    if isinstance(operator, GalerkinMap):
        u, t = operator.displacement_space.n_dofs, operator.traction_space.n_dofs
        return {"matrix": (u, u), "single_layer_lower": (t, t), "strained": (t, u)}
    return {"matrix": (operator.test.n_dofs, operator.trial.n_dofs)}


def _computed(operator: CachedOperator) -> dict[str, FloatArray]:
    if isinstance(operator, GalerkinMap):
        factors = operator.factors
        lower = factors.single_layer.lower
        return {"matrix": factors.matrix, "single_layer_lower": lower, "strained": factors.whitened_trace}
    matrix = operator.matrix()
    return {"matrix": matrix.toarray() if isinstance(operator, Mass) else matrix}


def _restore(operator: CachedOperator, arrays: Mapping[str, FloatArray]) -> None:
    matrix = arrays["matrix"]
    if isinstance(operator, GalerkinMap):
        read_only(matrix)
        factor = Cholesky.from_lower(arrays["single_layer_lower"])
        operator.keep(GalerkinFactors(matrix, factor, arrays["strained"]))
    else:
        operator.keep(csr_array(matrix) if isinstance(operator, Mass) else matrix)
