"""Wrappers around the parts of a run that report what states call, and the results."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cobodeck.record.format import arguments_text

Told = Callable[[str, str, str, object, object], None]
"""Takes the names of part and method, the arguments as JSON, the answer, and the exception."""


class Tapped:
    """A wrapped part; every method call and every attribute access is reported."""

    def __init__(self, name: str, part: Any, tell: Told) -> None:
        vars(self).update(_name=name, _part=part, _tell=tell)

    def __getattr__(self, what: str) -> Any:
        if what.startswith("__"):
            raise AttributeError(what)
        try:
            found = getattr(self._part, what)
        except BaseException as error:
            self._tell(self._name, f".{what}", "[]", None, error)
            raise
        if not callable(found) or isinstance(found, type):
            self._tell(self._name, f".{what}", "[]", found, None)
            return found
        return _tapped(self._name, what, found, self._tell)

    def __setattr__(self, what: str, value: object) -> None:
        self._tell(self._name, f".{what} =", arguments_text((value,), {}), None, None)
        setattr(self._part, what, value)


def _tapped(part: str, what: str, act: Callable[..., Any], tell: Told) -> Callable[..., Any]:
    def call(*args: Any, **named: Any) -> Any:
        given = arguments_text(args, named)  # before the call, which may change them
        try:
            answer = act(*args, **named)
        except BaseException as error:
            tell(part, what, given, None, error)
            raise
        tell(part, what, given, answer, None)
        return answer

    return call
