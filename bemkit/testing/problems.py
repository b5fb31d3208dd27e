"""Small contact problems with known answers, without boundary elements."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from bemkit.arrays import FloatArray
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.laws import Coulomb, FrictionLaw, Frictionless, Tresca
from bemkit.contact.problem import ContactProblem


@dataclass(frozen=True, eq=False)
class KnownProblem:
    """A contact problem and all its solutions.

    Parameters
    ----------
    problem : ContactProblem
    solutions : tuple of (n_contact, 2, 2) arrays
        Of each solution the displacements [m] and the tractions [Pa]: axes (node, which of the two, component).
        Empty if there is none.
    """

    problem: ContactProblem
    solutions: tuple[FloatArray, ...]


def _known(
    stiffness: npt.ArrayLike,
    load: Sequence[float],
    law: FrictionLaw,
    *solutions: npt.ArrayLike,
    gap: float = 0.0,
    slip_origin: float = 0.0,
    weight: float = 1.0,
    motions: npt.ArrayLike = (),
) -> Callable[[], KnownProblem]:
    """Return a function that makes a problem; gap, origin of slip and weight are the same at all nodes."""

    def make() -> KnownProblem:
        n_contact = len(load) // 2
        modes = np.array(motions, dtype=float).reshape(-1, n_contact, 2)
        body = DenseBody(np.array(stiffness, dtype=float), np.array(load), np.full(n_contact, weight), modes)
        problem = ContactProblem(body, np.full(n_contact, gap), law, np.full(n_contact, slip_origin))
        return KnownProblem(problem, tuple(np.array(solution, dtype=float) for solution in solutions))

    return make


_SPRING = ((1.0, 0.0, -1.0, 0.0), (0.0, 1.0, 0.0, 0.0), (-1.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
"""Two nodes that a spring holds against each other, and the ground against tangential motion."""

KNOWN_PROBLEMS: Mapping[str, Callable[[], KnownProblem]] = MappingProxyType(
    {
        # one node with coupled stiffness, which may stick, slip or open
        "three solutions": _known(
            ((1.0, 0.5), (0.5, 1.0)),
            (1.0, 2.5),
            Coulomb(3.0),
            [[(0.0, 0.0), (-1.0, -2.5)]],
            [[(0.0, 1.0), (-0.5, -1.5)]],
            [[(-1.0 / 3.0, 8.0 / 3.0), (0.0, 0.0)]],
        ),
        # three nodes without load or gap, which stay where they are
        "nothing to do": _known(np.eye(6) + 0.1, (0.0,) * 6, Coulomb(0.5), np.zeros((3, 2, 2))),
        # one node that is pressed back from an obstacle inside the body, without any load
        "overlap": _known(np.eye(2), (0.0, 0.0), Coulomb(0.5), [[(-0.3, 0.0), (-0.3, 0.0)]], gap=-0.3),
        # one node that is pulled away and pushed sideways, and carries nothing
        "out of reach": _known(np.eye(2), (-1.0, 0.4), Coulomb(0.5), [[(-1.0, 0.4), (0.0, 0.0)]]),
        # one node that is pulled by exactly as much as friction can hold
        "tie": _known(np.eye(2), (2.0, 1.0), Coulomb(0.5), [[(0.0, 0.0), (-2.0, -1.0)]]),
        # one node that slips against the tangent
        "slide backward": _known(np.eye(2), (2.0, -3.0), Coulomb(0.5), [[(0.0, -2.0), (-2.0, 1.0)]]),
        # the same node with its slip counted from -2.5: it stays there, pushed back, below the bound
        "incremental": _known(np.eye(2), (2.0, -3.0), Coulomb(0.5), [[(0.0, -2.5), (-2.0, 0.5)]], slip_origin=-2.5),
        # two nodes without friction, one pressed and one lifted
        "smooth floor": _known(
            np.diag((2.0, 1.0, 2.0, 1.0)),
            (3.0, 0.2, -1.0, 0.1),
            Frictionless(),
            [[(0.0, 0.2), (-6.0, 0.0)], [(-0.5, 0.1), (0.0, 0.0)]],
            weight=0.5,
        ),
        # Tresca's law, which acts on an open node too
        "given friction": _known(
            np.eye(4),
            (-1.0, 0.2, -1.0, 2.0),
            Tresca(0.5),
            [[(-1.0, 0.0), (0.0, -0.2)], [(-1.0, 1.5), (0.0, -0.5)]],
        ),
        # two nodes of a body that only contact holds against vertical motion
        "floating": _known(
            _SPRING,
            (1.0, 0.1, 2.0, 0.1),
            Coulomb(0.3),
            [[(0.0, 0.0), (-1.0, -0.1)], [(0.0, 0.0), (-2.0, -0.1)]],
            motions=((1.0, 0.0), (1.0, 0.0)),
        ),
        # the same body pulled off: there is no solution, and a solver must not find one
        "lifted": _known(_SPRING, (-1.0, -0.1, -2.0, -0.1), Coulomb(0.3), motions=((1.0, 0.0), (1.0, 0.0))),
    }
)
"""By name; each call makes a new problem."""
