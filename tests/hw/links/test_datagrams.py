"""Datagrams between our processes: what goes in comes out, and strangers' datagrams do not."""

import socket

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hw.geometry import Pose2, Pose3, Twist2
from hw.links.datagrams import Intake, Outlet, parsed, plain
from hw.samples import ArmState, Odometry, PoseSigma, TrackerPose, UserPose
from hw.truth import Contact, Truth

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
    assert parsed(plain(sent)) == sent


def test_datagrams_arrive_in_order_with_their_source_number_and_stamp():
    intake = Intake()
    outlet = Outlet("vr", [intake.address])
    truth = Truth(contacts=(Contact(5, 1.0, 2.0, "base", 0.1, 0.2, granted=False),))
    outlet.send("truth", 7, truth)
    outlet.send("user.pose", 8, UserPose(Pose2(1.0, 2.0, 0.5), 0.25))
    first, second = intake.poll()
    assert (first.source, first.number, first.name, first.stamp_ns) == ("vr", 1, "truth", 7)
    assert first.value == truth
    assert (second.number, second.value) == (2, UserPose(Pose2(1.0, 2.0, 0.5), 0.25))
    assert intake.poll() == []
    outlet.close()
    intake.close()


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff\xfe",
        b"[]",
        b'["a",1,"b",2]',
        b'["a",1,"b",2.5,null]',
        b'["a",true,"b",2,null]',
        b'["a",1,"b",2,{"Pose2":[1]}]',
        b'["a",1,"b",2,{"os.system":["true"]}]',
        b'["a",1,"b",2,{"Pose2":[1,2,3],"Twist2":[1,2,3]}]',
        b"[" * 5000,
    ],
)
def test_what_is_none_of_ours_is_counted_and_left_out(data):
    intake = Intake()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.sendto(data, intake.address)
    assert intake.poll() == []
    assert intake.strange == 1
    intake.close()


def test_a_value_that_cannot_be_told_is_a_bug_of_the_caller():
    with pytest.raises(TypeError, match="a set cannot be sent"):
        plain({1.0})


def test_nobody_there_is_no_error():
    intake = Intake()
    address = intake.address
    intake.close()
    outlet = Outlet("engine", [address])
    for _ in range(3):
        outlet.send("hello", 0)
    outlet.close()


def test_an_address_in_use_is_refused():
    intake = Intake()
    with pytest.raises(OSError, match="in use"):
        Intake(*intake.address)
    intake.close()
