"""How well recent scans fit the map, and which mode that puts the localizer in.

`starting` -> `tracking` once the base has been found. `tracking` -> `doubtful` while few beams end
on walls; matching goes on, and a search of the map runs beside it. `doubtful` -> `tracking` when
matches recover or the search confirms or replaces the pose; -> `lost` after too long without a
fair match. `lost` -> `doubtful` or `tracking` when a tracker or the search gives a pose.
"""

from __future__ import annotations

from typing import Literal

from states.localization.matching.localizer_values import LocalizerValues
from states.localization.matching.scan_tracker import Match

LocalizerMode = Literal["starting", "tracking", "doubtful", "lost"]

BLIND_NS = 1_000_000_000
"""Without a fair match for this long, a search's earlier confirmation no longer counts."""
UNSEEN_NS = 1_000_000_000
"""Without scans for this long, trackers alone suffice to leave `starting`."""
LOST_SCANS = 10
"""Scans in a row without a fair match that make a base lost, however rarely they come."""
SMOOTHING = 0.05
"""Weight of each scan in the running mean of the share of beams on walls."""
MUCH_BETTER = 0.25
"""After `patience` bad matches a wider search must beat the near match by this share of beams."""
WORSE = 0.1
"""A match with this much less than the usual share of beams on walls may be a wrong one."""
BETTER = 0.1
"""A place found elsewhere must beat the running mean by this share of beams."""


class MatchHealth:
    """The mode of a localizer, from the matches that it reports."""

    def __init__(self, values: LocalizerValues) -> None:
        self._values = values
        self.mode: LocalizerMode = "starting"
        self.fair_ns = 0
        self.share = 1.0
        self._bad = self._good = self._unfair = self._elsewhere = 0
        self._sure_ns = -1

    def least_share_of_wider(self, near: Match) -> float:
        """Share of beams on walls above which a match from a wider search replaces `near`."""
        lasts = self._bad >= self._values.patience
        return near.share + MUCH_BETTER if lasts else self._values.plain

    def add_match(self, stamp_ns: int, found: Match, *, supported: bool, unsure: bool) -> bool:
        """Take a match; True if it begins a doubt, so that a search is to be started.

        `supported` is false if a running search finds the base elsewhere, or at several places;
        `unsure` is true if the prediction was of little help, or contradicted by matches before.
        """
        matching, odd = self._values.matching, unsure and self.is_worse(found)
        self.share += SMOOTHING * (found.share - self.share)
        self._unfair += 1
        if found.is_fair(matching):
            self.fair_ns, self._unfair = stamp_ns, 0
        healthy = found.is_healthy(matching) and not odd
        self._bad, self._good = (0, self._good + 1) if healthy else (self._bad + 1, 0)
        return self._change_mode(stamp_ns, supported, odd)

    def _change_mode(self, stamp_ns: int, supported: bool, odd: bool) -> bool:
        values = self._values
        good = supported and self.share >= values.plain and self._good >= values.patience
        poor = self.share < values.plain or self._bad >= values.patience
        odd = odd or self.is_blind(stamp_ns) or (poor and stamp_ns > self._sure_ns)
        if self.mode == "tracking" and odd:
            self.mode = "doubtful"
            self._elsewhere = 0
            return True
        if self.mode == "doubtful" and good:
            self.mode = "tracking"
        elif self.mode == "doubtful" and self._unfair >= LOST_SCANS:
            self.mode = "lost" if stamp_ns - self.fair_ns > values.lost_after * 1e9 else self.mode
        return False

    def is_worse(self, found: Match) -> bool:
        """True if a match has so much fewer beams on walls than usual that it may be wrong."""
        return found.share < self.share - WORSE

    def is_blind(self, stamp_ns: int) -> bool:
        """True if the last fair match is long ago."""
        return stamp_ns - self.fair_ns > BLIND_NS

    def given_up(self) -> None:
        """Note that the base is elsewhere, at one of several places."""
        self.mode = "lost"

    def confirmed(self, stamp_ns: int) -> None:
        """Note that a search found the base where it was thought to be; holds for `sure_for` s."""
        self._sure_ns = stamp_ns + round(self._values.sure_for * 1e9)
        self.mode, self._bad = "tracking", 0

    def relocated(self, stamp_ns: int, found: Match) -> None:
        """Note that a search has found the base elsewhere, and the pose was set to that place."""
        self.confirmed(stamp_ns)
        self.fair_ns, self.share = stamp_ns, found.share

    def placed(self, stamp_ns: int) -> None:
        """Note that a tracker has given a pose where there was none."""
        self.mode = "doubtful" if self.mode == "lost" else self.mode
        self.fair_ns = stamp_ns

    def blind(self, unseen_ns: int) -> None:
        """Note that a tracker has corrected the pose while the newest scan is `unseen_ns` old."""
        if self.mode == "starting" and unseen_ns > UNSEEN_NS:
            self.mode = "tracking"

    def is_elsewhere(self, found: Match) -> bool:
        """Count a place that fits better; True once `elsewhere` scans in a row have found one."""
        better = found.share >= self.share + BETTER
        self._elsewhere = self._elsewhere + 1 if better else 0
        return self._elsewhere >= self._values.elsewhere
