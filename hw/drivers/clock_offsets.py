"""The offset of another machine's clock, and checks of its stamps.

`offset` is our clock minus theirs, ns: a stamp of theirs plus the offset is an instant of ours. A
client that answers is asked for its time: the fastest of many round trips is used, and its error is
at most half its duration. From a client that cannot answer there are only stamps: then the least
(receipt - stamp) within WINDOW_NS is the offset, too large by the least transmission time, which is
added to ages.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from hw.drivers.gates import (
    AHEAD_NS,
    BACKLOG_NS,
    BACKLOGGED_NS,
    MS,
    ONE_WAY_NS,
    SETTLING_NS,
    STEP_NS,
    TURNED_BACK,
    WINDOW_NS,
)


class ClockOffset(NamedTuple):
    """Our clock minus theirs, ns, and a bound on its error, ns."""

    ns: int
    error_ns: int


class Envelope:
    """The offset from stamps alone, as the lower envelope of (receipt - stamp).

    A value STEP_NS or more below the previous least is accepted only while the estimate is young
    (SETTLING_NS), or once it has persisted for that long: then their clock was set.
    """

    def __init__(self) -> None:
        self._lows: deque[tuple[int, int]] = deque()  # (receipt, difference), differences rising
        self._first_ns: int | None = None
        self._below_ns: int | None = None

    @property
    def offset_ns(self) -> int | None:
        """The least difference in the window; None before the first stamp."""
        return self._lows[0][1] if self._lows else None

    @property
    def settled(self) -> bool:
        """True once it was observed for SETTLING_NS."""
        return bool(self._lows) and not self._is_young(self._lows[-1][0])

    def add_stamp(self, stamp_ns: int, received_ns: int) -> bool:
        """Take a stamp; False if it steps ahead of all others, and does not count."""
        lows, difference = self._lows, received_ns - stamp_ns
        while lows and lows[0][0] < received_ns - WINDOW_NS:
            lows.popleft()
        if self._first_ns is None:
            self._first_ns = received_ns
        if lows and not self._is_young(received_ns) and difference < lows[0][1] - STEP_NS:
            if self._below_ns is None:
                self._below_ns = received_ns
            if received_ns - self._below_ns < SETTLING_NS:
                return False
            self.reset()
            self._first_ns = received_ns
        self._below_ns = None
        while lows and lows[-1][1] >= difference:
            lows.pop()
        lows.append((received_ns, difference))
        return True

    def reset(self) -> None:
        """Start over."""
        self._lows.clear()
        self._first_ns = self._below_ns = None

    def _is_young(self, now_ns: int) -> bool:
        return self._first_ns is None or now_ns - self._first_ns < SETTLING_NS


class StampedClock:
    """The clock of a peer that sends stamps alone, by one or several sources; it may be set.

    Stamps that step back, or ahead of all others, do not count: `set_by_ns` says how far their
    clock seems to have been set, forward if positive. Once they have gone on for SETTLING_NS,
    rising, their clock counts anew by its estimate of that time: no guess of a first moment makes
    an old message young.
    """

    def __init__(self) -> None:
        self.set_by_ns: int | None = None
        self._clock, self._next = Envelope(), Envelope()
        self._last: dict[str, int] = {}

    def instant(self, stamp_ns: int, received_ns: int, source: str = "") -> int | None:
        """A stamp by our clock, ns; None if it is repeated, or does not count."""
        last, offset = self._last.get(source), self._clock.offset_ns
        if last is not None and last - STEP_NS <= stamp_ns <= last:
            return None
        self._last[source], difference = stamp_ns, received_ns - stamp_ns
        back = last is not None and stamp_ns < last
        if offset is None:
            return self._by_clock(stamp_ns, received_ns)
        if self.set_by_ns is None:
            ahead = self._clock.settled and difference < offset - STEP_NS
            if not back and not ahead:
                return self._by_clock(stamp_ns, received_ns)
        elif abs(difference - offset) <= abs(self.set_by_ns - (offset - difference)):
            return self._by_clock(stamp_ns, received_ns)
        if back or self.set_by_ns is None:
            self._next.reset()
        self._next.add_stamp(stamp_ns, received_ns)
        self.set_by_ns = offset - (self._next.offset_ns or 0)
        if not self._next.settled:
            return None
        self._clock, self._next, self._last = self._next, Envelope(), {source: stamp_ns}
        return self._by_clock(stamp_ns, received_ns)

    def _by_clock(self, stamp_ns: int, received_ns: int) -> int | None:
        self.set_by_ns = None
        fits, offset = self._clock.add_stamp(stamp_ns, received_ns), self._clock.offset_ns
        return stamp_ns + offset if fits and offset is not None else None


def set_by(step_ns: int) -> str:
    """How far a clock was set, such as `was set back by 3.2 s`."""
    size = abs(step_ns)
    told = f"{1e-9 * size:.1f} s" if size >= 1_000 * MS else f"{1e-6 * size:.0f} ms"
    return f"was set {'forward' if step_ns > 0 else 'back'} by {told}"


class RoundTrips:
    """The offset from questions and answers: that of the fastest round trip in the window."""

    def __init__(self) -> None:
        self._trips: deque[tuple[int, int, int]] = deque()  # (when, time on the way, offset)

    @property
    def best(self) -> ClockOffset | None:
        """The offset by the fastest round trip; None without an answer."""
        if not self._trips:
            return None
        _, way, offset = min(self._trips, key=lambda trip: trip[1])
        return ClockOffset(offset, way // 2)

    def add(self, asked: int, came: int, answered: int, received: int) -> None:
        """Take a round trip: sent and received by our clock, came and answered by theirs, ns.

        With d = (received - asked) - (answered - came) on the way, the offset is the mean of
        asked - came and received - answered, and wrong by d / 2 at most. An answer that contradicts
        the fastest by more than both errors and STEP_NS means a clock that was set: earlier round
        trips are dropped.
        """
        trips = self._trips
        way = (received - asked) - (answered - came)
        if way < 0 or answered < came:
            return
        offset = ((asked - came) + (received - answered)) // 2
        best = self.best
        if best is not None and abs(offset - best.ns) > way // 2 + best.error_ns + STEP_NS:
            trips.clear()
        while trips and trips[0][0] < received - WINDOW_NS:
            trips.popleft()
        trips.append((received, way, offset))

    def reset(self) -> None:
        """Start over."""
        self._trips.clear()


class PeerClock:
    """The clock of one client: by its answers if there are any, else by its stamps."""

    def __init__(self, one_way_ns: int = ONE_WAY_NS) -> None:
        self.trips, self._envelope = RoundTrips(), Envelope()
        self._one_way_ns = one_way_ns
        self._late_since: int | None = None
        self.backlogged = False
        self.age_ns = 0

    @property
    def offset(self) -> ClockOffset | None:
        """The offset; None while unknown."""
        best = self.trips.best
        if best is not None:
            return best
        least = self._envelope.offset_ns
        return None if least is None else ClockOffset(least - self._one_way_ns, self._one_way_ns)

    @property
    def known(self) -> bool:
        """True once the offset can be used."""
        return self.trips.best is not None or self._envelope.settled

    def instant(self, stamp_ns: int, received_ns: int) -> int | None:
        """A stamp of theirs by our clock, ns; None if it fits nothing known of their clock."""
        fits = self._envelope.add_stamp(stamp_ns, received_ns)
        offset = self.offset
        if offset is None or (self.trips.best is None and not (fits and self._envelope.settled)):
            return None
        at = stamp_ns + offset.ns
        self.age_ns = received_ns - at
        self._look_for_backlog(received_ns)
        return at

    def reset(self) -> None:
        """Their clock was set: start over."""
        self.trips.reset()
        self._envelope.reset()
        self._late_since, self.backlogged = None, False

    def _look_for_backlog(self, received_ns: int) -> None:
        """Detect data that was old on arrival for a while: it has queued up on the way."""
        if self.age_ns <= BACKLOG_NS:
            self._late_since = None
        elif self._late_since is None:
            self._late_since = received_ns
        elif received_ns - self._late_since > BACKLOGGED_NS:
            self.backlogged = True


class Stamps:
    """Checks stamps of one topic: not from the future, and strictly rising.

    `refused` says why the last one was refused, `turned_back` whether their clock was set back.
    """

    def __init__(self, ahead_ns: int = AHEAD_NS) -> None:
        self._ahead_ns = ahead_ns
        self._newest: int | None = None
        self._received_ns = 0
        self._back = 0
        self.refused: str | None = None

    @property
    def turned_back(self) -> bool:
        """True if stamps have not risen TURNED_BACK times in a row."""
        return self._back >= TURNED_BACK

    def admit(self, stamp_ns: int, at_ns: int | None, received_ns: int) -> bool:
        """Check a stamp of theirs, and its instant by our clock."""
        self.refused = self._why_not(stamp_ns, at_ns, received_ns)
        if self.refused is None:
            self._newest, self._received_ns, self._back = stamp_ns, received_ns, 0
        return self.refused is None

    def reset(self) -> None:
        """Start over."""
        self._newest, self._back, self.refused = None, 0, None

    def _why_not(self, stamp_ns: int, at_ns: int | None, received_ns: int) -> str | None:
        newest = self._newest
        step_ns = 0 if newest is None else stamp_ns - newest - (received_ns - self._received_ns)
        if newest is not None and stamp_ns <= newest:
            self._back += 1
            if stamp_ns < newest - STEP_NS:
                return f"their clock {set_by(step_ns)}"
            return "its stamp is not after the one before"
        if at_ns is None:
            known = f"their clock {set_by(step_ns)}"
            return known if step_ns > STEP_NS else "it does not fit to their clock"
        if at_ns > received_ns + self._ahead_ns:
            if step_ns > self._ahead_ns:
                return f"their clock {set_by(step_ns)}"
            return f"its stamp is {(at_ns - received_ns) * 1e-6:.1f} ms in the future"
        return None
