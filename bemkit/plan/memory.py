"""Refuses what does not fit into the computer, by the memory that the plan shows."""

from __future__ import annotations

from bemkit.errors import InputError
from bemkit.operators.memory import physical_memory
from bemkit.plan.make import Plan


class TooLargeError(InputError):
    """A scene that does not fit into memory."""


def check_memory(plan: Plan) -> None:
    """Refuse a plan whose matrices cannot fit into this computer.

    Parameters
    ----------
    plan : Plan

    Raises
    ------
    TooLargeError
        Naming the memory needed, the memory there is, and the number of elements that fits.
    """
    available = physical_memory()
    if plan.memory > available:
        n_elements = plan.sizes.n_elements
        n_fitting = int((available / plan.memory) ** 0.5 * n_elements)
        raise TooLargeError(
            f"{n_elements} elements need about {plan.memory / 1e9:.3g} GB, this computer has {available / 1e9:.3g} GB: "
            f"use at most {n_fitting} elements"
        )
