"""Stand-ins for parts beside a run: they take every command, move nothing, and answer as known.

A shadow of the chart that runs, and a case played by a test, command them. Only answers that
nobody can change are handed on: an object by which something moves, such as a motion that can be
cancelled, never gets to whoever commands a stand-in.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from cobodeck.loop import Inert, freezers
from engine import freeze

Answers = dict[tuple[str, str], Any]
"""The newest answer by part and method, or `Raises`; of an attribute by part and `.name`."""


class Raises(NamedTuple):
    """In the place of an answer: the part has raised this."""

    error: Exception


class StandIn(Inert):
    """Stands in for the part `name`: answers, or raises, as the part last has, else None."""

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
        return lambda *_, **__: self._answered(what)

    def _answered(self, what: str) -> Any:
        found = self._answers.get((self._name, what))
        if isinstance(found, Raises):
            raise found.error
        return found


class Overheard:
    """A part whose answers are noted, as far as nobody can change them; otherwise as without."""

    def __init__(self, name: str, part: Any, answers: Answers) -> None:
        vars(self).update(_name=name, _part=part, _answers=answers)

    def __getattr__(self, what: str) -> Any:
        if what.startswith("__"):
            raise AttributeError(what)
        found = getattr(self._part, what)
        if not callable(found) or isinstance(found, type):
            _note(self._answers, (self._name, f".{what}"), found)
            return found
        return _overheard((self._name, what), found, self._answers)

    def __setattr__(self, what: str, value: object) -> None:
        setattr(self._part, what, value)


def _overheard(key: tuple[str, str], act: Callable[..., Any], answers: Answers) -> Any:
    def call(*args: Any, **named: Any) -> Any:
        try:
            answer = act(*args, **named)
        except Exception as error:
            answers[key] = Raises(error)
            raise
        _note(answers, key, answer)
        return answer

    return call


def _note(answers: Answers, key: tuple[str, str], answer: object) -> None:
    try:
        answers[key] = freeze(answer, freezers())
    except TypeError:  # it can be changed, or moves something
        answers.pop(key, None)
