"""Elements in the order in which the boundary runs."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import IntArray
from bemkit.geometry.mesh import BoundaryMesh


def along_boundary(mesh: BoundaryMesh, elements: IntArray) -> IntArray:
    """Sort elements along the boundary, each connected run from its start to its end.

    Parameters
    ----------
    mesh : BoundaryMesh
    elements : (m,) array
        Element numbers without repetition.

    Returns
    -------
    (m,) array
        Runs follow one another by the number of their first element; a whole loop starts with its smallest number.
    """
    chosen = np.zeros(mesh.n_elements, bool)
    chosen[elements] = True
    incoming, outgoing = mesh.node_elements.T
    previous, following = incoming[mesh.elements[:, 0]], outgoing[mesh.elements[:, 1]]
    is_first = previous == np.arange(mesh.n_elements)  # on a symmetry line
    starts = np.flatnonzero(chosen & (is_first | ~chosen[previous])).tolist()
    ordered: list[int] = []
    while starts or chosen.any():
        element = starts.pop(0) if starts else int(np.flatnonzero(chosen)[0])
        while chosen[element]:
            chosen[element] = False
            ordered.append(element)
            element = int(following[element])
    return np.array(ordered, dtype=np.intp)
