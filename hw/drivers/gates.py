"""Limits on the age, silence and plausibility of inputs: the figures of all drivers.

How a person's pose may be used at its age is decided by the safety chain (`hw.safety.limits`: 50,
150 and 500 ms, the first two from `hw.samples`). Here is what is refused before that, and when a
link or device counts as lost.
"""

from __future__ import annotations

from hw.samples import OLD_NS

MS = 1_000_000

# stamps and clocks
AHEAD_NS = 20 * MS
"""A stamp may be this far in the future, as clocks differ."""
PREDICTED_NS = 50 * MS
"""The same for poses that are predicted for the instant at which they are displayed."""
STEP_NS = 5 * MS
"""A change of the offset between two clocks beyond this starts a new estimate."""
WINDOW_NS = 10_000 * MS
"""Window of data over which the offset between two clocks is estimated."""
SETTLING_NS = 500 * MS
"""Time from the first stamp until an offset counts; before it is a first guess."""
TURNED_BACK = 20
"""This many stamps in a row that do not rise mean that the clock was set."""
ONE_WAY_NS = 2 * MS
"""Least transmission time, added to ages: an offset from one direction alone cannot see it."""

# the VR link
FROZEN_NS = 100 * MS
"""A pose that repeats bit by bit for longer is lost tracking, though messages arrive."""
BACKLOG_NS = 300 * MS
"""Data this old when read has queued up: the connection is closed and reopened."""
BACKLOGGED_NS = 200 * MS
"""Time for which data must be that old, so that a single late packet is no queue."""
JUMP, FASTEST = 0.15, 5.0
"""Greatest distance from the pose before, m, plus m/s times the elapsed time: tracking that was
re-acquired differs by some centimetres, people in a room are slower."""
FOUND_AGAIN_NS = 600 * MS
"""A person seen elsewhere for longer is taken to be there; the safety chain has latched by then."""
FRESH_NS = 150 * MS
"""Greatest difference of the stamps of two poses that belong to one person's pose."""
HAND_NS = 35 * MS
"""The same of a hand: the way that it may have gone since, 7 cm at 2 m/s, is counted by nobody."""
LINK_SILENT_NS = 500 * MS
"""Silence after which a process that reports its state every 100 ms is lost."""
KEEPALIVE_NS = 500 * MS
"""Period at which an idle TCP link is written to."""
CLIENT_SILENT_NS = 3_000 * MS
"""Silence after which a client of the VR link is lost; it writes once a second."""
CLIENT_QUIET_NS = 1_200 * MS
"""A client of the VR link that writes nothing for longer is not alive: one that has connected from
its address since takes over its topics, and its place may be given to another."""
UNREGISTERED_NS = 10_000 * MS
"""Time after which a client of the VR link that has registered nothing is let go."""
PARTING_NS = 200 * MS
"""Time for a client of the VR link to read why its link is closed."""
SHOWN_OLD_NS = 200 * MS
"""A pose of the robot older than this is shown as it is, without extrapolation."""

# scanners
SCAN_SILENT_NS = 400 * MS
"""Time without a valid scan after which a scanner is a fault: five turns of an S300."""

# the safety chain
CHAIN_SILENT_NS = 100 * MS
"""Silence after which the engine takes the chain for lost; it reports every 20 ms."""
OBSERVER_HEARD_NS = 1_000 * MS
"""Silence after which an observer's program says that the chain does not answer."""
OBSERVER_STOPS_NS = 700 * MS
"""For so long an observer who stops says nothing else: longer than any chain waits for them."""
ARM_SILENT_NS = 50 * MS
"""Silence after which the chain takes the link to the arm for lost: two of its periods of 24 ms."""

# the UR arm
TICK_FRESH_NS = 80 * MS
"""A message of the engine allows set-points for this long after the tick it is stamped by."""
ENGINE_GONE_NS = 500 * MS
"""Silence after which the engine is gone."""
CONTROLLER_STALE_NS = 50 * MS
"""A controller whose own time does not advance for longer is lost."""
JOINTS_LATE_NS = 24 * MS
"""Joints that arrive later than this after the ones before are counted as late."""
WORKER_SILENT_NS = 80 * MS
"""Silence after which the arm's worker process is killed, if several looks confirm it."""
WRENCH_SILENT_NS = 200 * MS
"""Silence after which the force at the tool is not known, and the robot stops."""

# wheels and bumper
ODOMETRY_OLD_NS = OLD_NS
"""Odometry of an RB-KAIROS older than this is a fault; it sends a message every 10 ms."""
HEARTBEAT_NS = 150 * MS
"""A CAN drive whose heartbeat is older is dead; it sends one every 50 ms."""
VELOCITY_NS = 50 * MS
"""A CAN drive whose status and velocity are older is frozen; they come every 10 ms."""
CAN_ERRORS, CAN_ERRORS_NS = 16, 1_000 * MS
"""More error frames of a CAN bus than this, in this time, stop: 16 of 8 points each make a sender
error-passive. Fewer are a warning."""
BUMPER_SILENT_NS = 60 * MS
"""Silence after which the bumper's board is lost: three of its frames."""
