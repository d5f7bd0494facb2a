"""The software stop as a latch (R48, R49), for simulated robots and real parts alike."""

from __future__ import annotations

from collections.abc import Callable

from hw.samples import Sample

_NOTHING_YET = "nothing yet"


class StopLatch:
    """A latch: anyone may pull it, the operator resets it once its cause is gone (R49).

    `release` is called at a reset; it returns True if no cause persists.
    """

    signals: tuple[str, ...] = ("stop.engaged",)

    def __init__(self, release: Callable[[], bool]) -> None:
        self.reason: str | None = None
        self._release = release
        self._reported: str | None = _NOTHING_YET

    @property
    def still(self) -> bool:
        """True while it is not pulled, and has reported so."""
        return self.reason is None and self._reported in (None, _NOTHING_YET)

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
