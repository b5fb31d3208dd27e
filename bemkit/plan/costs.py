"""What a plan costs: time by three rates of the computer, memory by what is alive at the same time.

Flops and bytes follow from the sizes. The numbers of evaluations and calls, and the sizes of buffers, are rough: they
were fitted once to runs of the shipped scenes with 50 to 800 elements. `tests/benchmarks/plan.py` prints how well they
hold.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from bemkit.operators.integrals.sweep import CHUNK_PAIRS
from bemkit.plan.decisions import Decisions, Formulation
from bemkit.plan.machine import Machine
from bemkit.plan.sizes import Sizes

_BYTES = 8
CONTACT_STEPS = 8
"""Steps of Newton's method for a contact problem; they hardly depend on its size."""
FLOPS_PER_NUMBER = 30.0
"""A number that is only moved through memory takes as long as so many flops of a factorisation."""


class Stage(enum.Enum):
    """The parts of a run, by their names in `Solution.timings`; writing outputs comes after it."""

    MESH = "mesh"
    ASSEMBLE = "assemble"
    CONDENSE = "condense"
    SOLVE = "solve"
    RECOVER = "recover"
    OUTPUTS = "outputs"


@dataclass(frozen=True)
class Cost:
    """What something takes on any computer.

    Parameters
    ----------
    evaluations : float
        Of the closed-form integrals, at one point for one element.
    flops : float
        Multiplications and additions of dense linear algebra.
    calls : float
        Operations on small arrays.
    size : int [bytes]
        Memory that it keeps.
    """

    evaluations: float = 0.0
    flops: float = 0.0
    calls: float = 0.0
    size: int = 0

    def seconds(self, machine: Machine) -> float:
        """Return the time on a computer [s]."""
        return (
            self.evaluations * machine.seconds_per_evaluation
            + self.flops * machine.seconds_per_flop
            + self.calls * machine.seconds_per_call
        )


@dataclass(frozen=True)
class _PairCost:
    """Evaluations for each element pair, and for the close pairs of each element."""

    straight: tuple[float, float]
    curved: tuple[float, float]

    def of(self, n_test: int, n_sources: int, share_curved: float) -> float:
        """Return the evaluations of all pairs."""
        far, near = (
            (1.0 - share_curved) * one + share_curved * other
            for one, other in zip(self.straight, self.curved, strict=True)
        )
        return n_test * (n_sources * far + near)


_PAIRS: Mapping[tuple[Formulation, int], _PairCost] = MappingProxyType(
    {
        (Formulation.COLLOCATION, 0): _PairCost((12.0, 500.0), (15.0, 9500.0)),
        (Formulation.GALERKIN, 1): _PairCost((15.0, 18000.0), (20.0, 35000.0)),
        (Formulation.GALERKIN, 2): _PairCost((40.0, 30000.0), (100.0, 55000.0)),
    }
)


@dataclass(frozen=True)
class _Buffers:
    """Bytes that assembly needs beside its matrices.

    Close pairs are corrected in batches: their number counts up to a limit. All other pairs are swept in chunks.
    """

    corrected: tuple[float, float]
    """For each element, and at most."""
    listed: float
    """For each element: the corrected integrals."""
    swept: float
    """For each pair of a chunk."""

    def size(self, sizes: Sizes) -> float:
        """Return the bytes that are alive at once."""
        n = sizes.n_sources
        chunks = self.swept * min(sizes.n_elements * n, sizes.n_threads * CHUNK_PAIRS)
        return max(min(self.corrected[0] * n, self.corrected[1]), chunks) + self.listed * n


_BUFFERS: Mapping[tuple[Formulation, int], _Buffers] = MappingProxyType(
    {
        (Formulation.COLLOCATION, 0): _Buffers((0.0, 0.0), 0.0, 195.0),
        (Formulation.GALERKIN, 1): _Buffers((38e3, 14.5e6), 4e3, 160.0),
        (Formulation.GALERKIN, 2): _Buffers((50e3, 13e6), 24e3, 160.0),
    }
)


def assembly(decisions: Decisions, sizes: Sizes) -> float:
    """Return the evaluations that all boundary operators together take."""
    pairs = _PAIRS[decisions.formulation, decisions.displacement_degree]
    evaluations = pairs.of(sizes.n_elements, sizes.n_sources, sizes.n_curved / sizes.n_elements)
    n_sweeps = max(1.0, sizes.n_collocation_pairs / (sizes.n_elements * sizes.n_sources))
    return n_sweeps * evaluations / sizes.n_threads


def peaks(decisions: Decisions, sizes: Sizes) -> dict[Stage, int]:
    """Return the largest memory of all arrays that are alive at once in each stage [bytes]."""
    assembled, condensing, kept = _stages(decisions, sizes)
    buffers = _BUFFERS[decisions.formulation, decisions.displacement_degree]
    open_directions, c = sizes.n_open, sizes.n_contact_unknowns
    rows = 2 * sizes.n_contact * c  # the contact system before tangents without friction are taken out
    kept += open_directions**2 + open_directions * c + rows
    numbers = {
        Stage.MESH: 100.0 * sizes.n_sources,
        Stage.ASSEMBLE: assembled + buffers.size(sizes) / _BYTES,
        Stage.CONDENSE: max(condensing, kept),
        Stage.SOLVE: kept + 3.2 * rows,
        Stage.RECOVER: kept + rows,
    }
    return {stage: int(_BYTES * number) for stage, number in numbers.items()}


def _stages(decisions: Decisions, sizes: Sizes) -> tuple[float, float, float]:
    if decisions.formulation is Formulation.COLLOCATION:
        return _collocation(sizes)
    return (_galerkin if decisions.forms_matrix else _iterated)(sizes)


def _iterated(sizes: Sizes) -> tuple[float, float, float]:
    """Return the same as `_galerkin` when S is not formed."""
    u, t, f, o = sizes.n_displacements, sizes.n_tractions, sizes.n_free, sizes.n_open
    assembled = t * t + t * u + u * u
    # two of the free part of W, while it is factored, and the blocks of the iteration
    iterating = assembled + 2.0 * f * f + 13.5 * u * (o + 1)
    largest = t * t + max(3 * t * u + u * u, t * u + 3 * u * u if sizes.n_curved else 0)
    return assembled, max(largest, iterating), assembled + f * f + 3 * u * (o + 1)


def _galerkin(sizes: Sizes) -> tuple[float, float, float]:
    """Return the numbers in the assembled matrices, at the largest moment of condensation, and that are kept."""
    u, t, f, o, x = sizes.n_displacements, sizes.n_tractions, sizes.n_free, sizes.n_open, sizes.n_fixed
    assembled = t * t + t * u + u * u
    # the factor of V, K twice, W and two copies of the sum; of curved elements four of W
    largest = t * t + max(2 * t * u + 3 * u * u, t * u + 4 * u * u if sizes.n_curved else 0)
    own = f * f + 2 * f * o + u * x
    return assembled, max(largest, assembled + 2 * u * u + own + o * o), assembled + own


def _collocation(sizes: Sizes) -> tuple[float, float, float]:
    """Return the same of the exchanged columns: the system and its right-hand sides."""
    u, o = sizes.n_displacements, sizes.n_open
    system = (u + sizes.n_motions) ** 2
    return system + u * o, system + 4 * u * o, system + u * o
