"""Formulas in x and y that scene files may contain, evaluated safely.

A formula is parsed by Python's own parser and turned node by node into functions of numpy, from a short list of what is
allowed. Nothing is ever passed to ``eval``, every number is a float, and length and depth are limited,
so that a file from a stranger can neither run code nor use up memory.
"""

import ast
import difflib
import math
import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import partial, reduce
from types import MappingProxyType
from typing import Any, NoReturn, TypeAlias

import numpy as np
import numpy.typing as npt

from bemkit.arrays import FloatArray
from bemkit.errors import InputError

MAX_LENGTH = 2000
MAX_DEPTH = 100

_NO_SYNONYMS: Mapping[str, tuple[str, ...]] = MappingProxyType({})

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

_FUNCTIONS: Mapping[str, np.ufunc] = MappingProxyType(
    {name: getattr(np, name) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "sqrt", "exp", "log")}
    | {name: getattr(np, name) for name in ("abs", "sign", "floor", "hypot")}
    | {"asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "atan2": np.arctan2}
    | {"min": np.minimum, "max": np.maximum}
)
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
        ``where(condition, a, b)`` ignore what their other arguments are at points that do not need them.

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
    _compiled: "_Compiled" = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_compiled", _Compiler(self.text).compile(_parse(self.text), 1))

    def __reduce__(self) -> "tuple[type[Expression], tuple[str]]":
        return Expression, (self.text,)

    @property
    def is_condition(self) -> bool:
        """Whether the formula is true or false (``x > 1``) rather than a number (``x + 1``)."""
        return self._compiled.is_condition

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
        with np.errstate(all="ignore"):  # values that are not finite are reported below, with the point
            values = np.full(x_all.shape, self._compiled.value(x_all, y_all))
        if not np.isfinite(values).all():
            remedy = "guard it with where(condition, a, b) or change the formula"
            raise _not_finite(values, x_all, y_all, f"expression {shorten(self.text)}", remedy)
        return values == 1.0 if self.is_condition else values


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
    result = np.full(x.shape, values)
    if not np.isfinite(result).all():
        raise _not_finite(result, x, y, repr(value), "it must be finite on the part")
    return result


def _not_finite(values: FloatArray, x: FloatArray, y: FloatArray, name: str, remedy: str) -> ExpressionError:
    """Return an error that names the first value that is not finite, and its index."""
    wrong = int(np.argmin(np.isfinite(values)))
    value, *place = (float(array.ravel()[wrong]) for array in (values, x, y))
    return ExpressionError(f"{name} is {value} at (x, y) = ({place[0]:.6g}, {place[1]:.6g}); {remedy}")


def has_fields(owner: object) -> bool:
    """Whether attributes of an object, such as a load or a gap, are formulas or functions of the coordinates."""
    return any(map(callable, vars(owner).values()))


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
        example = value if isinstance(value, str) else "2 * x"
        raise InputError(f"{name} = {value!r} is not a number; give a number, Expression({example!r}) or a function")


def nearest(word: str, names: Collection[str], synonyms: Mapping[str, tuple[str, ...]] = _NO_SYNONYMS) -> str:
    """Return the name that `word` is a synonym of, else the name most like it, else an empty string."""
    meant = [name for name in synonyms.get(word.lower(), ()) if name in names]
    return next(iter(meant or difflib.get_close_matches(word[:60], names, n=1)), "")


def closest(word: str, names: Collection[str], synonyms: Mapping[str, tuple[str, ...]] = _NO_SYNONYMS) -> str:
    """Return ``"; did you mean 'name'?"`` for the name nearest to `word`, or an empty string."""
    name = nearest(word, names, synonyms)
    return f"; did you mean '{name}'?" if name else ""


def choices(word: str, names: "tuple[str, ...] | list[str]") -> str:
    """Return the first of the names there are, and which of them the word may have meant."""
    return ", ".join(names[:12]) + (", ..." if len(names) > 12 else "") + closest(word, names)


def shorten(text: str, length: int = 60) -> str:
    """Return the quoted text without control characters, cut to a length that fits into a message."""
    return repr(text if len(text) <= length else text[:length] + "...")


def _parse(text: str) -> ast.expr:
    if not isinstance(text, str):
        raise ExpressionError(f"an expression is a text such as 'x**2 * (1 - y)', not {shorten(str(text))}")
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


