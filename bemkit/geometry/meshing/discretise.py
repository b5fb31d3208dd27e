"""From an outline to a mesh: the user's parts, the user's number of elements."""

from collections.abc import Mapping

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.grading import Grading, Uniform
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.division import Division, divide
from bemkit.geometry.meshing.transition import gradual_positions
from bemkit.geometry.outline import Outline, Selection
from bemkit.geometry.symmetry import Symmetry


def discretise(
    outline: Outline,
    *,
    n_elements: int,
    parts: Mapping[str, Selection] | None = None,
    grading: Grading | None = None,
    density: Mapping[str, float] | None = None,
    symmetry: Symmetry | None = None,
) -> BoundaryMesh:
    """Cut an outline into elements.

    Parameters
    ----------
    outline : Outline
        The boundary.
    n_elements : int
        Number of elements of the mesh, shared among sides (and the pieces that the parts cut from them) in proportion
        to their lengths, at least one each.
    parts : mapping of str to Selection, optional
        Boundary parts by name; they must not overlap, and need not cover the boundary.
    grading : Grading, optional
        Spacing of the elements on every piece. Uniform if left out, but for lengths that grow gradually next to a piece
        with elements of less than half the length.
    density : mapping of str to float, optional
        How densely sides are divided compared with the others, by the name of the side, or else of
        its group; 1 where left out.
    symmetry : Symmetry, optional
        Lines of which only the side x <= a, y <= b is divided, into a half or a quarter of `n_elements`.

    Returns
    -------
    BoundaryMesh
        Elements run along each loop in order, node i starts element i; parts end exactly at nodes.

    Raises
    ------
    GeometryError
        If a part is empty, overlaps another or names an unknown side, or there are fewer elements than pieces, or a
        density is not positive or names an unknown side, or one beyond the symmetry lines; or if these do not cross
        the body.
    """
    density = {} if density is None else density
    _check_density(density, outline)
    parts = {} if parts is None else parts
    grading = Uniform() if grading is None else grading
    division = divide(outline, parts)
    if symmetry is not None:
        division = division.half(symmetry)
        n_elements = _share_of_half(n_elements, division, symmetry)
        _check_sides_divided(density, division)
    lengths = division.piece_lengths
    sides = [outline.sides[piece.side] for piece in division.pieces]
    densities = [density.get(side.name, density.get(side.group, 1.0)) for side in sides]
    counts = share_elements(n_elements, lengths * densities)
    if isinstance(grading, Uniform):
        positions = _gradual(division, counts, lengths)
    else:
        positions = [_checked_positions(grading, int(count)) for count in counts]
    return division.mesh([piece.at(p) for piece, p in zip(division.pieces, positions, strict=True)])


def share_elements(n_elements: int, lengths: FloatArray) -> IntArray:
    """Share elements among pieces in proportion to their lengths, by largest remainders, at least one each.

    Raises
    ------
    GeometryError
        If there are fewer elements than pieces.
    """
    if not isinstance(n_elements, int | np.integer) or n_elements < len(lengths):
        raise GeometryError(
            f"discretise: n_elements is {n_elements}, but the outline has {len(lengths)} pieces (sides, cut "
            f"where parts end): give a whole number of at least {len(lengths)}"
        )
    quota: FloatArray = n_elements * lengths / lengths.sum()
    # pieces too short for a whole element get one, and leave the others to share the rest
    is_short = np.zeros(len(lengths), dtype=bool)
    while (quota[~is_short] < 1.0).any():
        is_short |= quota < 1.0
        rest = lengths[~is_short]
        quota[~is_short] = (n_elements - np.count_nonzero(is_short)) * rest / rest.sum()
    quota[is_short] = 1.0
    # halves that differ by round-off, which is large far from the origin, are ties: the order of pieces settles them
    quota = np.round(quota, 6)
    counts: IntArray = np.floor(quota).astype(np.intp)
    by_remainder = np.argsort(counts - quota, kind="stable")
    counts[by_remainder[: n_elements - int(counts.sum())]] += 1
    return counts


def _gradual(division: Division, counts: IntArray, lengths: FloatArray) -> list[FloatArray]:
    """Return positions on each piece that lead gradually to the elements of denser neighbours."""
    sizes = lengths / counts
    following = division.following
    after = np.where(following >= 0, sizes[following], np.inf)  # none on a symmetry line
    before = np.full(counts.size, np.inf)
    before[following[following >= 0]] = sizes[following >= 0]
    ends = zip(counts.tolist(), (before / lengths).tolist(), (after / lengths).tolist(), strict=True)
    return [gradual_positions(*each) for each in ends]


def _checked_positions(grading: Grading, n: int) -> FloatArray:
    """Return the positions of a grading, which may be the user's own, or say what is wrong with them."""
    positions = np.asarray(grading.positions(n), dtype=float)
    is_right = positions.shape == (n + 1,) and positions[0] == 0.0 and positions[-1] == 1.0
    if not (is_right and (np.diff(positions) > 0.0).all()):
        raise GeometryError(
            f"discretise: {grading} does not place {n} elements on a piece: its positions({n}) must increase strictly "
            f"from 0 to 1 and have shape ({n + 1},); grade less, or use fewer elements"
        )
    return positions


def _check_density(density: Mapping[str, float], outline: Outline) -> None:
    for side, value in density.items():
        if side not in outline.selectable_names:
            raise GeometryError(
                f"discretise: density names the side {side!r}: the sides are {', '.join(outline.selectable_names)}"
            )
        if not 0.0 < value < np.inf:
            raise GeometryError(f"discretise: the density of side {side!r} is {value}: give a positive, finite number")


def _share_of_half(n_elements: int, half: Division, symmetry: Symmetry) -> int:
    share, n_pieces = -(-n_elements // symmetry.n_images), len(half.pieces)
    if share < n_pieces:
        raise GeometryError(
            f"discretise: n_elements is {n_elements}, of which the symmetry leaves {share} for {n_pieces} pieces "
            f"(sides cut where parts end): give at least {n_pieces * symmetry.n_images}"
        )
    return share


def _check_sides_divided(density: Mapping[str, float], half: Division) -> None:
    sides = [half.outline.sides[piece.side] for piece in half.pieces]
    divided = {name for side in sides for name in (side.name, side.group) if name}
    for side in density:
        if side not in divided:
            raise GeometryError(
                f"discretise: density names the side {side!r}, which lies beyond the symmetry lines ({half.symmetry}) "
                f"and mirrors what is divided: name its image among the sides {', '.join(sorted(divided))}"
            )
