"""Datagrams between our processes: what goes in comes out, and strangers' datagrams do not."""

import json
import random
import socket
import threading
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import Pose2, Pose3, Twist2
from hw.ipc.datagrams import Door, Intake, Outlet, Seal, coded, is_loopback, key_of
from hw.ipc.plain import KINDS, parsed, text
from hw.samples import ArmState, Odometry, PoseSigma, TrackerPose, UserPose
from hw.truth import Contact, Truth
from tests.repeats import examples

number = st.floats(allow_nan=False)
pose = st.builds(Pose2, number, number, number)
pose3 = st.builds(Pose3, number, number, number)
value = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | number
    | st.text(max_size=20)
    | pose
    | pose3
    | st.builds(Twist2, number, number, number)
    | st.builds(UserPose, pose, number, st.none() | pose3)
    | st.builds(Odometry, pose, st.builds(Twist2, number, number, number))
    | st.builds(PoseSigma, number, number)
    | st.builds(TrackerPose, st.text(max_size=5), pose3)
    | st.builds(ArmState, st.tuples(number, number), st.tuples(number, number)),
    lambda inner: st.lists(inner, max_size=3).map(tuple),
    max_leaves=5,
)


@given(value)
def test_what_is_told_comes_back_as_it_was(sent):
    assert parsed(json.loads(text(sent))) == sent


@pytest.fixture
def intake():
    found = Intake(("vr", "arm"))
    yield found
    found.close()


