"""What a check is: a question, how it is answered, when it is asked, and about what."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from inspect import Parameter, signature
from typing import Any, Literal

from cobodeck.terminal import USAGE, Problem
from engine.files import FileError, Finding

ANSWERS = "cobodeck.checks"
"""Where the answers are."""
Status = Literal["ok", "note", "missing", "bad"]
FIT: Status = "ok"
NOTE: Status = "note"
MISSING: Status = "missing"
BAD: Status = "bad"

Occasion = Literal[
    "machine",  # `doctor`, always
    "doctor",  # `doctor`, about a scene, a connection or a calibration
    "validate",  # `validate`, about a file
    "setup",  # chart, scene, robot and connection are read
    "simulate",  # `simulate` and `run`, about a chart with a scene, before anything is compiled
    "import",  # before drivers are imported
    "begin",  # before a chart is run on anything
    "localize",  # before the robot is given a localization
    "fold",  # `validate` of a robot, and before its arm is planned for
    "start",  # before anything is opened
    "opened",  # real parts are open, nothing moves
    "wire",  # before states are given parts and signals
    "run",  # `run`, on whatever connection
    "devices",  # `run`, on parts behind drivers
    "real",  # `run`, on a connection that says `real: true`
    "moves",  # a real robot is about to move
]
"""When a check is asked."""


@dataclass(frozen=True, slots=True)
class CheckResult:
    """The answer to a check.

    `what` was looked at; `about` says how it is, with numbers, and `remedy` what would make it
    right. `said` is said in a run instead, where these two do not say it alone. A bad one ends a
    run with the exit code `code`, or with the `findings` of a file.
    """

    what: str
    state: Status
    about: str
    remedy: str = ""
    said: str = ""
    code: int = USAGE
    findings: tuple[Finding, ...] = ()

    @property
    def explanation(self) -> str:
        """How it is, and what would make it right."""
        return f"{self.about}; {self.remedy}" if self.remedy else self.about

    @property
    def line(self) -> tuple[str, str, str]:
        """What was looked at, the state, an explanation."""
        return self.what, self.state, self.explanation

    @property
    def message(self) -> str:
        """What is said of it in a run."""
        return self.said or self.explanation

    def require(self) -> None:
        """Raise if it is bad.

        Raises:
            Problem: with the message, FileError: with the findings.
        """
        if self.state == BAD and self.findings:
            raise FileError(self.findings)
        if self.state == BAD:
            raise Problem(self.message, self.code)


@dataclass(frozen=True)
class FitnessCheck:
    """A question that is asked at some occasions.

    `home` is where the answer is, as `module:function` of `cobodeck.checks`: whoever asks need not
    know what an answer needs. It takes what the question is about, by the names of `Case`; a
    parameter with a default is given if it is at hand. It yields nothing where the question does
    not arise.
    """

    question: str
    home: str
    occasions: tuple[Occasion, ...]

    @cached_property
    def answers(self) -> Callable[..., Iterable[CheckResult]]:
        """The function that answers, loaded when it is first needed."""
        module, _, name = self.home.partition(":")
        found: Callable[..., Iterable[CheckResult]] = getattr(
            import_module(f"{ANSWERS}.{module}"), name
        )
        return found

    @cached_property
    def parameters(self) -> dict[str, bool]:
        """What it takes, by name; True if it cannot do without."""
        given = signature(self.answers).parameters.values()
        return {one.name: one.default is Parameter.empty for one in given}

    def asked(self, occasion: Occasion, case: dict[str, Any]) -> Iterator[CheckResult]:
        """The answers; none if it is not asked now, or about something that is not at hand."""
        if occasion not in self.occasions:
            return
        takes = self.parameters
        if all(name in case for name, needed in takes.items() if needed):
            yield from self.answers(**{name: case[name] for name in takes if name in case})
