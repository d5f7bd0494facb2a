"""Names what can no longer do its work: processes that ended or hang, devices that fell silent."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from hw.ipc import AGAIN


class Health:
    """Watches what a connection has opened: peers, links and parts, by name.

    Each is asked for its `fault`, a text or None, and its `child`, a process, for its own. All that
    is open is used: what is down stops the robot (`stop`, with the reason) until it works again and
    the operator resets the stop.
    """

    def __init__(self, watched: Mapping[str, Any], stop: Callable[[str], None]) -> None:
        self._watched, self._stop = watched, stop
        self._known: dict[str, str | None] = {}

    def look(self) -> None:
        """Stop for each fault that was not there at the last look."""
        for name, one in self._watched.items():
            fault, before = fault_of(one), self._known.get(name)
            if fault is not None and fault != before:
                self._stop(fault)
            self._known[name] = fault

    @property
    def fault(self) -> str | None:
        """What is down now, as its first fault; None if all work."""
        return next(filter(None, map(fault_of, self._watched.values())), None)


def fault_of(one: Any) -> str | None:
    """Why something that was opened does not work; None if it does, or cannot tell."""
    try:
        child = getattr(one, "child", None)
        of_process = getattr(child, "fault", None)
        if child is not None and of_process and not child.alive and not hasattr(one, "acknowledge"):
            of_process += f"; {AGAIN}"
        found = of_process or getattr(one, "fault", None)
    except Exception as error:  # noqa: BLE001  a driver may raise anything
        return f"{type(one).__name__}: {type(error).__name__}: {error}"
    return found if isinstance(found, str) else None
