"""Bisection of the elements of a boundary mesh."""

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.geometry.pieces import Elements


def bisected(old: Elements, is_halved: BoolArray, middles: FloatArray) -> Elements:
    """Bisect elements; both halves take the place of the element in its parts and in the order of elements.

    Parameters
    ----------
    old : Elements
    is_halved : (n_elements,) bool array
    middles : (n_elements, 2) array [m]
        Points that become nodes where elements are halved.

    Returns
    -------
    Elements
        The middle of an element is numbered next to its start node.
    """
    n_elements, n_nodes = len(old.elements), len(old.nodes)
    halved = np.flatnonzero(is_halved)
    first = np.arange(n_elements) + np.cumsum(is_halved) - is_halved  # new number of the (first half of the) element
    source = np.repeat(np.arange(n_elements), 1 + is_halved)
    starts_halved = np.zeros(n_nodes, dtype=bool)
    starts_halved[old.elements[halved, 0]] = True
    new_node = np.arange(n_nodes) + np.cumsum(starts_halved) - starts_halved
    middle = new_node[old.elements[halved, 0]] + 1
    nodes = np.empty((n_nodes + len(halved), 2))
    nodes[new_node] = old.nodes
    nodes[middle] = middles[halved]
    elements = new_node[old.elements][source]
    elements[first[halved], 1] = middle
    elements[first[halved] + 1, 0] = middle
    parts = {name: np.flatnonzero(np.isin(source, members)) for name, members in old.parts.items()}
    if old.element_curve is None or old.element_span is None:
        return Elements(nodes, elements, parts, old.curves, None, None)
    span = old.element_span[source]
    span[first[halved], 1] = span[first[halved] + 1, 0] = old.element_span[halved].mean(axis=1)
    return Elements(nodes, elements, parts, old.curves, old.element_curve[source], span)