def thrown(intake, *datas):
    """Send bytes to it, as anybody can who reaches its port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for data in datas:
            stranger.sendto(data, intake.address)
    return intake.poll()


def sealed(door, text):
    """A datagram of who has the key, with any content."""
    head = Seal().body("", 0)[:16]
    return coded(head + text, bytes.fromhex(door.key))


class Copies:
    """Stands for an intake, and keeps what was sent to it."""

    def __init__(self):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(5.0)

    def of(self, door, *names):
        """What an outlet to that door sends."""
        outlet = Outlet([Door(*self._socket.getsockname(), door.key)])
        for name in names:
            outlet.send(name, 0)
        outlet.close()
        return [self._socket.recv(1 << 16) for _ in names]

    def close(self):
        self._socket.close()


@pytest.fixture
def copies():
    made = Copies()
    yield made
    made.close()


def test_datagrams_arrive_in_order_with_their_source_number_and_stamp(intake):
    outlet = Outlet([intake.door("vr")])
    truth = Truth(contacts=(Contact(5, 1.0, 2.0, "base", 0.1, 0.2, granted=False),))
    outlet.send("truth", 7, truth)
    outlet.send("user.pose", 8, UserPose(Pose2(1.0, 2.0, 0.5), 0.25))
    first, second = intake.poll()
    assert (first.source, first.number, first.name, first.stamp_ns) == ("vr", 1, "truth", 7)
    assert first.value == truth
    assert (second.number, second.value) == (2, UserPose(Pose2(1.0, 2.0, 0.5), 0.25))
    assert intake.poll() == []
    outlet.close()


def test_a_source_is_whose_key_was_used_whatever_the_datagram_says(intake):
    outlets = [Outlet([intake.door(source)]) for source in ("vr", "arm")]
    for outlet in outlets:
        outlet.send("arm.link", 0)
        outlet.close()
    assert [told.source for told in intake.poll()] == ["vr", "arm"]
    with pytest.raises(KeyError):
        intake.door("engine")


def test_without_its_key_nobody_is_believed(intake):
    told = json.dumps(["user.pose", 1, None]).encode()
    for key in (b"", b"guess", key_of(b"another secret", "vr"), bytes(16)):
        assert thrown(intake, coded(bytes(16) + told, key)) == []
    other = Intake(("vr",))
    outlet = Outlet([Door(*intake.address, other.door("vr").key)])
    outlet.send("user.pose", 1)
    assert intake.poll() == []
    assert intake.strange == 5
    other.close()
    outlet.close()


def test_a_single_bit_that_is_not_as_sent_makes_it_strange(intake, copies):
    (data,) = copies.of(intake.door("vr"), "vr.link")
    for bit in range(8 * len(data)):
        turned = bytearray(data)
        turned[bit // 8] ^= 1 << bit % 8
        assert thrown(intake, bytes(turned)) == []
    assert intake.strange == 8 * len(data)
    assert len(thrown(intake, data)) == 1


def test_what_was_recorded_cannot_be_said_again(intake, copies):
    first, second, third = copies.of(intake.door("vr"), "a", "b", "c")
    assert [told.name for told in thrown(intake, first, third)] == ["a", "c"]
    assert thrown(intake, first, second, third) == []  # again, or overtaken
    assert intake.strange == 3


def test_a_sender_that_was_restarted_is_heard_and_the_one_before_cannot_be_repeated(intake, copies):
    before = copies.of(intake.door("arm"), "a", "b")
    again = copies.of(intake.door("arm"), "a", "b")
    assert len(thrown(intake, *before, *again)) == 4
    assert thrown(intake, *again, *before) == []


def test_what_was_recorded_is_of_no_use_for_the_next_run_at_the_same_port(intake, copies):
    old = copies.of(intake.door("vr"), *"abcdef")
    address = intake.address
    intake.close()
    following = Intake(("vr", "arm"), *address)
    assert thrown(following, *old) == []
    assert following.strange == 6
    following.close()


def test_threads_share_an_outlet_and_nothing_is_lost(intake):
    outlet = Outlet([intake.door("vr")])

    def talk():
        for _ in range(50):
            outlet.send("x", 0)

    threads = [threading.Thread(target=talk) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(intake.poll()) == 200
    outlet.close()


CONTENTS = [
    b"",
    b"\xff\xfe",
    b"[]",
    b"{}",
    b'["b",2]',
    b'["b",2.5,null]',
    b'["b",true,null]',
    b'["b",9223372036854775808,null]',
    b"[7,2,null]",
    b'["b",2,{"Pose2":[1]}]',
    b'["b",2,{"Pose2":7}]',
    b'["b",2,{"Pose2":"123"}]',
    b'["b",2,{"Pose2":[1,2,3,4]}]',
    b'["b",2,{"os.system":["true"]}]',
    b'["b",2,{"Pose2":[1,2,3],"Twist2":[1,2,3]}]',
    b'["b",2,{"UserPose":[1,2,3,4,5]}]',
    b'["b",2,{}]',
    b"[" * 5000,
    b'["b",2,' + b"[" * 5000 + b"]" * 5000 + b"]",
    b'["b",2,' + b"9" * 5000 + b"]",
]


@pytest.mark.parametrize("content", CONTENTS)
def test_what_is_none_of_ours_is_left_out_even_under_the_right_key(intake, content):
    assert thrown(intake, sealed(intake.door("vr"), content), content) == []
    assert intake.strange == 2


def test_noise_at_a_port_does_nothing(intake):
    chance = random.Random(7)
    for _ in range(200):
        assert thrown(intake, chance.randbytes(chance.randrange(200))) == []
    assert thrown(intake, chance.randbytes(60_001)) == []
    assert intake.strange == 201


WRONG: dict[Any, list[Any]] = {
    float: ["1.0", None, True, [1.0], {"Pose2": [1.0, 2.0, 3.0]}, 1 << 70],
    Pose2: [1.0, None, [1.0, 2.0, 3.0], {"Twist2": [1.0, 2.0, 3.0]}],
    str: [1, None, ["x"]],
    bool: [1, 0.0, None, "x"],
    tuple: [1.0, None, "xyz", ["x", None], [[]]],
}
GOOD = {
    "Pose2": (Pose2(1.0, 2.0, 3.0), [float, float, float]),
    "UserPose": (UserPose(Pose2(1.0, 2.0), 0.0), [Pose2, float]),
    "ArmState": (ArmState((1.0,), (2.0,)), [tuple, tuple, bool]),
    "TrackerPose": (TrackerPose("base", Pose3(1.0, 2.0, 3.0)), [str]),
    "Contact": (Contact(5, 1.0, 2.0, "base", 0.1, 0.2, granted=False), [float, float, float, str]),
}


@pytest.mark.parametrize("name", GOOD)
def test_a_field_that_is_not_of_its_class_makes_no_value(name):
    good, hints = GOOD[name]
    ((_, fields),) = json.loads(text(good)).items()
    for place, hint in enumerate(hints):
        for wrong in WRONG[hint]:
            with pytest.raises((ValueError, TypeError, KeyError)):
                parsed({name: [*fields[:place], wrong, *fields[place + 1 :]]})
    for count in range(len(fields)):
        with pytest.raises(ValueError, match=f"no {name}"):
            parsed({name: fields[:count]})


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=8)
        | st.dictionaries(
            st.sampled_from([*KINDS, "Other"]), st.lists(inner, max_size=8), max_size=2
        )
    ),
    max_leaves=12,
)


@settings(max_examples=examples(40))
@given(st.sampled_from(sorted(KINDS)), st.lists(json_values, max_size=9))
def test_what_can_be_read_can_be_written_again_as_it_was(kind, fields):
    try:
        found = parsed({kind: fields})
    except (ValueError, TypeError, KeyError):
        return
    assert text(found) == json.dumps({kind: fields}, separators=(",", ":"))


def test_a_value_that_cannot_be_told_is_a_bug_of_the_caller():
    with pytest.raises(TypeError, match="a set cannot be sent"):
        text({1.0})


def test_nobody_there_is_no_error():
    intake = Intake(("engine",))
    intake.close()
    outlet = Outlet([intake.door("engine")])
    for _ in range(3):
        outlet.send("hello", 0)
    outlet.close()


def test_what_only_sends_is_not_reached_by_other_machines_either(intake):
    outlet = Outlet([intake.door("vr")])
    outlet.send("x", 0)
    assert outlet._socket.getsockname()[0] == "127.0.0.1"
    outlet.close()


def test_an_address_in_use_is_refused(intake):
    with pytest.raises(OSError, match="in use"):
        Intake(("vr",), *intake.address)


@pytest.mark.parametrize(
    ("host", "own"),
    [
        ("127.0.0.1", True), ("127.3.2.1", True), ("localhost", True), ("0.0.0.0", False),
        ("", False), ("192.168.0.10", False),
    ],
)  # fmt: skip
def test_what_reaches_beyond_this_machine_is_known(host, own):
    assert is_loopback(host) is own
