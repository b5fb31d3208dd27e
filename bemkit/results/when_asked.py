"""An entry of a frozen value that is worked out when somebody asks for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

Value = TypeVar("Value")


class WhenAsked(Generic[Value]):
    """A field of a dataclass that holds its value, or a function of the whole that returns it, called at most once.

    Type checkers see only the value. Where the field may be a function, a method of the class takes it.

    Parameters
    ----------
    default : Value
        Nothing that is callable, as no other value either.
    """

    def __init__(self, default: Value) -> None:
        self._default = default
        self._key = ""

    @staticmethod
    def held(instance: Any, name: str) -> Any:
        """Return what a field holds, its value or the function that nobody has asked yet.

        `dataclasses.replace` asks for every field that it is not given.
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
