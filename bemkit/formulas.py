"""Formulas in x and y that scene files may contain, evaluated safely.

A formula is parsed by Python's own parser, checked node by node against a short list of what is allowed, and
evaluated with numpy. Nothing is ever passed to ``eval``, every number is a float, and length and depth are limited,
so that a file from a stranger can neither run code nor use up memory.
"""

import ast
import difflib
import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, NoReturn, TypeAlias

import numpy as np
import numpy.typing as npt

from bemkit.arrays import BoolArray, FloatArray
from bemkit.errors import InputError

MAX_LENGTH = 2000
MAX_DEPTH = 100

_CONSTANTS: Mapping[str, float] = MappingProxyType({"pi": math.pi, "e": math.e})

_OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = MappingProxyType(
    {
        ast.Add: np.add,
        ast.Sub: np.subtract,
        ast.Mult: np.multiply,
        ast.Div: np.divide,
        ast.Pow: np.power,
        ast.USub: np.negative,
        ast.UAdd: np.positive,
        ast.Lt: np.less,
        ast.LtE: np.less_equal,
        ast.Gt: np.greater,
        ast.GtE: np.greater_equal,
        ast.Eq: np.equal,
        ast.NotEq: np.not_equal,
    }
)

_FUNCTIONS: Mapping[str, Callable[..., Any]] = MappingProxyType(
    {
        "sin": np.sin,
        "cos": np.cos,
        "tan": np.tan,
        "asin": np.arcsin,
        "acos": np.arccos,
        "atan": np.arctan,
        "atan2": np.arctan2,
        "sinh": np.sinh,
        "cosh": np.cosh,
        "tanh": np.tanh,
        "sqrt": np.sqrt,
        "exp": np.exp,
        "log": np.log,
        "abs": np.abs,
        "sign": np.sign,
        "floor": np.floor,
        "hypot": np.hypot,
        "min": np.minimum,
        "max": np.maximum,
    }
)
_TWO_ARGUMENTS = frozenset({"atan2", "hypot", "min", "max"})
_NAMES = ("x", "y", *_CONSTANTS, *_FUNCTIONS, "where")

# What people write by habit, and what to write instead.
_REMEDIES: Mapping[type[ast.AST], str] = MappingProxyType(
    {
        ast.BitXor: "write ** for a power",
        ast.BitAnd: "write 'and' between conditions",
        ast.BitOr: "write 'or' between conditions",
        ast.Invert: "write 'not' before a condition",
        ast.IfExp: "write where(condition, value, other_value)",
        ast.FloorDiv: "write floor(a / b)",
        ast.Mod: "write a - b * floor(a / b)",
    }
)
_ALLOWED = "use numbers, x, y, pi, e, + - * / **, comparisons, and, or, not, and functions such as sqrt or where"


class ExpressionError(InputError):
    """A formula that cannot be used; the message names the formula, the offending piece and the remedy."""


@dataclass(frozen=True)
class Expression:
    """A formula in the coordinates x and y.

    Parameters
    ----------
    text : str
        For example ``"-x**2 * (1 - x)**2"`` (a value) or ``"x > 0.5 and y < 1"`` (a condition). ``and``, ``or`` and
        ``where(condition, a, b)`` evaluate their later arguments only at the points that need them.

    Raises
    ------
    ExpressionError
        When the text is not a formula of the allowed kind.

    Examples
    --------
    >>> float(Expression("2 * x + y")(1.0, 0.5))
    2.5
    """

    text: str
    _tree: ast.expr = field(init=False, repr=False, compare=False)
    _is_condition: bool = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        tree = _parse(self.text)
        object.__setattr__(self, "_tree", tree)
        object.__setattr__(self, "_is_condition", _Checker(self.text).check(tree, 1))

    @property
    def is_condition(self) -> bool:
        """Whether the formula is true or false (``x > 1``) rather than a number (``x + 1``)."""
        return self._is_condition

    def __call__(self, x: npt.ArrayLike, y: npt.ArrayLike) -> npt.NDArray[Any]:
        """Evaluate the formula at points.

        Parameters
        ----------
        x, y : arrays of the same (or broadcastable) shape [m]

        Returns
        -------
        float array, or bool array if `is_condition`
            Of the broadcast shape.

        Raises
        ------
        ExpressionError
            Where the value, or a compared value, is not finite.
        """
        x_all, y_all = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        points = _Points(self.text, x_all.ravel(), y_all.ravel())
        with np.errstate(all="ignore"):  # non-finite values are reported below, with the point
            values = points.evaluate(self._tree)
        if not self._is_condition:
            points.require_finite(values)
        return values.reshape(x_all.shape)


ScalarField: TypeAlias = float | Expression | Callable[[FloatArray, FloatArray], FloatArray]
"""A number, a formula, or a Python function of the coordinate arrays."""


