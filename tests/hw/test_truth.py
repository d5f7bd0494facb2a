"""Snapshots of the truth: whose doing a contact was, and that all of it can be written down."""

import json
import math

import pytest

from hw.geometry import Pose2, Pose3
from hw.model.robot import load_robot
from hw.people.live import LivePerson
from hw.people.user import open_user
from hw.samples import Sample, UserPose
from hw.scene.scene import load_scene
from hw.sim.mock import mock_world
from hw.sim.world import World
from hw.truth import Contact, Truth

ROBOT, LAB = load_robot("rbkairos_ur10"), load_scene("lab_a")
TICK = 33_333_333
KINDS = {kind.__name__: kind for kind in (Pose2, Pose3, Contact)}


@pytest.mark.parametrize(
    ("part", "closing", "by"),
    [
        ("base", 0.051, "robot"),
        ("base", 0.05, "person"),
        ("base", -0.4, "person"),
        ("forearm", 0.251, "robot"),
        ("forearm", 0.25, "slow_arm"),
        ("forearm", 0.051, "slow_arm"),
        ("panel", 0.05, "person"),
    ],
)
def test_who_closed_in_has_caused_a_contact(part, closing, by):
    assert Contact(0, 0.0, 0.0, part, closing, 9.0, False).by == by


def plain(value):
    """As lists, dictionaries and numbers, with the names of the classes."""
    if isinstance(value, tuple):
        return [plain(each) for each in value]
    if type(value).__name__ in KINDS:
        fields = {name: plain(getattr(value, name)) for name in type(value).__slots__}
        return {type(value).__name__: fields}
    return value


def restored(value):
    if isinstance(value, list):
        return tuple(restored(each) for each in value)
    if isinstance(value, dict):
        ((name, fields),) = value.items()
        return KINDS[name](**{key: restored(each) for key, each in fields.items()})
    return value


def snapshots(world, person=None):
    for n in range(200):
        if person is not None:
            person.push(n * TICK, UserPose(Pose2(2.0 - n / 60, 0.1), 0.4))
        world.advance(n * TICK)
        yield world.truth


@pytest.mark.parametrize("kind", ["cornering", "contact", "nobody", "mock"])
def test_every_snapshot_can_be_written_as_json_and_read_back_the_same(kind):
    person = LivePerson(Pose2(2.0, 0.1)) if kind == "contact" else None
    world = {
        "cornering": lambda: World(LAB, ROBOT, open_user("cornering", LAB)),
        "contact": lambda: World(None, ROBOT, person),
        "nobody": lambda: World(None, ROBOT, None),
        "mock": lambda: mock_world(LAB, ROBOT, open_user("cornering", LAB)),
    }[kind]()
    seen = list(snapshots(world, person))

    for truth in seen:
        text = json.dumps(plain(truth), allow_nan=False)
        assert Truth(*restored(json.loads(text))) == truth
    assert len(seen[-1].contacts or ()) == (kind == "contact")


def test_without_a_person_nothing_is_said_of_one():
    truth = World(None, ROBOT, None).truth

    assert (truth.body, truth.request, truth.seen_ns) == (None, None, None)
    assert (truth.min_gap, truth.contacts) == (None, None)


def test_a_snapshot_stays_as_it_was():
    world = World(LAB, ROBOT, open_user("cornering", LAB))
    first = world.truth
    copy = Truth(*first)
    for n in range(60):
        world.advance(n * TICK)

    assert first == copy != world.truth


def test_the_head_is_where_tracking_had_it_last_and_no_number_is_no_pose():
    person = LivePerson(Pose2(3.0, 0.0))
    world = World(None, ROBOT, person)
    person.push(TICK, UserPose(Pose2(3.0, 0.0, 0.5), 0.8))
    world.advance(TICK)
    world.advance(2 * TICK)
    assert (world.truth.seen_ns, world.truth.head_turn) == (TICK, pytest.approx(0.3))

    person.measured = Sample("user.pose", 3 * TICK, UserPose(Pose2(3.0, 0.0), math.nan))
    person.step = lambda *_: None
    world.advance(3 * TICK)

    assert (world.truth.seen_ns, world.truth.head_turn) == (TICK, pytest.approx(0.3))
