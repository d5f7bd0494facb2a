"""A behaviour of FlexBE as it was read: neutral JSON, and what only its Python code says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

Json = Mapping[str, Any]
ROOT = "_state_machine"


@dataclass(frozen=True, slots=True)
class ManualBlock:
    """Code between `[MANUAL_FUNC]` and `[/MANUAL_FUNC]`, or another of these tags.

    `line`: that of its first line in the file.
    """

    tag: str
    code: str
    line: int


@dataclass(frozen=True, slots=True)
class Comment:
    """A comment that an author put on the drawing; `path` is its container's, empty for the root.

    `important`: whether it was marked with `!`.
    """

    path: str
    text: str
    important: bool = False


@dataclass(frozen=True, slots=True)
class Behaviour:
    """One behaviour.

    Attributes:
        name: of its chart.
        json: `behaviors`, `parameters`, `containers`, `root`; Python expressions are
            `{"expr": "self.speed"}`.
        class_name: by which other behaviours embed it; empty if the file does not say.
        about: its docstring.
        file: where it was read.
        userdata: the first values of keys as Python expressions, by container.
        variables: Python expressions of the private variables of `create`, by name.
        is_python: whether it was read from Python, so that all userdata are known.
    """

    name: str
    json: Json
    class_name: str = ""
    about: str = ""
    file: str = ""
    userdata: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    variables: Mapping[str, str] = field(default_factory=dict)
    comments: tuple[Comment, ...] = ()
    manual: tuple[ManualBlock, ...] = ()
    is_python: bool = False

    @property
    def root(self) -> Json:
        """The outermost container."""
        found: Json = self.json["containers"][ROOT]
        return found

    def keys(self, kind: str) -> tuple[str, ...]:
        """The root's `input_keys` or `output_keys`."""
        return tuple(self.root.get(kind, ()))
