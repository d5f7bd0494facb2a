"""The software stop as a latch (R48, R49), for simulated robots and real parts alike."""

from __future__ import annotations

from collections.abc import Callable

from hw.samples import Sample


class StopLatch:
    """A latch: anyone may pull it, the operator resets it once its cause is gone (R49).

    `release` is called at a reset; it returns True if no cause persists.
    """

    signals: tuple[str, ...] = ("stop.engaged",)

    def __init__(self, release: Callable[[], bool]) -> None:
        self.reason: str | None = None
        self._release = release
        self._reported: str | None = "nothing yet"

    def pull(self, reason: str) -> None:
        """Stop base and arm until the reset; see `StopLine`."""
        if self.reason is None:
            self.reason = reason

    def reset(self) -> bool:
        """Let the robot move again, unless the cause persists; see `StopLine`."""
        if not self._release():
            return False
        self.reason = None
        return True

    def samples(self, now_ns: int) -> list[Sample]:
        """The reason, on change."""
        if self.reason == self._reported:
            return []
        self._reported = self.reason
        return [Sample("stop.engaged", now_ns, self.reason)]
