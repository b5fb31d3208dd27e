"""Conformance of friction laws."""

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import SlipHistory
from bemkit.contact.laws import FrictionLaw
from bemkit.testing.failure import CheckFailed, class_name, demand, evaluated


def check_law(law: FrictionLaw, *, stress_scale: float = 1.0, n_contact: int = 5) -> None:
    """Check everything that `FrictionLaw` promises; call it on your own law.

    Parameters
    ----------
    law : FrictionLaw
    stress_scale : float [Pa]
        Pressures from 1e-3 to 1e3 times this are tried; choose it so that the law's corners lie among them.
    n_contact : int
        Number of nodes to ask for at once; for a law with one coefficient a node, their number.

    Raises
    ------
    CheckFailed
        Naming the law, the promise broken, and where.
    """
    name = class_name(law)
    random = np.random.default_rng(0)
    for _ in range(20):
        sigma_n = -stress_scale * 10.0 ** random.uniform(-3.0, 3.0, n_contact)
        _check_values(law, name, sigma_n)
        _check_derivative(law, name, sigma_n)
        other = np.concatenate([sigma_n[:1], 3.0 * sigma_n[1:]])
        is_local = law.bound(other)[0] == law.bound(sigma_n)[0]
        demand(bool(is_local), f"{name}.bound at node 0 depends on the pressure at other nodes")
        _check_scaling(law, name, sigma_n)
    _check_values(law, name, np.zeros(n_contact))
    if law.needs_history:
        _check_history(law, name, stress_scale, n_contact, random)
    acts = np.asarray(law.acts_across_gap)
    demand(
        acts.dtype == bool and acts.shape in ((), (n_contact,)),
        f"{name}.acts_across_gap is not boolean: give True or False, or one of them for each node",
    )


def _check_history(
    law: FrictionLaw, name: str, stress_scale: float, n_contact: int, random: np.random.Generator
) -> None:
    """Check the laws of single load steps: each a law without history, at each node by the slip of that node."""
    sigma_n = np.full(n_contact, -stress_scale)
    for _ in range(5):
        slip = 10.0 ** random.uniform(-6.0, 1.0, n_contact)
        motion = SlipHistory(2.0, 0.5, slip, 0.3 * slip)
        present = law.at_slip(motion)
        demand(not present.needs_history, f"{name}.at_slip returns a law that needs a history itself")
        _check_values(present, f"{name}.at_slip(...)", sigma_n)
        _check_derivative(present, f"{name}.at_slip(...)", sigma_n)
        unit = 1e6
        scaled = unit * law.scaled(unit).at_slip(motion).bound(sigma_n / unit)
        agrees = np.allclose(scaled, present.bound(sigma_n), rtol=1e-12, atol=0.0)
        demand(agrees, f"{name}.scaled({unit:g}).at_slip is not the law in that unit")
        other = SlipHistory(2.0, 0.5, np.append(slip[:1], 3.0 * slip[1:]), 0.3 * np.append(slip[:1], 3.0 * slip[1:]))
        is_local = law.at_slip(other).bound(sigma_n)[0] == present.bound(sigma_n)[0]
        demand(bool(is_local), f"{name}.at_slip at node 0 depends on the slip of other nodes")


def _check_values(law: FrictionLaw, name: str, sigma_n: FloatArray) -> None:
    bound = evaluated(f"{name}.bound", law.bound, sigma_n, sigma_n.shape)
    derivative = evaluated(f"{name}.bound_derivative", law.bound_derivative, sigma_n, sigma_n.shape)
    demand(bool((bound >= 0.0).all()), f"{name}.bound is negative at sigma_n = {sigma_n}")
    demand(bool((derivative <= 0.0).all()), f"{name}.bound_derivative is positive at {sigma_n}")
    demand(not (law.is_frictionless and bound.any()), f"{name} says it is frictionless and has a bound at {sigma_n}")
    grows = law.bound(2.0 * sigma_n) >= bound
    demand(bool(grows.all()), f"{name}.bound falls when the pressure grows from {-sigma_n} to twice that")


def _check_derivative(law: FrictionLaw, name: str, sigma_n: FloatArray) -> None:
    """Compare with differences; at a corner any value between the two sides is right."""
    step = 1e-6 * np.abs(sigma_n)
    bound = law.bound(sigma_n)
    before = (bound - law.bound(sigma_n - step)) / step
    after = (law.bound(sigma_n + step) - bound) / step
    derivative = law.bound_derivative(sigma_n)
    # Differences with a relative step of 1e-6 carry 1e-10 of round-off and 1e-6 of curvature.
    slack = 1e-4 * (np.abs(before) + np.abs(after)) + 1e-9 * bound / np.abs(sigma_n)
    low, high = np.minimum(before, after) - slack, np.maximum(before, after) + slack
    fits = (low <= derivative) & (derivative <= high)
    if not fits.all():
        node = int(np.argmin(fits))
        raise CheckFailed(
            f"{name}.bound_derivative is {derivative[node]:g} at node {node}, sigma_n = {sigma_n[node]:g}; "
            f"differences of bound give {before[node]:g} and {after[node]:g}"
        )


def _check_scaling(law: FrictionLaw, name: str, sigma_n: FloatArray) -> None:
    unit = 1e6
    scaled = law.scaled(unit)
    agrees = np.allclose(unit * scaled.bound(sigma_n / unit), law.bound(sigma_n), rtol=1e-12, atol=0.0)
    demand(agrees, f"{name}.scaled({unit:g}).bound is not the bound in that unit")
    agrees = np.allclose(scaled.bound_derivative(sigma_n / unit), law.bound_derivative(sigma_n), rtol=1e-9, atol=1e-15)
    demand(agrees, f"{name}.scaled({unit:g}).bound_derivative changes with the unit")
