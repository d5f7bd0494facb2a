"""The stop sign that is shown to the person: once shown it stays for a while."""

from __future__ import annotations


class StopSign:
    """Whether the sign is shown, as wanted by the charts, and not hidden too soon."""

    def __init__(self) -> None:
        self.wanted = False
        self._least_ns = 0
        self._since: int | None = None

    def want(self, wanted: bool, least: float = 0.0) -> None:
        """Show it, for so long at least, s, or hide it, once it has been shown for so long."""
        self.wanted = wanted
        if wanted:
            promised = 0 if self._since is None else self._least_ns
            self._least_ns = max(promised, round(least * 1e9))

    def shown(self, now_ns: int) -> bool:
        """True while it is to be seen; call it in the order of time, once per step at least."""
        if self.wanted and self._since is None:
            self._since = now_ns
        elif self._since is not None and not self.wanted:
            self._since = None if now_ns - self._since >= self._least_ns else self._since
        return self._since is not None