_Value: TypeAlias = Callable[[FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class _Compiled:
    """A piece of a formula as a function of x and y.

    Conditions are 1 or 0. Where a compared value is not finite they are that value, and undefined: so what decides
    without them hides them, and what depends on them is undefined as well.
    """

    value: _Value
    is_condition: bool = False


@dataclass(frozen=True)
class _Compiler:
    """Walks the parsed formula once; refuses everything that is not on the list, and turns the rest into functions."""

    text: str

    def compile(self, node: ast.expr, depth: int) -> _Compiled:
        if depth > MAX_DEPTH:
            self.refuse(node, f"nested more than {MAX_DEPTH} deep", "split or simplify it")
        match node:
            case ast.Constant(value=value):
                number = self.number(node, value)
                return _Compiled(lambda x, y: np.full(x.shape, number))
            case ast.Name(id=name):
                return _Compiled(self.name(node, name))
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return _Compiled(_applied(_not, self.conditions(node, [operand], depth)), is_condition=True)
            case ast.BinOp(op=op):
                return _Compiled(_applied(self.operator(node, op), self.numbers(node, [node.left, node.right], depth)))
            case ast.UnaryOp(op=op, operand=operand):
                return _Compiled(_applied(self.operator(node, op), self.numbers(node, [operand], depth)))
            case ast.BoolOp(op=op, values=values):
                join = _and if isinstance(op, ast.And) else _or
                conditions = self.conditions(node, values, depth)
                return _Compiled(reduce(lambda a, b: _applied(join, [a, b]), conditions), is_condition=True)
            case ast.Compare(left=left, ops=ops, comparators=comparators):
                comparison = partial(_comparison, [self.operator(node, op) for op in ops])
                compared = self.numbers(node, [left, *comparators], depth)
                return _Compiled(_applied(comparison, compared), is_condition=True)
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                return _Compiled(self.call(node, name, arguments, depth))
        self.refuse(node, "not allowed", _REMEDIES.get(type(node), _ALLOWED))

    def number(self, node: ast.expr, value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.refuse(node, "not a number", _ALLOWED)
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            self.refuse(node, "too large for a floating-point number", "write a smaller number")
        return number

    def name(self, node: ast.expr, name: str) -> _Value:
        if name in _FUNCTIONS or name == "where":
            self.refuse(node, "a function without arguments", f"write {name}(...)")
        if name == "t":
            self.refuse(node, "the time is not known here", "write formulas of t among the changes of [[steps]]")
        if name not in _NAMES:
            self.refuse(node, "unknown name", f"the names are x, y, pi and e{closest(name, _NAMES)}")
        if name in _CONSTANTS:
            return lambda x, y: np.full(x.shape, _CONSTANTS[name])
        return (lambda x, y: x) if name == "x" else (lambda x, y: y)

    def operator(self, node: ast.expr, op: ast.AST) -> Callable[..., Any]:
        if type(op) not in _OPERATORS:
            self.refuse(node, "uses an operator that is not allowed", _REMEDIES.get(type(op), _ALLOWED))
        return _OPERATORS[type(op)]

    def call(self, node: ast.expr, name: str, arguments: list[ast.expr], depth: int) -> _Value:
        if name == "where":
            if len(arguments) != 3:
                self.refuse(node, f"where takes 3 arguments, not {len(arguments)}", "write where(condition, a, b)")
            conditions = self.conditions(node, arguments[:1], depth)
            return _applied(_where, [*conditions, *self.numbers(node, arguments[1:], depth)])
        if name not in _FUNCTIONS:
            names = (*_FUNCTIONS, "where")
            self.refuse(node, "unknown function", f"the functions are {', '.join(names)}{closest(name, names)}")
        function = _FUNCTIONS[name]
        if len(arguments) != function.nin:
            self.refuse(node, f"{name} takes {function.nin} argument(s), not {len(arguments)}", "check the brackets")
        return _applied(function, self.numbers(node, arguments, depth))

    def numbers(self, node: ast.expr, operands: list[ast.expr], depth: int) -> list[_Value]:
        compiled = [self.compile(operand, depth + 1) for operand in operands]
        if any(operand.is_condition for operand in compiled):
            self.refuse(node, "calculates with a condition", "turn it into a number with where(condition, 1, 0)")
        return [operand.value for operand in compiled]

    def conditions(self, node: ast.expr, operands: list[ast.expr], depth: int) -> list[_Value]:
        compiled = [self.compile(operand, depth + 1) for operand in operands]
        if not all(operand.is_condition for operand in compiled):
            self.refuse(node, "needs a condition (true or false)", "write a comparison such as x > 0.5")
        return [operand.value for operand in compiled]

    def refuse(self, node: ast.expr, what: str, remedy: str) -> NoReturn:
        piece = ast.get_source_segment(self.text.strip(), node) or self.text
        raise ExpressionError(f"expression {shorten(self.text)}: {shorten(piece, 40)}: {what}; {remedy}")


def _applied(function: Callable[..., Any], arguments: list[_Value]) -> _Value:
    return lambda x, y: np.asarray(function(*(argument(x, y) for argument in arguments)))


def _where(condition: FloatArray, value: FloatArray, other_value: FloatArray) -> FloatArray:
    return np.where(condition == 1.0, value, np.where(condition == 0.0, other_value, condition))


def _not(condition: FloatArray) -> FloatArray:
    return np.where(np.isfinite(condition), 1.0 - condition, condition)


def _and(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.where(first == 1.0, second, first)


def _or(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.where(first == 0.0, second, first)


def _comparison(operators: list[Callable[..., Any]], *values: FloatArray) -> FloatArray:
    pairs = zip(operators, values, values[1:], strict=False)
    holds = [operator(smaller, larger) for operator, smaller, larger in pairs]
    result = np.asarray(np.all(holds, axis=0), dtype=float)
    for value in reversed(values):
        result = np.where(np.isfinite(value), result, value)
    return result
