"""A field of a frozen value that is computed on first access."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

Value = TypeVar("Value")


class WhenAsked(Generic[Value]):
    """A dataclass field that holds its value, or a function of the instance that computes it once.

    Type checkers see only the value; a method of the class accepts a function.

    Parameters
    ----------
    default : Value
        Must not be callable; nor must any other value.
    """

    def __init__(self, default: Value) -> None:
        self._default = default
        self._key = ""

    @staticmethod
    def held(instance: Any, name: str) -> Any:
        """Return the content of a field: its value, or the function that has not been called yet.

        `dataclasses.replace` evaluates every field that it does not replace.
        """
        return instance.__dict__[_key_of(name)]

    def __set_name__(self, owner: type, name: str) -> None:
        self._key = _key_of(name)

    def __get__(self, instance: Any, owner: type | None = None) -> Value:
        if instance is None:
            return self._default
        held: Value | Callable[[Any], Value] = instance.__dict__[self._key]
        if callable(held):
            held = instance.__dict__[self._key] = held(instance)
        return held

    def __set__(self, instance: Any, value: Value) -> None:
        instance.__dict__[self._key] = value


def _key_of(name: str) -> str:
    return f"_{name}_when_asked"
