"""Steps as tuples are those of poses, to the last bit; a trail is what a list of poses says."""

from __future__ import annotations

import math

from hypothesis import given, settings, strategies as st

from hw.geometry import STILL, Pose2, Twist2, displacement_of, velocity_of, wrap
from states.localization.wheels import steps
from states.localization.wheels.trail import REMEMBERED_NS, Trail

S = 1_000_000_000
POSES = st.builds(
    Pose2, st.floats(-20.0, 20.0), st.floats(-20.0, 20.0), st.floats(-7.0, 7.0)
)  # a yaw need not be wrapped


def of(pose: Pose2) -> steps.Planar:
    return steps.place_of(pose)


@given(POSES, POSES, st.floats(1e-3, 10.0))
@settings(deadline=None)
def test_steps_are_those_of_poses(a: Pose2, b: Pose2, time: float) -> None:
    assert steps.composed(of(a), of(b)) == of(a @ b)
    moved = a.inverse() @ b
    assert steps.step(of(a), of(b)) == of(moved)
    velocity = velocity_of(moved, time)
    assert steps.pace(of(moved), time) == (velocity.vx, velocity.vy, velocity.wz)
    twist = Twist2(a.x, a.y, b.yaw)
    assert steps.way((a.x, a.y, b.yaw), time) == of(displacement_of(twist, time))
    assert steps.wrapped(b.x) == wrap(b.x)


class PlainTrail:
    """All poses since the last reset in a list, and a search from its end."""

    def __init__(self) -> None:
        self.poses: list[tuple[int, Pose2]] = []
        self.velocity = STILL

    def add(self, stamp: int, pose: Pose2) -> None:
        if self.poses:
            last_ns, last = self.poses[-1]
            if stamp <= last_ns:
                return
            time = (stamp - last_ns) * 1e-9
            if math.hypot(pose.x - last.x, pose.y - last.y) > 3.0 + 20.0 * time:
                self.poses, self.velocity = [], STILL
            else:
                found = velocity_of(last.inverse() @ pose, time)
                if math.hypot(found.vx, found.vy) < 20.0 and abs(found.wz) < 30.0:
                    self.velocity = found
        self.poses.append((stamp, pose))

    def at(self, stamp: int) -> Pose2 | None:
        if not self.poses:
            return None
        last_ns, last = self.poses[-1]
        if stamp >= last_ns:
            return last @ displacement_of(self.velocity, (stamp - last_ns) * 1e-9)
        for (a_ns, a), (b_ns, b) in zip(self.poses[-2::-1], self.poses[:0:-1], strict=True):
            if a_ns <= stamp:
                return a if stamp == a_ns else a.between(b, (stamp - a_ns) / (b_ns - a_ns))
        return None


STEPS = st.tuples(
    st.integers(-S // 100, S // 2),
    st.sampled_from([0.0, 0.01, -0.2, 1.0, 40.0]),
    st.sampled_from([0.0, 0.1, -3.0]),
)


@given(st.lists(STEPS, min_size=1, max_size=120), st.lists(st.floats(-0.1, 1.1), min_size=1))
@settings(deadline=None, max_examples=60)
def test_a_trail_is_what_a_list_of_poses_says(
    moves: list[tuple[int, float, float]], shares: list[float]
) -> None:
    trail, plain, stamp, pose = Trail(), PlainTrail(), 0, Pose2(0.0, 0.0)
    for later, ahead, turn in moves:
        stamp, pose = stamp + later, pose @ Pose2(ahead, 0.0, turn)
        trail.add_odometry(stamp, pose)
        plain.add(stamp, pose)
    newest = plain.poses[-1][0]
    assert (trail.stamp_ns, trail.pose) == plain.poses[-1]
    assert trail.last_velocity() == plain.velocity
    for share in shares:
        asked = newest - round((1.0 - share) * REMEMBERED_NS)
        if asked >= newest - REMEMBERED_NS:
            assert trail.at(asked) == plain.at(asked)


def test_a_long_trail_finds_room() -> None:
    trail = Trail()
    for n in range(5000):
        trail.add_odometry(n * S // 500, Pose2(0.001 * n, 0.0))
    assert trail.at(4998 * S // 500) == Pose2(0.001 * 4998, 0.0)
    assert trail.at(4999 * S // 500 - REMEMBERED_NS) is not None
    assert trail.at(2000 * S // 500) is None
