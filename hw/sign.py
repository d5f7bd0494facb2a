"""The stop sign that is shown to the person: once shown it stays for a while."""

from __future__ import annotations

LEAST_NS = 2_000_000_000
"""The sign is shown for so long at least, ns, so that a person can take it in and stop."""


class StopSign:
    """Whether the sign is shown, as wanted by the charts, and not hidden too soon."""

    def __init__(self) -> None:
        self.wanted = False
        self._since: int | None = None

    def shown(self, now_ns: int) -> bool:
        """True while it is to be seen; call it in the order of time, once per step at least."""
        if self.wanted and self._since is None:
            self._since = now_ns
        elif not self.wanted and self._since is not None and now_ns - self._since >= LEAST_NS:
            self._since = None
        return self._since is not None
