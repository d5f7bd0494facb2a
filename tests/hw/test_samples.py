"""What no part can have measured is told apart from what it can."""

import array
import collections
import copy
import dataclasses
import decimal
import enum
import fractions
import math
import pickle
from typing import NamedTuple

import numpy as np
import pytest

from hw.finite import is_finite
from hw.geometry import Pose2, Pose3, Twist2
from hw.samples import (
    ArmState,
    BumperHit,
    GripperState,
    ImuReading,
    Odometry,
    Scan,
    TrackerPose,
    UserPose,
    WrenchReading,
)

JOINTS = (0.0,) * 5
BAD = (math.nan, math.inf, -math.inf)


@pytest.mark.parametrize(
    "value",
    [
        UserPose(Pose2(1.0, -2.0, 3.0), -3.0),
        Pose2(1e6, -1e6, 0.0),
        Twist2(0.0, 0.0, -9.0),
        Pose3(1.0, 2.0, 3.0),
        ArmState((*JOINTS, 1.0), (*JOINTS, -1.0)),
        BumperHit(0.5),
        Scan("front", -1.0, 0.1, (1.0, math.inf, math.inf)),
        (1.0, (2, None)),
        np.ones(3),
        np.array([1, 2]),
        None,
        True,
        "pressed",
    ],
)
def test_numbers_and_what_holds_no_numbers_pass(value):
    assert is_finite(value)


@pytest.mark.parametrize("bad", BAD)
def test_one_bad_number_is_enough(bad):
    for place in range(3):
        numbers = [bad if n == place else 1.0 for n in range(3)]
        assert not is_finite(Pose2(*numbers))
        assert not is_finite(Twist2(*numbers))
        assert not is_finite(Pose3(*numbers))
        assert not is_finite(UserPose(Pose2(*numbers), 0.0))
    assert not is_finite(UserPose(Pose2(1.0, 1.0), bad))
    assert not is_finite(ArmState((*JOINTS, bad), (*JOINTS, 0.0)))
    assert not is_finite(ArmState((*JOINTS, 0.0), (bad, *JOINTS)))


def test_infinities_that_cancel_are_noticed():
    assert not is_finite(Pose2(math.inf, -math.inf))
    assert not is_finite(Scan("front", 0.0, 0.1, (math.inf, -math.inf)))


class Cell(NamedTuple):
    """A sample as a project of one's own may have it."""

    name: str
    volts: float | None


@dataclasses.dataclass(frozen=True)
class Battery:
    cells: tuple[Cell, ...]
    charge: float = 0.5
    warnings: "Unknown" = None  # noqa: F821


class Motor:
    """A plain object, with attributes in a dictionary."""

    def __init__(self, current: object, other: object = None) -> None:
        self.current, self.other = current, other


class Servo:
    """A plain object with slots, one of them never set."""

    __slots__ = ("__angle", "unset")

    def __init__(self, angle: object) -> None:
        self.__angle = angle


class Geared(Servo, Motor):
    """Both."""

    def __init__(self, angle: object, current: object) -> None:
        Servo.__init__(self, angle)
        Motor.__init__(self, current)


class Level(enum.Enum):
    LOW = 0.5
    NONE = math.nan


class Broken:
    """Cannot be looked at."""

    def __float__(self) -> float:
        raise RuntimeError("no contact")


def nested(depth: int) -> object:
    value: object = 1.0
    for _ in range(depth):
        value = [value]
    return value


HOLDERS = [
    lambda number: {"volts": number},
    lambda number: {number: "volts"},
    lambda number: {number, 1.0},
    lambda number: frozenset({number}),
    lambda number: collections.deque([1.0, number]),
    lambda number: complex(1.0, number),
    lambda number: complex(number, 1.0),
    lambda number: decimal.Decimal(number),
    lambda number: array.array("d", [1.0, number]),
    lambda number: Motor(number),
    lambda number: Motor(1.0, Motor(number)),
    lambda number: Servo(number),
    lambda number: Geared(number, 1.0),
    lambda number: Geared(1.0, number),
    lambda number: Motor({"currents": [(1.0, number)]}),
    lambda number: Battery((), warnings={"t": Motor(number)}),
    lambda number: np.float32(number),
    lambda number: np.array([1.0, number], np.float16),
    lambda number: np.array([1.0, complex(1.0, number)]),
    lambda number: np.array([1.0, Motor(number)], object),
    lambda number: np.array([(1.0, number)], [("x", "f8"), ("y", "f8")]),
]


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("holder", HOLDERS)
def test_whatever_holds_a_bad_number_is_no_measurement(holder, bad):
    assert is_finite(holder(1.0))
    assert not is_finite(holder(bad))


