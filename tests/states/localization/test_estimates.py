"""Estimated poses as signals: of one age, silent while the robot is lost."""

from behaviors.signal_table import ESTIMATE, localized
from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare
from hw.geometry import STILL, Pose2
from hw.samples import Odometry, PoseSigma

MS = 1_000_000


class Follower:
    """Takes the wheels at their word, and is lost beyond 5 m."""

    def __init__(self):
        self.pose, self.sigma, self.stamp_ns = None, PoseSigma(0.0, 0.0), None
        self.heard = []
        self.status, self.drift, self.counts = "following", None, {}

    def take(self, stamp_ns, value):
        self.heard.append(stamp_ns)
        if isinstance(value, Odometry):
            if value.pose != self.pose:
                self.pose = value.pose if value.pose.x < 5.0 else None
            self.stamp_ns = stamp_ns


class Rig:
    def __init__(self, wanted=("base.pose", "base.pose_sigma")):
        self.localizer = Follower()
        self.board = Board(declare(localized(lambda: self.localizer)), wanted)
        self.now = 0

    def tick(self, x, stamp=None):
        self.now += 33 * MS
        at = self.now if stamp is None else stamp
        self.board.put("base.odometry", Odometry(Pose2(x, 0.0), STILL), at)
        self.board.begin(self.now)

    def read(self, name):
        return self.board.slots[name].read()


def test_pose_and_sigma_are_those_of_one_estimate():
    rig = Rig()
    rig.tick(1.0)
    pose, sigma = rig.read("base.pose"), rig.read("base.pose_sigma")
    assert pose.value == Pose2(1.0, 0.0)
    assert sigma.value == PoseSigma(0.0, 0.0)
    assert pose.stamp == sigma.stamp == rig.now


def test_every_sample_is_taken_once_whoever_reads():
    rig = Rig()
    for k in range(5):
        rig.tick(0.1 * k)
        rig.read("base.pose")
        rig.read(ESTIMATE)
    assert len(rig.localizer.heard) == 5


def test_while_nothing_changes_the_pose_is_the_same_object_and_gets_no_older():
    rig = Rig()
    rig.tick(1.0)
    first = rig.read("base.pose")
    rig.tick(1.0)
    again = rig.read("base.pose")
    assert again.value is first.value
    assert again.stamp == rig.now


def test_a_lost_robot_has_no_estimate_and_its_last_pose_gets_old():
    rig = Rig()
    rig.tick(1.0)
    then = rig.now
    rig.tick(9.0)
    assert rig.read(ESTIMATE) is None
    assert rig.read("base.pose").stamp == then
    rig.tick(2.0)
    assert rig.read("base.pose").value == Pose2(2.0, 0.0)


def test_nothing_is_estimated_unless_somebody_asks():
    rig = Rig(wanted=())
    rig.tick(1.0)
    assert ESTIMATE not in rig.board.slots
    assert rig.localizer.heard == []


def test_measured_signals_are_all_there_but_for_the_pose():
    named = {signal.name: signal for signal in localized(Follower)}
    assert not isinstance(named["base.pose"], Measured)
    assert isinstance(named["rover.tracker"], Measured)


def test_of_many_estimates_between_two_reads_the_newest_one_is_the_pose():
    rig = Rig()
    for k in range(5):
        rig.tick(0.1 * k)
        rig.read(ESTIMATE)
    assert rig.read("base.pose") == (Pose2(0.4, 0.0), rig.now)
    assert rig.board.slots["base.pose"].evaluated == 1
    assert len(rig.localizer.heard) == 5
