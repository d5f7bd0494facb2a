"""How old, how late and how strange an input may be: all figures of the drivers, in one place.

What a person's pose may be used for by its age is decided where it is used: by the safety chain,
`hw.safety.limits` (50, 150 and 500 ms). Here is what is refused before that.
"""

from __future__ import annotations

MS = 1_000_000

AHEAD_NS = 20 * MS
"""A stamp may be so far in the future, as clocks differ."""
PREDICTED_NS = 50 * MS
"""The same where poses are predicted for the instant at which they are seen."""
FROZEN_NS = 100 * MS
"""A pose that repeats bit by bit for so long is lost tracking, though messages flow."""
STEP_NS = 5 * MS
"""The offset between two clocks moves by less than this, or is estimated anew."""
WINDOW_NS = 10_000 * MS
"""The offset is estimated from what came within this time."""
SETTLING_NS = 500 * MS
"""An offset counts so long after its first stamp; until then it is a first guess."""
TURNED_BACK = 20
"""So many stamps in a row that do not rise are another clock."""
BACKLOG_NS = 300 * MS
"""Data that is so old when read has queued up: the connection is closed, and made anew."""
BACKLOGGED_NS = 200 * MS
"""It is a queue, and no single late packet, if it lasts so long."""
ONE_WAY_NS = 2 * MS
"""Least time on the way, which an offset from one direction alone cannot see: added to ages."""
JUMP, FASTEST = 0.15, 5.0
"""Nobody is further away than this than a moment ago, m and m/s: tracking that was found again
differs by some centimetres, people in a room are slower."""
FOUND_AGAIN_NS = 600 * MS
"""Somebody seen elsewhere for so long is there; by then the safety chain has latched."""
FRESH_NS = 150 * MS
"""Two poses of one person belong together if they are no further apart than this."""
LINK_SILENT_NS = 500 * MS
"""A process that tells its state every 100 ms is gone after so much silence."""
KEEPALIVE_NS = 500 * MS
"""So often an idle TCP link is written to."""
CLIENT_SILENT_NS = 3_000 * MS
"""A client of the VR link is gone after so much silence; it speaks once a second."""
