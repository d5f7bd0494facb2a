"""Delay and noise of what is measured; the truth stays what it is."""

import statistics

import pytest

from hw.geometry import Pose2, Pose3, Twist2
from hw.model.robot import MotionLimits, load_robot
from hw.model.sensor_model import SensorModel, WhiteNoise
from hw.people.live import LivePerson
from hw.samples import UserPose
from hw.scene.scene import load_scene
from hw.sim.world import World
from tests.hw.conftest import tick

ROBOT = load_robot("rbkairos_ur10")
HALL = load_scene("hall")
HERE = Pose2(30.0, 30.0, 1.0)


class Run:
    """A world whose person stands and whose robot turns as it drives; samples by name."""

    def __init__(self, count=60, asked=None, **sensors):
        person, self.got, self.truth = LivePerson(HERE), {}, []
        world = World(HALL, ROBOT, person, MotionLimits(1.0), sensors=SensorModel(**sensors))
        for n in range(count):
            person.push(tick(n), UserPose(HERE, 0.5, Pose3(30.0, 30.0, 1.7)))
            world.advance(tick(n))
            self.truth.append(world.base.pose)
            for name, part in world.parts.items():
                if asked is not None and name not in asked:
                    continue
                for sample in part.samples(tick(n)):
                    world.guard.hear(sample, tick(n))
                    self.got.setdefault(sample.name, []).append((tick(n), *sample[1:]))
            world.guard.drive(Twist2(0.3, 0.0, 0.4))
            world.guard.tick(tick(n))
        self.world = world

    def values(self, name):
        return [value for _, _, value in self.got[name]]


@pytest.mark.requirement(149)
@pytest.mark.parametrize(("delay", "ticks"), [(0.0, 0), (0.02, 1), (0.067, 3), (0.1, 3), (0.14, 5)])
def test_a_delayed_pose_arrives_later_with_the_stamp_of_when_it_was_seen(delay, ticks):
    run = Run(tracking_delay=delay)
    found = run.got["user.pose"]
    assert [stamp for _, stamp, _ in found] == [tick(n) for n in range(60 - ticks)]
    assert [arrived for arrived, _, _ in found] == [tick(n) for n in range(ticks, 60)]
    assert [stamp for _, stamp, _ in run.got["base.pose"]] == [tick(n) for n in range(60)]


@pytest.mark.requirement(149)
def test_the_chain_goes_by_delayed_poses_too():
    ages = []
    for delay in (0.0, 0.1):
        cycles = Run(tracking_delay=delay).world.guard.chain.cycles.reader().read_new()
        ages.append(max(record.user_age for record in cycles if record.user_age is not None))
    assert ages[1] - ages[0] == pytest.approx(0.1, abs=1e-6)


def test_no_pose_is_lost_where_the_world_moves_on_twice_between_two_looks():
    person = LivePerson(HERE)
    world = World(HALL, ROBOT, person, latency_ns=20_000_000)
    stamps = []
    for n in range(1, 10):
        for now in (tick(n), tick(n) + 20_000_000):
            person.push(now, UserPose(HERE, 0.0))
            world.advance(now)
        stamps += [stamp for _, stamp, _ in world.parts["trackers"].samples(now)]
    assert len(stamps) == 18
    assert stamps == sorted(stamps)


@pytest.mark.requirement(56)
def test_noise_is_on_the_samples_and_never_on_the_truth():
    ideal, noisy = Run(), Run(tracking_noise=0.02, pose_noise=0.01)
    assert noisy.truth == ideal.truth
    assert noisy.values("base.twist") == ideal.values("base.twist")
    assert noisy.world.person.body == HERE
    assert ideal.values("base.pose") == ideal.truth
    for measured, truth in zip(noisy.values("base.pose"), noisy.truth, strict=True):
        assert 0.0 < measured.distance_to(truth) < 0.06
    for seen in noisy.values("user.pose"):
        assert seen.body != HERE
        assert seen.head.z != 1.7
        assert seen.left_hand is None


def test_the_noise_is_as_large_as_it_is_said_to_be():
    noise = WhiteNoise(3, "base.pose", 0.02)
    errors = [noise.error(tick(n)) for n in range(3000)]
    for name, sigma in (("x", 0.02), ("y", 0.02), ("yaw", 0.01)):
        found = [getattr(error, name) for error in errors]
        assert statistics.fmean(found) == pytest.approx(0.0, abs=0.1 * sigma)
        assert statistics.stdev(found) == pytest.approx(sigma, rel=0.06)
    seen = [noise.user(UserPose(HERE, 0.5), tick(n)) for n in range(3000)]
    assert statistics.stdev(pose.head_yaw for pose in seen) == pytest.approx(0.01, rel=0.06)
    assert statistics.stdev(pose.body.x for pose in seen) == pytest.approx(0.02, rel=0.06)


@pytest.mark.requirement(67)
def test_noise_belongs_to_seed_source_and_stamp_alone():
    model = {"tracking_noise": 0.02, "pose_noise": 0.01}
    first = Run(seed=1, **model)
    assert Run(seed=1, **model).got == first.got
    assert Run(seed=2, **model).values("base.pose") != first.values("base.pose")
    # one source that is not asked, or has no noise, changes nothing in another
    alone = Run(seed=1, asked=("trackers",), **model)
    assert alone.values("user.pose") == first.values("user.pose")
    without = Run(seed=1, pose_noise=0.01)
    assert without.values("base.pose") == first.values("base.pose")
    errors = [WhiteNoise(1, name, 0.01).error(0) for name in ("base.pose", "user.pose")]
    assert errors[0] != errors[1]


def test_the_gate_of_the_wheels_goes_by_the_noisy_pose():
    exact, noisy = (
        [record.separation for record in run.world.guard.chain.cycles.reader().read_new()]
        for run in (Run(), Run(pose_noise=0.02))
    )
    differences = [a - b for a, b in zip(exact, noisy, strict=True) if a is not None]
    assert statistics.stdev(differences) == pytest.approx(0.02, rel=0.5)


@pytest.mark.parametrize("wrong", [{"tracking_delay": -0.1}, {"pose_noise": float("nan")}])
def test_sensors_that_cannot_be_are_refused(wrong):
    with pytest.raises(ValueError, match="sensors:"):
        SensorModel(**wrong)