def evaluate_field(value: ScalarField, points: FloatArray) -> FloatArray:
    """Evaluate a number, formula or function at points.

    Parameters
    ----------
    value : ScalarField
    points : (n, 2) array [m]

    Returns
    -------
    (n,) array

    Raises
    ------
    ExpressionError
        When a function returns another shape or a value that is not finite.
    """
    x, y = points[:, 0], points[:, 1]
    values = np.asarray(value(x, y) if callable(value) else value, dtype=float)
    if values.shape not in ((), x.shape):
        raise ExpressionError(f"{value!r} returns the shape {values.shape} for {x.size} points: return one value each")
    result = np.array(np.broadcast_to(values, x.shape))
    if not np.all(np.isfinite(result)):
        index = int(np.flatnonzero(~np.isfinite(result))[0])
        raise ExpressionError(
            f"{value!r} is {result[index]} at (x, y) = ({x[index]:.6g}, {y[index]:.6g}); it must be finite on the part"
        )
    return result


def check_field(value: object, name: str) -> None:
    """Refuse what is neither a finite number, nor a formula for a number, nor a function.

    Raises
    ------
    ValueError
        Naming the argument, its value and the remedy.
    """
    if isinstance(value, Expression):
        if value.is_condition:
            raise InputError(f"{name} = '{value.text}' is a condition (true or false); give a formula for a number")
    elif isinstance(value, int | float | np.number) and not isinstance(value, bool):
        if not math.isfinite(value):
            raise InputError(f"{name} = {value} is not finite; give a finite number")
    elif not callable(value):
        raise InputError(f"{name} = {value!r} is not a number; give a number, a formula in x and y, or a function")


def closest(word: str, names: "tuple[str, ...] | list[str]") -> str:
    """Return ``"; did you mean 'name'?"`` for the name most like `word`, or an empty string."""
    matches = difflib.get_close_matches(word[:60], names, n=1)
    return f"; did you mean '{matches[0]}'?" if matches else ""


def shorten(text: str, length: int = 60) -> str:
    """Return the quoted text without control characters, cut to a length that fits into a message."""
    return repr(text if len(text) <= length else text[:length] + "...")


def _parse(text: str) -> ast.expr:
    if not isinstance(text, str):
        raise ExpressionError(f"an expression is a text such as 'x > 0.5', not {shorten(str(text))}")
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"expression {shorten(text)}: {len(text)} characters; at most {MAX_LENGTH} are allowed")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # remarks of Python's parser about style
            return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        reason = error.msg if isinstance(error, SyntaxError) else "it is nested too deeply or holds odd characters"
        raise ExpressionError(
            f"expression {shorten(text)}: not a formula ({reason}); write for example 'x**2 * (1 - y)'"
        ) from None


@dataclass(frozen=True)
class _Checker:
    """Walks the parsed formula once and refuses everything that is not on the list."""

    text: str

    def check(self, node: ast.expr, depth: int) -> bool:
        """Return whether the node is a condition."""
        if depth > MAX_DEPTH:
            self.refuse(node, f"nested more than {MAX_DEPTH} deep", "split or simplify it")
        match node:
            case ast.Constant(value=value):
                return self.check_number(node, value)
            case ast.Name(id=name):
                return self.check_name(node, name)
            case ast.BinOp(left=left, op=op, right=right):
                self.check_operator(node, op)
                return self.check_numbers(node, [left, right], depth)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return self.check_conditions(node, [operand], depth)
            case ast.UnaryOp(op=op, operand=operand):
                self.check_operator(node, op)
                return self.check_numbers(node, [operand], depth)
            case ast.BoolOp(values=values):
                return self.check_conditions(node, values, depth)
            case ast.Compare(left=left, ops=ops, comparators=comparators):
                for comparison in ops:
                    self.check_operator(node, comparison)
                self.check_numbers(node, [left, *comparators], depth)
                return True
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                return self.check_call(node, name, arguments, depth)
        self.refuse(node, "not allowed", _REMEDIES.get(type(node), _ALLOWED))

    def check_number(self, node: ast.expr, value: object) -> bool:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.refuse(node, "not a number", _ALLOWED)
        try:
            is_finite = math.isfinite(float(value))
        except OverflowError:
            is_finite = False
        if not is_finite:
            self.refuse(node, "too large for a floating-point number", "write a smaller number")
        return False

    def check_name(self, node: ast.expr, name: str) -> bool:
        if name in _FUNCTIONS or name == "where":
            self.refuse(node, "a function without arguments", f"write {name}(...)")
        if name not in _NAMES:
            self.refuse(node, "unknown name", f"the names are x, y, pi and e{closest(name, _NAMES)}")
        return False

    def check_operator(self, node: ast.expr, op: ast.AST) -> None:
        if type(op) not in _OPERATORS:
            self.refuse(node, "uses an operator that is not allowed", _REMEDIES.get(type(op), _ALLOWED))

    def check_call(self, node: ast.expr, name: str, arguments: list[ast.expr], depth: int) -> bool:
        if name == "where":
            if len(arguments) != 3:
                self.refuse(node, f"where takes 3 arguments, not {len(arguments)}", "write where(condition, a, b)")
            self.check_conditions(node, arguments[:1], depth)
            return self.check_numbers(node, arguments[1:], depth)
        if name not in _FUNCTIONS:
            names = (*_FUNCTIONS, "where")
            self.refuse(node, "unknown function", f"the functions are {', '.join(names)}{closest(name, names)}")
        n_needed = 2 if name in _TWO_ARGUMENTS else 1
        if len(arguments) != n_needed:
            self.refuse(node, f"{name} takes {n_needed} argument(s), not {len(arguments)}", "check the brackets")
        return self.check_numbers(node, arguments, depth)

    def check_numbers(self, node: ast.expr, operands: list[ast.expr], depth: int) -> bool:
        if any([self.check(operand, depth + 1) for operand in operands]):
            self.refuse(node, "calculates with a condition", "turn it into a number with where(condition, 1, 0)")
        return False

    def check_conditions(self, node: ast.expr, operands: list[ast.expr], depth: int) -> bool:
        if not all([self.check(operand, depth + 1) for operand in operands]):
            self.refuse(node, "needs a condition (true or false)", "write a comparison such as x > 0.5")
        return True

    def refuse(self, node: ast.expr, what: str, remedy: str) -> NoReturn:
        piece = ast.get_source_segment(self.text.strip(), node) or self.text
        raise ExpressionError(f"expression {shorten(self.text)}: {shorten(piece, 40)}: {what}; {remedy}")


