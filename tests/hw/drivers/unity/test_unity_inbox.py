"""What is made of poses and requests of a VR application, and what is refused."""

import math
from types import SimpleNamespace

import pytest

from hw.drivers import gates
from hw.drivers.clock_offsets import PeerClock
from hw.drivers.unity.inbox import Checks, Inbox
from hw.geometry import Pose2, Pose3
from hw.model.tracking import Tracking
from hw.samples import TrackerPose, UserPose

MS = 1_000_000
HEAD, BODY = Pose3.from_yaw(2.0, 3.0, 1.7, 0.5), Pose3.from_yaw(2.0, 3.0, 1.0, 0.2)
DEEP = Pose3.from_yaw(2.8, 3.0, 1.5, 0.0)
MAP_FROM_VIVE = Pose3.from_yaw(1.0, -2.0, 0.0, math.pi / 2.0)
MOUNTS = {"front": Pose3(0.4, 0.3, 0.5), "rear": Pose3.from_yaw(-0.4, -0.3, 0.5, math.pi)}
SAID = SimpleNamespace(data=True)


def stamped(pose: Pose3, at_ns: int, frame: str = "map") -> SimpleNamespace:
    """A PoseStamped by somebody whose clock is ours."""
    stamp = SimpleNamespace(sec=at_ns // 10**9, nanosec=at_ns % 10**9)
    there = SimpleNamespace(
        position=SimpleNamespace(x=pose.x, y=pose.y, z=pose.z),
        orientation=SimpleNamespace(x=pose.qx, y=pose.qy, z=pose.qz, w=pose.qw),
    )
    return SimpleNamespace(header=SimpleNamespace(stamp=stamp, frame_id=frame), pose=there)


def shaken(pose: Pose3, n: int) -> Pose3:
    return Pose3(pose.x, pose.y, pose.z + n * 1e-6, pose.qx, pose.qy, pose.qz, pose.qw)


class Rig:
    """An inbox with a clock that is known to be ours, and what it has told."""

    def __init__(self, **checks: object) -> None:
        self.told: list[tuple[str, int, object]] = []
        tracking = checks.pop("tracking", Tracking(mounts=MOUNTS))
        self.inbox = Inbox(Checks(tracking, **checks), lambda *told: self.told.append(told))
        self.clock, self.now, self.n = PeerClock(), 5 * 10**9, 0
        self.clock.trips.add(self.now, self.now + 1, self.now + 1, self.now + 2)

    def give(self, role: str, pose: Pose3, age_ns: int = 0, frame: str = "map") -> str | None:
        self.n += 1
        message = stamped(shaken(pose, self.n), self.now - age_ns, frame)
        return self.inbox.on_message(role, message, self.now, self.clock)

    def stand(self) -> None:
        self.now += 11 * MS
        assert self.give("head", HEAD) is None
        assert self.give("tailbone", BODY) is None

    def values(self, name: str) -> list[object]:
        return [value for known, _, value in self.told if known == name]


@pytest.mark.requirement(7, 13, 14)
def test_a_person_is_the_tailbone_on_the_floor_with_head_and_hands() -> None:
    rig = Rig()
    rig.give("head", HEAD)
    rig.give("left_hand", Pose3(2.3, 3.2, 1.1))
    rig.give("right_hand", Pose3(2.3, 2.8, 1.1))
    assert rig.give("tailbone", BODY, age_ns=3 * MS) is None

    [(name, stamp, person)] = rig.told
    assert (name, stamp) == ("user.pose", rig.now - 3 * MS)
    assert isinstance(person, UserPose)
    assert (person.body.x, person.body.y) == (2.0, 3.0)
    assert (person.body.yaw, person.head_yaw) == (pytest.approx(0.2), pytest.approx(0.5))
    assert person.head is not None
    assert person.head.z == pytest.approx(1.7, abs=1e-4)
    assert person.left_hand is not None
    assert person.left_hand.y == 3.2
    assert person.right_hand is not None


@pytest.mark.parametrize(("age_ms", "told"), [(30, True), (40, False)])
def test_a_hand_of_an_earlier_instant_than_the_body_is_none(age_ms: int, told: bool) -> None:
    rig = Rig()
    rig.give("left_hand", Pose3(2.3, 3.2, 1.1))
    rig.now += age_ms * MS
    rig.give("head", HEAD)
    assert rig.give("tailbone", BODY) is None

    [person] = rig.values("user.pose")
    assert (person.left_hand is not None) == told


def test_poses_of_the_tracking_frame_are_brought_to_the_map() -> None:
    rig = Rig(tracking=Tracking(MAP_FROM_VIVE, MOUNTS))
    there = MAP_FROM_VIVE.inverse()
    rig.give("head", there @ HEAD, frame="vive")
    rig.give("tailbone", there @ BODY, frame="/vive")
    rig.inbox.on_message(
        "haptic_request", stamped(there @ DEEP, rig.now, "vive"), rig.now, rig.clock
    )

    [person] = rig.values("user.pose")
    assert person.body.x == pytest.approx(2.0)
    assert person.body.y == pytest.approx(3.0)
    assert person.head_yaw == pytest.approx(0.5)
    [deep] = rig.values("vr.haptic_request")
    assert deep.distance_to(DEEP) < 1e-9


def test_trackers_stay_in_the_frame_of_the_tracking_system() -> None:
    rig = Rig(tracking=Tracking(MAP_FROM_VIVE, MOUNTS))
    seen = Pose3(1.0, 2.0, 0.5)
    rig.give("tracker:front", seen, frame="vive")
    rig.give("tracker:front", MAP_FROM_VIVE @ seen, frame="map")  # another stamp would be needed
    rig.now += MS
    rig.give("tracker:front", MAP_FROM_VIVE @ seen, frame="map")

    for tracker in rig.values("rover.tracker"):
        assert isinstance(tracker, TrackerPose)
        assert tracker.tracker == "front"
        assert tracker.pose.distance_to(seen) < 1e-4
    assert len(rig.values("rover.tracker")) == 2


def test_a_pose_of_another_frame_is_refused() -> None:
    assert Rig().give("head", HEAD, frame="odom") == "frame 'odom'; write 'vive' or 'map'"


def test_a_pose_without_a_stamp_is_refused_unless_receipts_are_to_count() -> None:
    message = stamped(BODY, 0)
    rig = Rig()
    assert "no stamp" in str(rig.inbox.on_message("tailbone", message, rig.now, rig.clock))
    rig = Rig(by_receipt=True)
    rig.inbox.on_message("head", stamped(HEAD, 0), rig.now, rig.clock)
    assert rig.inbox.on_message("tailbone", message, rig.now, rig.clock) is None
    assert rig.told[0][1] == rig.now - gates.ONE_WAY_NS


@pytest.mark.requirement(149)
@pytest.mark.parametrize(
    ("ahead_ms", "allowed_ms", "used"),
    [(19, 20, True), (21, 20, False), (49, 50, True), (51, 50, False), (-15, 20, True)],
)
def test_poses_of_the_future_are_refused_and_others_told_with_their_age(
    ahead_ms, allowed_ms, used
) -> None:
    rig = Rig(ahead_ns=allowed_ms * MS)
    rig.stand()
    rig.told.clear()
    rig.now += 20 * MS
    assert (rig.give("tailbone", BODY, age_ns=-ahead_ms * MS) is None) is used
    stamp = rig.now + min(ahead_ms, 0) * MS
    assert [at for _, at, _ in rig.told] == ([stamp] if used else [])


def test_stamps_that_go_back_for_long_begin_a_new_clock() -> None:
    rig = Rig()
    rig.stand()
    for _ in range(gates.TURNED_BACK):
        assert rig.give("tailbone", BODY, age_ns=10**9) is not None
    assert not rig.clock.known


def test_a_pose_that_repeats_bit_by_bit_is_lost_tracking() -> None:
    rig = Rig()
    rig.stand()
    frozen = None
    begin, tailbone = rig.now, shaken(BODY, 999)
    while frozen is None:
        rig.now += 11 * MS
        assert rig.now - begin < 10**9
        rig.give("head", HEAD)
        message = stamped(tailbone, rig.now)
        frozen = rig.inbox.on_message("tailbone", message, rig.now, rig.clock)
    assert gates.FROZEN_NS < rig.now - begin - 11 * MS <= gates.FROZEN_NS + 11 * MS
    assert "bit by bit" in frozen
    rig.told.clear()
    rig.stand()
    assert len(rig.values("user.pose")) == 1


def test_a_frozen_or_old_head_is_no_head() -> None:
    rig = Rig()
    rig.stand()
    head = shaken(HEAD, 999)
    for _ in range(12):
        rig.now += 11 * MS
        rig.inbox.on_message("head", stamped(head, rig.now), rig.now, rig.clock)
        rig.give("tailbone", BODY)
    person = rig.values("user.pose")[-1]
    assert (person.head, person.head_yaw) == (None, person.body.yaw)
    rig.stand()
    assert rig.values("user.pose")[-1].head is not None
    rig.now += gates.FRESH_NS + MS
    rig.give("tailbone", BODY)
    assert rig.values("user.pose")[-1].head is None


@pytest.mark.parametrize(
    "turned", [lambda p: Pose3(-p.y, p.z, p.x), lambda p: Pose3(p.x * 1e3, p.y * 1e3, p.z * 1e3)]
)
def test_nobody_is_tracked_before_they_stood_upright_in_metres_with_z_upwards(turned) -> None:
    rig = Rig()
    rig.give("head", turned(HEAD))
    reason = rig.give("tailbone", turned(BODY))
    assert "To<FLU>()" in str(reason)
    assert rig.told == []


@pytest.mark.parametrize("role", ["tailbone", "haptic_request", "tracker:front"])
def test_a_pose_that_no_room_has_is_refused(role) -> None:
    """Finite, but sums of such numbers are not."""
    rig = Rig()
    rig.stand()
    rig.give("haptic_request", DEEP)
    rig.told.clear()
    for _ in range(100):  # for longer than a person who was found again elsewhere needs
        rig.now += 11 * MS
        rig.give("head", Pose3(1e308, -1e308, 1.7))
        assert "m away" in str(rig.give(role, Pose3(1e308, -1e308, 1.0)))
    assert {value for name, _, value in rig.told} <= {None}


def test_who_has_stood_upright_once_may_bend_down() -> None:
    rig = Rig()
    rig.stand()
    rig.now += MS
    rig.give("head", Pose3(2.6, 3.0, 0.9))
    assert rig.give("tailbone", BODY) is None
    rig.inbox.drop("tailbone", rig.now)
    rig.now += MS
    assert rig.give("tailbone", BODY) is not None


@pytest.mark.requirement(15)
def test_a_request_is_a_level_until_it_is_let_go() -> None:
    rig = Rig()
    rig.stand()
    assert rig.give("haptic_request", DEEP) is None
    rig.inbox.repeat(rig.now)
    assert rig.inbox.on_message("release", SAID, rig.now, rig.clock) is None
    rig.inbox.repeat(rig.now)
    asked = rig.values("vr.haptic_request")
    assert [deep is None for deep in asked] == [False, False, True, True]
    assert rig.values("vr.release") == [True]
    assert rig.inbox.on_message("restart", SAID, rig.now, rig.clock) is None
    assert rig.values("vr.restart") == [True]


def test_an_event_that_says_false_is_none() -> None:
    rig = Rig()
    rig.inbox.on_message("release", SimpleNamespace(data=False), rig.now, rig.clock)
    assert rig.told == []
    rig.inbox.on_message("release", SimpleNamespace(), rig.now, rig.clock)  # std_msgs/Empty
    assert rig.values("vr.release") == [True]


@pytest.mark.requirement(15)
@pytest.mark.parametrize(
    ("deep", "frame"),
    [
        (Pose3(math.nan, 3.0, 1.5), "map"),
        (Pose3(2.0, 3.0, 1.5, 0.0, 0.0, 0.0, 2.0), "map"),
        (Pose3(2800.0, 3000.0, 1500.0), "map"),
        (Pose3(2.8, 3.0, 3.5), "map"),
        (Pose3(6.0, 3.0, 1.5), "map"),
        (DEEP, "unity"),
    ],
)
def test_a_deep_that_is_none_ends_the_request_before(deep, frame) -> None:
    rig = Rig()
    rig.stand()
    rig.give("haptic_request", DEEP)
    assert rig.give("haptic_request", deep, frame=frame) is not None
    assert rig.values("vr.haptic_request")[-1] is None
    assert rig.inbox.request is None


def test_a_request_ends_with_whoever_asked() -> None:
    rig = Rig()
    rig.stand()
    rig.give("haptic_request", DEEP)
    rig.inbox.drop("haptic_request", rig.now)
    assert rig.values("vr.haptic_request")[-1] is None


@pytest.mark.requirement(8, 12)
def test_two_trackers_have_to_sit_on_the_rover_as_its_file_says() -> None:
    rover = Pose3.from_yaw(2.0, 1.0, 0.0, 0.7)
    rig = Rig()
    assert rig.give("tracker:front", rover @ MOUNTS["front"]) is None
    mirrored = rover @ MOUNTS["rear"]
    mirrored = Pose3(mirrored.x, -mirrored.y, mirrored.z, 0.0, 0.0, -mirrored.qz, mirrored.qw)
    assert "contradict their mounts on the rover" in str(rig.give("tracker:rear", mirrored))
    rig.now += 10 * MS
    assert rig.give("tracker:front", rover @ MOUNTS["front"]) is not None
    assert rig.give("tracker:rear", rover @ MOUNTS["rear"]) is None
    rig.now += 10 * MS
    jumped = Pose3(0.5, 0.0, 0.0) @ rover @ MOUNTS["front"]
    assert rig.give("tracker:front", jumped) is None  # a jump is for localization to find


def test_one_tracker_alone_is_believed() -> None:
    rig = Rig()
    for _ in range(5):
        rig.now += 10 * MS
        assert rig.give("tracker:rear", MOUNTS["rear"]) is None
    assert len(rig.values("rover.tracker")) == 5


def test_the_yaw_of_a_person_is_the_tailbone_s_even_if_it_is_tilted() -> None:
    rig = Rig()
    rig.stand()
    rig.now += MS
    tilted = BODY @ Pose3(0.0, 0.0, 0.0, 0.0, math.sin(0.15), 0.0, math.cos(0.15))
    rig.give("tailbone", tilted)
    body = rig.values("user.pose")[-1].body
    assert isinstance(body, Pose2)
    assert body.yaw == pytest.approx(0.2)


def test_somebody_who_is_elsewhere_all_of_a_sudden_is_believed_once_they_stay_there() -> None:
    rig = Rig()
    rig.stand()
    begin, count = rig.now, len(rig.values("user.pose"))
    while len(rig.values("user.pose")) == count:
        rig.now += 11 * MS
        reason = rig.give("tailbone", Pose3(5.0, 3.0, 1.0))
        assert rig.now - begin < 10**9
        assert reason is None or "jumped" in reason
    assert rig.now - begin > gates.FOUND_AGAIN_NS
    rig.now += 11 * MS
    assert "jumped" in str(rig.give("tailbone", BODY))
    rig.now += 11 * MS
    assert rig.give("tailbone", Pose3(5.01, 3.0, 1.0)) is None


@pytest.mark.parametrize("step", [0.14, 0.04])
def test_tracking_that_is_found_again_a_little_aside_is_no_jump(step) -> None:
    rig = Rig()
    rig.stand()
    rig.now += 11 * MS
    assert rig.give("tailbone", Pose3(2.0 + step, 3.0, 1.0)) is None


def test_nobody_runs_away_from_being_tracked() -> None:
    rig = Rig()
    rig.stand()
    for n in range(100):
        rig.now += 11 * MS
        assert rig.give("tailbone", Pose3(2.0 + n * 0.011 * 5.0, 3.0, 1.0)) is None
