"""The links that must be heard while the wheels may turn: arm, observer, VR."""

from __future__ import annotations

from dataclasses import dataclass

from hw.drivers.gates import ARM_SILENT_NS, LINK_SILENT_NS


@dataclass(slots=True)
class Heartbeat:
    """A periodic message: `fault` is what its sender reports of itself, None if it is well.

    Until it `was_well` for the first time it is awaited, and cannot be lost.
    """

    name: str
    within_ns: int
    heard_ns: int | None = None
    fault: str | None = None
    was_well: bool = False

    def beat(self, stamp_ns: int, now_ns: int, fault: str | None = None) -> None:
        """Take a message; a stamp ahead of now counts as now, an older one is ignored."""
        stamp_ns = min(stamp_ns, now_ns)
        if self.heard_ns is None or stamp_ns > self.heard_ns:
            self.heard_ns, self.fault = stamp_ns, fault
            self.was_well = self.was_well or fault is None

    def is_fresh(self, now_ns: int) -> bool:
        """True if heard within `within_ns`."""
        return self.heard_ns is not None and now_ns - self.heard_ns <= self.within_ns

    def lost(self, now_ns: int) -> str | None:
        """Why it is lost; None if it is not, or was never well."""
        if not self.was_well:
            return None
        if self.fault is not None:
            return self.fault
        return None if self.is_fresh(now_ns) else f"{self.name} is silent"


class Watchdogs:
    """All links of a chain.

    Args:
        arm: True to require an arm.
        observer_s: longest silence of the observer, s; None if none is required.
    """

    def __init__(self, arm: bool, observer_s: float | None) -> None:
        self.arm = Heartbeat("the link to the arm", ARM_SILENT_NS)
        self.observer = Heartbeat("the observer", round((observer_s or 0.0) * 1e9))
        self.vr = Heartbeat("the link to the virtual world", LINK_SILENT_NS)
        self.request = Heartbeat("the request", LINK_SILENT_NS)
        self._needed = [
            beat
            for beat, is_needed in ((self.arm, arm), (self.observer, observer_s is not None))
            if is_needed
        ]

    def lost(self, now_ns: int) -> str | None:
        """Why the base has to be stopped until a reset."""
        return next(filter(None, (beat.lost(now_ns) for beat in self._needed)), None)

    def awaited(self) -> str | None:
        """Which link has not been heard yet, so that nothing may move."""
        for beat in self._needed:
            if not beat.was_well:
                return beat.fault or f"{beat.name} has not been heard"
        return None

    def may_ask(self, now_ns: int) -> bool:
        """True if the end of a request would be heard: VR link and request are fresh."""
        return all(beat.is_fresh(now_ns) and beat.fault is None for beat in (self.vr, self.request))