@dataclass(frozen=True)
class _Points:
    """The points at which a checked formula is evaluated."""

    text: str
    x: FloatArray
    y: FloatArray

    def evaluate(self, node: ast.expr) -> npt.NDArray[Any]:
        """Return the value of the node, one per point."""
        match node:
            case ast.Constant(value=value):
                return np.full(self.x.shape, float(value))  # type: ignore[arg-type]  # checked to be a number
            case ast.Name(id="x"):
                return self.x
            case ast.Name(id="y"):
                return self.y
            case ast.Name(id=name):
                return np.full(self.x.shape, _CONSTANTS[name])
            case ast.BinOp(left=left, op=op, right=right):
                return self._array(_OPERATORS[type(op)](self.evaluate(left), self.evaluate(right)))
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return self._array(np.logical_not(self.evaluate(operand)))
            case ast.UnaryOp(op=op, operand=operand):
                return self._array(_OPERATORS[type(op)](self.evaluate(operand)))
            case ast.BoolOp(op=op, values=[first, *rest]):
                return self._all(first, rest) if isinstance(op, ast.And) else ~self._all(first, rest, negate=True)
            case ast.Compare(left=left, ops=ops, comparators=comparators):
                return self._compare(left, ops, comparators)
            case ast.Call(func=ast.Name(id="where"), args=[condition, value, other_value]):
                return self._choose(self.evaluate(condition), value, other_value)
            case ast.Call(func=ast.Name(id=name), args=arguments):
                return self._array(_FUNCTIONS[name](*map(self.evaluate, arguments)))
        raise AssertionError(f"unchecked node {ast.dump(node)}")

    def require_finite(self, values: FloatArray) -> None:
        """Raise where a value is not finite, naming the formula and the point."""
        if not np.all(np.isfinite(values)):
            index = int(np.flatnonzero(~np.isfinite(values))[0])
            raise ExpressionError(
                f"expression {shorten(self.text)} is {values[index]} at "
                f"(x, y) = ({self.x[index]:.6g}, {self.y[index]:.6g}); "
                "guard it with where(condition, a, b) or change the formula"
            )

    def at(self, mask: BoolArray) -> "_Points":
        return _Points(self.text, self.x[mask], self.y[mask])

    def _all(self, first: ast.expr, rest: list[ast.expr], *, negate: bool = False) -> BoolArray:
        # "or" is evaluated as the negation of all negated arguments; later arguments only where they still matter
        result = np.array(self.evaluate(first) ^ negate)
        for operand in rest:
            undecided = result.copy()
            result[undecided] = self.at(undecided).evaluate(operand) ^ negate
        return result

    def _compare(self, left: ast.expr, ops: list[ast.cmpop], comparators: list[ast.expr]) -> BoolArray:
        values = [self.evaluate(operand) for operand in (left, *comparators)]
        for value in values:
            self.require_finite(value)
        result = np.ones(self.x.shape, dtype=bool)
        for op, smaller, larger in zip(ops, values, values[1:], strict=False):
            result &= _OPERATORS[type(op)](smaller, larger)
        return result

    def _choose(self, condition: BoolArray, value: ast.expr, other_value: ast.expr) -> FloatArray:
        result = np.empty(self.x.shape)
        result[condition] = self.at(condition).evaluate(value)
        result[~condition] = self.at(~condition).evaluate(other_value)
        return result

    def _array(self, value: object) -> npt.NDArray[Any]:
        return np.asarray(value)
