"""A base class for states written for FlexBE: their three hooks on top of `run`.

What changes in porting: outcomes and keys become class attributes, `userdata` holds this state's
keys only, and `on_exit` is called exactly once for each `on_enter` that succeeded, whatever ends
the state.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, ClassVar

from engine.state import Action, Context, Run


class UserData:
    """The inputs of a state, as attributes or by `[key]`; its outputs are those that it sets.

    With `writable`, an attempt to set any other key is an error.
    """

    def __init__(self, inputs: dict[str, Any], writable: Collection[str] | None = None) -> None:
        self.__dict__.update(inputs)
        self.__dict__["_writable"] = writable

    def __setattr__(self, key: str, value: Any) -> None:
        writable = self.__dict__["_writable"]
        if writable is not None and key not in writable:
            known = ", ".join(writable) or "none"
            raise LookupError(f"userdata.{key} is set, and is not among its output keys: {known}")
        self.__dict__[key] = value

    def __getattr__(self, key: str) -> Any:
        if key.startswith("__"):
            raise AttributeError(key)
        raise AttributeError(f"userdata.{key} was never set, and is not among the input keys")

    def __getitem__(self, key: str) -> Any:
        if key not in self:
            raise KeyError(f"userdata[{key!r}] was never set, and is not among the input keys")
        return self.__dict__[key]

    __setitem__ = __setattr__

    def __contains__(self, key: object) -> bool:
        return key != "_writable" and key in self.__dict__

    def keys(self) -> list[str]:
        """The keys that have values."""
        return [key for key in self.__dict__ if key in self]

    def outputs(self, names: tuple[str, ...]) -> dict[str, Any]:
        """The values of the outputs `names`.

        Raises:
            LookupError: for one that was never set.
        """
        missing = [name for name in names if name not in self.__dict__]
        if missing:
            raise LookupError(f"userdata.{missing[0]} was never set")
        return {name: self.__dict__[name] for name in names}


class EventState(Action):
    """Derive from this class and give `execute`; `on_enter` and `on_exit` may stay away.

    Attributes:
        ctx: time, signals and parts while the state runs.
    """

    outcomes: ClassVar[tuple[str, ...]] = ()
    ctx: Context

    def on_enter(self, userdata: UserData) -> None:
        """Called once, before the first `execute`."""

    def execute(self, userdata: UserData) -> str | None:
        """Called every tick; `None` goes on, anything else is the outcome."""
        raise NotImplementedError(f"{type(self).__name__}.execute")

    def on_exit(self, userdata: UserData) -> None:
        """Called once when the state ends or is ended; stop what was started."""

    def run(self, ctx: Context, **inputs: Any) -> Run:
        """The three hooks, in order."""
        self.ctx = ctx
        userdata = UserData(inputs)
        self.on_enter(userdata)
        try:
            while (outcome := self.execute(userdata)) is None:
                yield None
        finally:
            self.on_exit(userdata)
        names = tuple(self.outputs.get(outcome, ()))
        return (outcome, userdata.outputs(names)) if names else outcome
