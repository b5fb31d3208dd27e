"""Assembly of bilinear forms: one sweep over the element pairs serves all matrices that are wanted."""

from __future__ import annotations

import bisect
import itertools
from collections.abc import Sequence
from dataclasses import replace
from threading import Lock

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.local_values import of_one_degree
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.integrals.pairs import Degrees
from bemkit.operators.integrals.sweep import FEW, PairSweep
from bemkit.operators.linear.threads import for_each_chunk
from bemkit.operators.matrix_rows import Block, Columns, Kind, Rows, Target
from bemkit.operators.pair_form import PairForm
from bemkit.operators.stopwatch import assembling


@assembling()
def assemble_together(forms: Sequence[PairForm]) -> tuple[list[FloatArray], int]:
    """Sweep over all element pairs once for all forms.

    Returns
    -------
    matrices : list of (test.n_dofs, trial.n_dofs) arrays
    n_pairs : int
        Element pairs whose integrals were evaluated.

    Raises
    ------
    GeometryError
        If the forms live on different meshes.
    """
    mesh = forms[0].test.mesh
    if any(form.test.mesh is not mesh for form in forms):
        msg = "the operators live on different meshes: assemble those of one mesh at a time"
        raise GeometryError(msg)
    everything = np.arange(mesh.n_elements)
    matrices = [Target.zeros(form, everything, everything) for form in forms]
    n_pairs = _fill(matrices, everything, everything)
    return [matrix.dofs_matrix() for matrix in matrices], n_pairs


@assembling()
def assemble_block(form: PairForm, rows: IntArray, columns: IntArray) -> FloatArray:
    """Return some rows and columns (vector dofs) of the matrix of a form, from the elements that they belong to."""
    block = np.zeros((rows.size, columns.size))
    if not block.size:
        return block
    elements = [
        np.flatnonzero(np.isin(space.element_dofs, dofs // 2).any(axis=1))
        for space, dofs in ((form.test, rows), (form.trial, columns))
    ]
    target = Target.zeros(form, *elements)
    _fill([target], *elements)
    places = [
        np.searchsorted(nodes, dofs // 2) * 2 + dofs % 2
        for nodes, dofs in zip((target.test_nodes, target.trial_nodes), (rows, columns), strict=True)
    ]
    return np.asarray(target.dofs_matrix()[np.ix_(*places)])


def _fill(targets: Sequence[Target], test_elements: IntArray, trial_elements: IntArray) -> int:
    """Add the pairs of some elements, of any degrees; return how many there are.

    Each two degrees have a sweep of their own, but few straight elements, whose pairs share more if they are in one.
    """
    mesh, forms = targets[0].form.test.mesh, [target.form for target in targets]
    spaces = [space for form in forms for space in (form.test, form.trial)]
    tests, trials = (list(of_one_degree(spaces, elements)) for elements in (test_elements, trial_elements))
    n_trial = trial_elements.size * (mesh.whole.n_elements // mesh.n_elements)
    if n_trial <= FEW and mesh.is_straight.all():
        return _fill_kinds(targets, tests, trials)
    return sum(_fill_kinds(targets, [test], [trial]) for test, trial in itertools.product(tests, trials))


def _fill_kinds(targets: Sequence[Target], tests: Sequence[Kind], trials: Sequence[Kind]) -> int:
    """Sweep over the pairs of elements of some degrees; return their number."""
    mesh = targets[0].form.test.mesh
    columns = [Columns(target, trials, 2 * k + 1) for k, target in enumerate(targets)]
    blocks = [
        [Rows(target, elements, seen[2 * k], columns[k]) for k, target in enumerate(targets)]
        for elements, seen in tests
    ]
    degrees = Degrees()
    for target, k in zip(targets, range(0, 2 * len(targets), 2), strict=True):
        degrees |= replace(target.form, test=_highest(tests, k), trial=_highest(trials, k + 1)).degrees
    images = range(0, mesh.whole.n_elements, mesh.n_elements)
    test = np.concatenate([elements for elements, _ in tests])
    trial = np.concatenate([image + elements for elements, _ in trials for image in images])
    sweep = PairSweep(mesh.whole, degrees, test, trial)
    edges: list[int] = np.cumsum([0, *(elements.size for elements, _ in tests)]).tolist()
    half = 0.5 * mesh.whole.lengths
    lock = Lock()

    def fill(rows: slice) -> int:
        pairs = Block(sweep.chunk(rows), half[test[rows]], half[trial])
        kind = bisect.bisect_right(edges, rows.start) - 1
        for block in blocks[kind]:
            gathered = block.gathered(pairs)
            with lock:  # two chunks share the rows of the node between them
                block.add(slice(rows.start - edges[kind], rows.stop - edges[kind]), gathered)
        return pairs.test_half.size * trial.size

    n_integrals = test.size * trial.size * degrees.n_products
    return sum(for_each_chunk(fill, sweep.row_slices(edges), n_integrals=n_integrals))


def _highest(kinds: Sequence[Kind], space: int) -> BoundarySpace:
    """Return one of their spaces as the elements of the highest degree see it."""
    return max((seen[space] for _, seen in kinds), key=lambda each: each.degree)
