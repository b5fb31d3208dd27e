"""Friction laws: bounds of the tangential traction for a given normal traction.

The contact conditions are the same for all laws. At a closed node the tangential traction does not exceed the bound; if
the node slips, it has the magnitude of the bound and opposes the slip,

    |sigma_t| <= bound(sigma_n),    sigma_t = -bound(sigma_n) u_t / |u_t|  where  u_t != 0.

To add a law, derive a class from `FrictionLaw` and implement `bound` and `bound_derivative`. Coefficients may vary
along the boundary: one number for each contact node, or formulas or functions of the coordinates, which
`FrictionLaw.at` evaluates at the nodes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import ClassVar, Protocol, Self, TypeAlias, runtime_checkable

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, read_only
from bemkit.contact.body import SlipHistory
from bemkit.errors import InputError
from bemkit.formulas import ScalarField, check_field, evaluate_field

Coefficient: TypeAlias = ScalarField | FloatArray
"""A number, a formula or function of x and y, or one number for each contact node."""


class LawError(InputError):
    """A friction law raised an error or returned invalid bounds; the message names the law."""


def checked_coefficient(name: str, value: Coefficient, *, may_be_infinite: bool = False) -> Coefficient:
    """Check a coefficient; return a float, a read-only copy of an array, or the formula or function.

    Raises
    ------
    InputError
        If a number is negative or NaN, or infinite without `may_be_infinite`, or an array has more than one axis.
    """
    if callable(value):
        check_field(value, name)
        return value
    if isinstance(value, str):
        check_field(value, name)
    array = np.array(value, dtype=float)
    if array.ndim > 1:
        raise InputError(f"{name} has the shape {array.shape}; give one number, or one number for each contact node")
    is_wrong = np.isnan(array) | (array < 0.0) | (False if may_be_infinite else np.isinf(array))
    if np.any(is_wrong):
        where = f" at contact node {int(np.argmax(is_wrong))}" if array.ndim else ""
        raise InputError(f"{name} = {array[is_wrong][0] if array.ndim else array:g}{where}; give a number >= 0")
    return read_only(array) if array.ndim else float(array)


def numbers_of(name: str, value: Coefficient) -> float | FloatArray:
    """Return a coefficient that is a number or an array; raise InputError for a function of the coordinates."""
    if callable(value):
        raise InputError(f"{name} is a function of the coordinates; call law.at(points) with the contact nodes first")
    return value


def is_zero(value: Coefficient) -> bool:
    """Whether a coefficient is zero at all nodes; not for formulas and functions."""
    return not callable(value) and not np.any(value)


def evaluated_coefficient(name: str, value: Coefficient, points: FloatArray) -> Coefficient:
    """Return the numbers of a coefficient; evaluate formulas and functions at (n_contact, 2) points [m]."""
    if isinstance(value, np.ndarray) and len(value) != len(points):
        raise LawError(
            f"{name} has {len(value)} values for {len(points)} contact nodes: give one number, one for each node, or a "
            "formula of x and y"
        )
    if not callable(value):
        return value
    values = evaluate_field(value, points)
    if np.any(values < 0.0):
        node = int(np.argmin(values))
        x, y = points[node]
        raise LawError(
            f"{name} = {value!r} is {values[node]:g} at (x, y) = ({x:.6g}, {y:.6g}); it must be zero or positive on "
            "the whole contact part"
        )
    return values


@runtime_checkable
class FrictionLaw(Protocol):
    """Bound of the tangential traction; derived classes implement `bound` and `bound_derivative`.

    Notes
    -----
    Both methods are called with compressive normal tractions (``sigma_n <= 0``) of all contact nodes, so coefficients
    may differ from node to node. `bemkit.testing.check_law` tests this contract.
    """

    @property
    def is_frictionless(self) -> bool:
        """Whether the bound is zero for every pressure."""
        return False

    @property
    def needs_history(self) -> bool:
        """Whether the bound depends on slip or time and requires load steps; see `at_slip`."""
        return False

    def at_slip(self, motion: SlipHistory) -> FrictionLaw:
        """Return the law of one load step, whose bound depends only on the normal traction.

        Parameters
        ----------
        motion : SlipHistory
            Time and slip of the contact nodes.

        Returns
        -------
        FrictionLaw
            By default the law itself.
        """
        return self

    @property
    def acts_across_gap(self) -> bool | BoolArray:
        """Whether friction ``bound(0)`` also acts at open nodes, for all nodes or for each node.

        By default False: open nodes carry no traction. True for friction that is given on the whole contact boundary,
        which makes the problem convex (see `Tresca`). It has no effect if ``bound(0) = 0``.
        """
        return False

    def at(self, points: FloatArray) -> FrictionLaw:
        """Return the law with formulas and functions of the coordinates evaluated at contact nodes.

        Parameters
        ----------
        points : (n_contact, 2) array [m]

        Returns
        -------
        FrictionLaw
            By default the law itself; laws with variable coefficients override it.

        Raises
        ------
        ValueError
            If a coefficient is not finite or out of range at a node.
        """
        return self

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return the largest tangential traction of each node.

        Parameters
        ----------
        sigma_n : (n_contact,) array [Pa]
            Normal tractions, not positive.

        Returns
        -------
        (n_contact,) array [Pa]
            Not negative, and non-decreasing with the pressure ``-sigma_n``.
        """
        ...

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return the derivative of `bound` with respect to `sigma_n`.

        Parameters
        ----------
        sigma_n : (n_contact,) array [Pa]

        Returns
        -------
        (n_contact,) array [-]
            Not positive. At a kink either one-sided derivative, at ``sigma_n = 0`` that of the compressive side.
        """
        ...

    def scaled(self, stress_scale: float) -> FrictionLaw:
        """Return the same law for stresses in units of `stress_scale` [Pa]."""
        return RescaledLaw(self, stress_scale)


class LawOfCoefficients(FrictionLaw):
    """Base class of laws whose fields are coefficients; it checks, evaluates, rescales and compares them.

    Two laws are equal if their classes and coefficients are equal.

    Attributes
    ----------
    stresses : tuple of str
        Names of the coefficients that are stresses [Pa]; `scaled` divides them by the unit of stress.
    may_be_infinite : tuple of str
        Names of the coefficients that may be infinite.
    """

    stresses: ClassVar[tuple[str, ...]] = ()
    may_be_infinite: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        for name, value in self.coefficients.items():
            value = checked_coefficient(name, value, may_be_infinite=name in self.may_be_infinite)
            object.__setattr__(self, name, value)

    def scaled(self, stress_scale: float) -> Self:
        """Return the law with stresses in units of `stress_scale`."""
        _check_scale(stress_scale)
        values = {name: numbers_of(name, self.coefficients[name]) / stress_scale for name in self.stresses}
        return replace(self, **values) if values else self  # type: ignore[type-var]

    def at(self, points: FloatArray) -> Self:
        """Return the law with its coefficients evaluated at (n_contact, 2) points [m]."""
        values = {name: evaluated_coefficient(name, value, points) for name, value in self.coefficients.items()}
        return replace(self, **values) if values else self  # type: ignore[type-var]

    def with_lists(self, change: Callable[[FloatArray], FloatArray]) -> Self:
        """Return the law with a change of the coefficients that list numbers of nodes."""
        lists = {name: change(value) for name, value in self.coefficients.items() if isinstance(value, np.ndarray)}
        return replace(self, **lists) if lists else self  # type: ignore[type-var]

    @property
    def coefficients(self) -> dict[str, Coefficient]:
        """The coefficients by name."""
        return {entry.name: getattr(self, entry.name) for entry in fields(self)}  # type: ignore[arg-type]

    @property
    def is_uniform(self) -> bool:
        """Whether all coefficients are single numbers."""
        return all(isinstance(value, float) for value in self.coefficients.values())

    def _compared(self) -> tuple[object, ...]:
        """Return class and coefficients in a form that compares and hashes."""
        values = self.coefficients.values()
        return type(self), *(tuple(value.tolist()) if isinstance(value, np.ndarray) else value for value in values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, LawOfCoefficients) and self._compared() == other._compared()

    def __hash__(self) -> int:
        return hash(self._compared())


@dataclass(frozen=True, eq=False)
class Frictionless(LawOfCoefficients):
    """No tangential traction."""

    @property
    def is_frictionless(self) -> bool:
        """True: the bound is zero."""
        return True

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return zeros."""
        return np.zeros_like(sigma_n)

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return zeros."""
        return np.zeros_like(sigma_n)


@dataclass(frozen=True, eq=False)
class Tresca(LawOfCoefficients):
    """Given friction: a bound that does not depend on the pressure.

    Parameters
    ----------
    bound_value : Coefficient [Pa]
        The bound, not negative.

    Notes
    -----
    The bound acts on the whole contact boundary, including open nodes; the problem is then convex and has a unique
    solution. For friction that vanishes at open nodes use `CohesiveCoulomb` with ``cohesion=0`` and a ``cap``.
    """

    bound_value: Coefficient
    stresses = ("bound_value",)

    @property
    def is_frictionless(self) -> bool:
        """Whether the given bound is zero."""
        return is_zero(self.bound_value)

    @property
    def acts_across_gap(self) -> bool:
        """True: the bound is given on the whole contact boundary."""
        return True

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return the given bound."""
        return np.broadcast_to(numbers_of("bound_value", self.bound_value), sigma_n.shape).astype(float)

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return zeros."""
        return np.zeros_like(sigma_n)


@dataclass(frozen=True, eq=False)
class Coulomb(LawOfCoefficients):
    """Coulomb's law: ``bound = s |sigma_n|``, equations (7) and (8) of the paper.

    Parameters
    ----------
    friction_coefficient : Coefficient [-]
        s, not negative.
    """

    friction_coefficient: Coefficient

    @property
    def is_frictionless(self) -> bool:
        """Whether the friction coefficient is zero."""
        return is_zero(self.friction_coefficient)

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return ``s |sigma_n|``, and zero under tension."""
        s = numbers_of("friction_coefficient", self.friction_coefficient)
        return np.asarray(s * np.maximum(-sigma_n, 0.0))

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return ``-s``, and zero under tension."""
        s = numbers_of("friction_coefficient", self.friction_coefficient)
        return np.where(sigma_n <= 0.0, -np.asarray(s), 0.0)


@dataclass(frozen=True)
class RescaledLaw(FrictionLaw):
    """A law in another unit of stress; `FrictionLaw.scaled` returns one by default.

    Parameters
    ----------
    law : FrictionLaw
    stress_scale : float [Pa]
        The unit in which this law receives and returns stresses.
    """

    law: FrictionLaw
    stress_scale: float

    def __post_init__(self) -> None:
        _check_scale(self.stress_scale)

    @property
    def is_frictionless(self) -> bool:
        """Property of the original law."""
        return self.law.is_frictionless

    @property
    def needs_history(self) -> bool:
        """Property of the original law."""
        return self.law.needs_history

    def at_slip(self, motion: SlipHistory) -> FrictionLaw:
        """Return the law for one load step, in the same unit of stress."""
        return self.law.at_slip(motion).scaled(self.stress_scale)

    @property
    def acts_across_gap(self) -> bool | BoolArray:
        """Property of the original law."""
        return self.law.acts_across_gap

    def at(self, points: FloatArray) -> FrictionLaw:
        """Return the law evaluated at (n_contact, 2) points [m], in the same unit of stress."""
        return self.law.at(points).scaled(self.stress_scale)

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return ``bound(sigma_n * stress_scale) / stress_scale``."""
        return self.law.bound(sigma_n * self.stress_scale) / self.stress_scale

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return ``bound_derivative(sigma_n * stress_scale)``."""
        return self.law.bound_derivative(sigma_n * self.stress_scale)


def _check_scale(stress_scale: float) -> None:
    if not (np.isfinite(stress_scale) and stress_scale > 0.0):
        raise InputError(f"stress_scale = {stress_scale:g}; give a positive finite stress")
