"""Stand-ins for parts beside a run: they take every command, move nothing, and answer as known.

A shadow of the chart that runs, and a case played by a test, command them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cobodeck.loop.plant import Inert

Answers = dict[tuple[str, str], Any]
"""The newest answer by part and method; of an attribute by part and `.name`."""


class StandIn(Inert):
    """Stands in for the part `name`: answers as the part has last answered, else None."""

    hears: tuple[str, ...] = ()

    def __init__(self, name: str, signals: tuple[str, ...], answers: Answers) -> None:
        super().__init__(signals)
        self._name, self._answers = name, answers

    def stop(self) -> None:
        """Do nothing; nothing moves."""

    def __getattr__(self, what: str) -> Any:
        if what.startswith("_"):
            raise AttributeError(what)
        if (self._name, f".{what}") in self._answers:
            return self._answers[self._name, f".{what}"]
        return lambda *_, **__: self._answers.get((self._name, what))


class Overheard:
    """A part whose answers are noted; otherwise it is as without."""

    def __init__(self, name: str, part: Any, answers: Answers) -> None:
        vars(self).update(_name=name, _part=part, _answers=answers)

    def __getattr__(self, what: str) -> Any:
        if what.startswith("__"):
            raise AttributeError(what)
        found = getattr(self._part, what)
        if not callable(found) or isinstance(found, type):
            self._answers[self._name, f".{what}"] = found
            return found
        return _overheard((self._name, what), found, self._answers)

    def __setattr__(self, what: str, value: object) -> None:
        setattr(self._part, what, value)


def _overheard(key: tuple[str, str], act: Callable[..., Any], answers: Answers) -> Any:
    def call(*args: Any, **named: Any) -> Any:
        answer = answers[key] = act(*args, **named)
        return answer

    return call