@pytest.mark.parametrize(
    "value",
    [
        {},
        set(),
        Level.LOW,
        Motor,
        fractions.Fraction(1, 3),
        range(3),
        b"raw",
        print,
        np.full(100, 60000.0, np.float16),
        np.array([]),
        np.array(["text"]),
        nested(15),
    ],
)
def test_what_holds_no_bad_number_passes_whatever_it_is(value):
    assert is_finite(value)


def cycle() -> Motor:
    motor = Motor(1.0)
    motor.other = motor
    return motor


@pytest.mark.parametrize(
    "value",
    [
        10**400,
        Pose2(10**400, 1.0),
        BumperHit(10**400),
        fractions.Fraction(10**400),
        decimal.Decimal("sNaN"),
        Level.NONE,
        Broken(),
        nested(17),
        cycle(),
    ],
    ids=lambda value: type(value).__name__,
)
def test_what_cannot_be_looked_at_to_its_end_is_no_measurement(value):
    assert not is_finite(value)


UPRIGHT = Pose3(0.0, 0.0, 1.0)
EVERY_NUMBER = [
    (UserPose(Pose2(0.0, 0.0), 0.0, UPRIGHT, UPRIGHT, UPRIGHT), 4 + 3 * 7),
    (ArmState((*JOINTS, 0.0), (*JOINTS, 0.0)), 12 + 2),
    (BumperHit(0.0), 1),
    (GripperState(0.05), 1),
    (WrenchReading((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), 6),
    (ImuReading((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), 6),
    (Scan("front", 0.0, 0.1, (1.0, 2.0)), 5),
    (Odometry(Pose2(0.0, 0.0), Twist2(0.0, 0.0, 0.0)), 6),
    (Odometry(Pose2(0.0, 0.0), Twist2(0.0, 0.0, 0.0), (0.1, 0.1, 0.2)), 9),
    (TrackerPose("front_tracker", UPRIGHT), 7),
    (Battery((Cell("a", 3.0), Cell("b", None))), 2),
    ([1.0, (2.0, 3)], 3),
]


def spoiled(value, place, bad):
    """A copy whose number at `place`, counted through, is bad; and how many were passed."""
    if isinstance(value, float | int) and not isinstance(value, bool):
        return (bad if place == 0 else value), 1
    if dataclasses.is_dataclass(value):
        names = [field.name for field in dataclasses.fields(value)]
        parts, count = _spoiled_parts([getattr(value, name) for name in names], place, bad)
        return dataclasses.replace(value, **dict(zip(names, parts, strict=True))), count
    if isinstance(value, tuple | list):
        parts, count = _spoiled_parts(value, place, bad)
        make = value._make if hasattr(value, "_make") else type(value)
        return make(parts), count
    return value, 0


def _spoiled_parts(values, place, bad):
    parts, count = [], 0
    for value in values:
        part, more = spoiled(value, place - count, bad)
        parts.append(part)
        count += more
    return parts, count


@pytest.mark.parametrize(("value", "numbers"), EVERY_NUMBER)
def test_every_number_of_every_sample_is_looked_at(value, numbers):
    assert is_finite(value)
    assert spoiled(value, -1, math.nan)[1] == numbers
    for place in range(numbers):
        assert not is_finite(spoiled(value, place, math.nan)[0]), place


def test_a_range_may_be_infinite_and_no_other_number_of_a_scan():
    for start, step in ((math.inf, 0.1), (0.0, -math.inf)):
        assert not is_finite(Scan("front", start, step, (1.0,)))
    assert not is_finite(Scan("front", 0.0, 0.1, (1.0, -math.inf)))


def test_arrays_are_looked_at_too():
    assert not is_finite(np.array([[1.0, math.nan]]))
    assert not is_finite((np.array([math.inf]),))


def test_a_text_where_a_number_is_declared_is_no_measurement():
    assert not is_finite(BumperHit("left"))


def test_a_scan_is_the_same_whether_made_of_numbers_or_of_an_array():
    plain = Scan("front", -1.0, 0.1, (1.0, math.inf), 1e-3)
    made = Scan.of_array("front", -1.0, 0.1, np.array([1.0, math.inf]), 1e-3)
    assert made.array.tolist() == plain.array.tolist() == [1.0, math.inf]
    assert made.ranges == plain.ranges
    assert (made, hash(made), repr(made)) == (plain, hash(plain), repr(plain))
    copied = Scan.of_array("front", -1.0, 0.1, np.array([1.0, math.inf]), 1e-3)
    assert pickle.loads(pickle.dumps(copied)) == copy.deepcopy(copied) == plain
    assert dataclasses.replace(copied, ranges=(2.0,)).array.tolist() == [2.0]
    with pytest.raises(AttributeError, match="radius"):
        made.radius


@pytest.mark.parametrize("ranges", [("1.0",), (1.0, None), ((1.0,),), 3.0])
def test_a_scan_of_other_than_numbers_is_no_measurement(ranges):
    assert not is_finite(Scan("front", 0.0, 0.1, ranges))
    assert is_finite(Scan("front", 0.0, 0.1, ()))
