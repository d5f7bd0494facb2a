"""Whatever samples, calls and answers hold is written without loss, and imports nothing."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple, get_args

import numpy as np
import pytest
from foxglove.messages import LaserScan, Timestamp
from hypothesis import given, strategies as st

from cobodeck.record.format import messages
from cobodeck.record.format.class_names import Unknown
from cobodeck.record.format.sample_messages import SampleReader, SampleWriter
from cobodeck.record.format.scan_messages import read_scan, write_scan
from cobodeck.record.format.value_codec import text, today, value
from hw.geometry import Pose2, Pose3, Twist2
from hw.safety.cycle_record import SafetyRecord
from hw.samples import ArmMode, ArmState, Scan, UserPose
from hw.truth import Contact, Truth


class Colour(Enum):
    RED = "r"


@dataclass(frozen=True)
class Box:
    content: Any
    label: str = ""


class Pair(NamedTuple):
    first: Any
    second: Any


any_float = st.floats(allow_nan=False)
kinds = st.sampled_from([Colour, Colour.RED])
plain = kinds | st.none() | st.booleans() | st.integers() | any_float | st.text() | st.binary()
held = st.recursive(
    plain | st.just(Colour.RED) | st.just(math.inf),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.lists(inner, max_size=4).map(tuple)
        | st.dictionaries(st.text() | st.integers(), inner, max_size=4)
        | st.builds(Box, inner, st.text())
        | st.builds(Pair, inner, inner)
    ),
    max_leaves=20,
)


@given(st.sets(st.text() | st.integers() | st.floats(allow_nan=False)), st.booleans())
def test_sets_come_back_as_they_were(content: set[object], frozen: bool) -> None:
    one = frozenset(content) if frozen else content

    assert value(json.loads(text(one))) == one
    assert type(value(json.loads(text(one)))) is type(one)
    assert text(one) == text(type(one)(sorted(content, key=repr)))


def alike(a: object, b: object) -> bool:
    """Equal, of the same types all the way down."""
    return a == b and repr(a) == repr(b)


@given(held)
def test_values_come_back_as_they_were(content: object) -> None:
    assert alike(value(json.loads(text(content))), content)


def test_no_number_comes_back_as_no_number() -> None:
    [back] = value(json.loads(text((math.nan,))))

    assert math.isnan(back)


@pytest.mark.parametrize(
    "array",
    [np.arange(6.0).reshape(2, 3), np.array([], np.int32), np.float64(0.1), np.array(2 + 1j)],
)
def test_arrays_come_back_bit_by_bit(array: Any) -> None:
    back = value(json.loads(text(array)))

    assert (back.dtype, back.shape, back.tobytes()) == (array.dtype, array.shape, array.tobytes())


class Foreign:
    def __repr__(self) -> str:
        raise RuntimeError("not even this")


def endless() -> object:
    inside: list[object] = []
    inside.append(inside)
    return inside


@pytest.mark.parametrize("make", [object, Foreign, endless, lambda: len, lambda: {1: object()}])
def test_what_cannot_be_written_down_can_still_be_compared(make: Callable[[], object]) -> None:
    written = text(make())

    assert written == text(make())
    with pytest.raises(Unknown):
        value(json.loads(written))


@pytest.mark.parametrize(
    "written",
    [
        {"antigravity.Fly": []},
        {"os.system": ["true"]},
        {"builtins.object": []},
        {"subprocess.Popen": [["true"]]},
        {"no.such.Class": [1]},
        {"$enum": ["builtins.int", "real"]},
        {"hw.samples.Popen": [["true"]]},
        {"Popen": [["true"]]},
        {"_Arm": []},
        {"math": []},
    ],
)
def test_a_record_imports_and_calls_nothing(written: object) -> None:
    before = set(sys.modules)

    with pytest.raises(Unknown):
        value(written)

    assert set(sys.modules) == before


def test_a_class_of_ours_has_its_own_name_and_a_projects_its_modules_too() -> None:
    assert text(Twist2(1.0, 2.0, 0.5)) == '{"Twist2":[1.0,2.0,0.5]}'
    assert text(Box(None)) == f'{{"{__name__}.Box":[null,""]}}'
    assert text(Colour.RED) == f'{{"$enum":["{__name__}.Colour","RED"]}}'
    assert text(Colour) == f'{{"$members":"{__name__}.Colour"}}'


@pytest.mark.parametrize("module", ["hw.geometry", "hw.a.module.of.old", "states.poses", "hw"])
def test_an_older_record_names_a_module_whichever_it_was(module: str) -> None:
    [content] = json.loads(text(Pose2(1.0, 2.0, 0.5))).values()

    assert value({f"{module}.Pose2": content}) == Pose2(1.0, 2.0, 0.5)


@given(held)
def test_what_is_written_today_has_todays_names(content: object) -> None:
    told = json.loads(text(content))

    assert today(told) == told


def test_older_names_become_todays_wherever_they_are() -> None:
    old = [
        {"hw.samples.Odometry": [{"hw.geometry.Pose2": [1]}, {"lamp.Pose2": ["hw.samples.Scan"]}]},
        {"$dict": [["a", {"$enum": ["engine.run.life.Life", "ON"]}]]},
        {"$list": [{"$members": "engine.run.life.Life"}, {"$opaque": ["builtins.type", "hw.a.B"]}]},
        {"$opaque": ["hw.odd._Hidden", "x"]},
    ]

    assert today(old) == [
        {"Odometry": [{"Pose2": [1]}, {"lamp.Pose2": ["hw.samples.Scan"]}]},
        {"$dict": [["a", {"$enum": ["Life", "ON"]}]]},
        {"$list": [{"$members": "Life"}, {"$opaque": ["builtins.type", "B"]}]},
        {"$opaque": ["hw.odd._Hidden", "x"]},
    ]


finite = st.floats(-1e6, 1e6)
poses = st.builds(Pose2, finite, finite, finite)
spaces = st.none() | st.builds(Pose3, *[finite] * 7)
users = st.builds(UserPose, poses, finite, spaces, spaces, spaces)
arms = st.integers(1, 7).flatmap(
    lambda n: st.builds(
        ArmState,
        *[st.tuples(*[finite] * n)] * 2,
        st.booleans(),
        st.integers(0),
        st.none() | st.text(),
        st.sampled_from(get_args(ArmMode)),
        st.floats(0.0, 1.0),
    )
)
scans = st.builds(Scan, st.text(), finite, finite, st.lists(st.floats(allow_nan=False)).map(tuple))
SAMPLES = {
    "base.pose": poses | held, "user.pose": st.none() | users | held, "arm.joints": arms | held,
    "base.scan": scans, "mine": held,
}  # fmt: skip


@pytest.mark.parametrize("name", SAMPLES)
@given(data=st.data())
def test_samples_come_back_as_they_were(name: str, data: st.DataObject) -> None:
    content = data.draw(SAMPLES[name])
    stamps = data.draw(st.lists(st.integers(-(10**10), 10**14), min_size=1, max_size=3))
    writer, reader = SampleWriter(name), SampleReader(name)

    back = [reader.read(*writer.write(stamp, content)) for stamp in stamps]

    assert [sample.stamp_ns for sample in back] == stamps
    assert all(alike(sample.value, content) for sample in back)
    assert len({id(sample.value) for sample in back}) == 1  # the very object, as it was


def test_equal_values_in_other_objects_stay_apart() -> None:
    writer, reader = SampleWriter("base.pose"), SampleReader("base.pose")
    first, second = Pose2(1.0, 2.0), Pose2(1.0, 2.0)

    back = [reader.read(*writer.write(0, pose)).value for pose in (first, second, second)]

    assert back[0] is not back[1]
    assert back[1] is back[2]


@given(scans, st.integers(0, 10**14), st.booleans())
def test_a_scan_is_what_foxglove_writes_with_our_fields_behind(
    scan: Scan, stamp: int, again: bool
) -> None:
    written = write_scan(stamp, scan, again)

    end = scan.start + scan.step * (len(scan.ranges) - 1)
    theirs = LaserScan(
        timestamp=Timestamp(sec=stamp // 10**9, nsec=stamp % 10**9),
        frame_id=scan.sensor,
        start_angle=scan.start,
        end_angle=end,
        ranges=list(scan.ranges),
    ).encode()
    assert read_scan(written) == (stamp, scan, again)
    assert _fields(theirs).items() <= _fields(written).items()


def _fields(data: bytes) -> dict[int, bytes]:
    """Fields of a protobuf message by their numbers, zeros left out; written apart from ours."""
    found, at = {}, 0
    while at < len(data):
        key, at = _number(data, at)
        if key % 8 == 0:
            _, end = _number(data, at)
        elif key % 8 == 1:
            end = at + 8
        else:
            size, at = _number(data, at)
            end = at + size
        if any(data[at:end]):
            found[key // 8] = data[at:end]
        at = end
    return found


def _number(data: bytes, at: int) -> tuple[int, int]:
    number = power = 0
    while data[at] >= 128:
        number, power, at = number + (data[at] - 128 << power), power + 7, at + 1
    return number + (data[at] << power), at + 1


twists = st.builds(Twist2, finite, finite, finite)
maybe = st.none() | st.floats(allow_nan=False)


figures = st.tuples(maybe, any_float, any_float, maybe, maybe)


@given(st.integers(), twists, twists, figures, st.booleans())
def test_cycles_of_the_chain_come_back(
    stamp: int, command: Twist2, other: Twist2, numbers: tuple[Any, ...], kept: bool
) -> None:
    admitted = command if kept else other
    cycle = SafetyRecord(stamp, command, admitted, *numbers, reasons=("stop line", "latched"))

    back = messages.cycle_again(json.loads(messages.cycle_text(cycle)))

    assert alike(back, cycle)
    assert (back.admitted is back.command) == kept


def test_the_truth_comes_back_and_what_stays_is_the_same_object() -> None:
    contact = Contact(5, 1.0, 2.0, "base", 0.1, 0.2, False)
    first = Truth(Pose2(1.0, 2.0), (0.1, 0.2), body=Pose2(3.0, 4.0), min_gap=math.inf)
    second = first._replace(body=Pose2(3.0, 5.0), contacts=(contact,), request=Pose3(1.0, 2.0, 3.0))

    writer = messages.TruthWriter()
    one = messages.truth_again(json.loads(writer.write(first)), None)
    two = messages.truth_again(json.loads(writer.write(second)), one)

    assert alike(one, first)
    assert alike(two, second)
    assert two.joints is one.joints


def test_exceptions_come_back_by_class_and_text() -> None:
    for error in (ValueError("a", 1), OSError(5, "gone"), KeyError("k")):
        back = messages.raised_again(json.loads(messages.raised_text(error)))
        assert (type(back), str(back)) == (type(error), str(error))
    lost = messages.raised_again({"class": "gone.Odd", "args": ["why"]})
    assert (type(lost).__name__, str(lost)) == ("Odd", "why")
