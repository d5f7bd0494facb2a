"""Which part of the arm touched whom, where, and who closed in how fast."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
import pytest

from cobodeck.evaluate.arm_contact import ArmOutline, ArmWatch
from cobodeck.evaluate.evaluators import arm_outline
from hw.geometry import Pose2, Pose3
from hw.model.robot import load_robot
from hw.samples import USER_RADIUS, Joints
from hw.truth import Contact, Truth

ROBOT = load_robot("rbkairos_ur10")
TICK = 33_333_333
ASKED = Pose3(2.0, 0.0, 1.3)
FOLDED = (0.0,) * 6


def stick(joints: Joints) -> tuple[np.ndarray, np.ndarray]:
    """A forearm that slides out ahead by the first joint, m, and a panel at its end."""
    reach = joints[0]
    ends = [[[0, 0, 1], [reach, 0, 1]], [[reach, 0.3, 1], [reach, 0.5, 1]]]
    return np.array(ends, dtype=float), np.array([0.05, 0.05])


def sliding(joints: Iterable[Joints], truth: Callable[[int], Truth]) -> list[Contact]:
    """What the watch notes while the arm goes through these joints, tick by tick."""
    watch = ArmWatch(ArmOutline(stick, ("forearm", "panel"), "panel", ROBOT.footprint))
    for n, each in enumerate(joints):
        watch.watch(n * TICK, truth(n)._replace(joints=each))
    return watch.contacts


def out(speed: float, start: float = 0.8) -> list[Joints]:
    return [(start + speed * n * TICK * 1e-9, 0.0, 0.0, 0.0, 0.0, 0.0) for n in range(60)]


STANDING = Truth(base=Pose2(0.0, 0.0), body=Pose2(1.4, 0.0))


@pytest.mark.parametrize(
    ("speed", "by"), [(0.04, "person"), (0.2, "slow_arm"), (0.24, "slow_arm"), (0.3, "robot")]
)
def test_a_link_is_as_fast_as_it_slides_and_slow_ones_are_told_apart(speed: float, by: str) -> None:
    (contact,) = sliding(out(speed, start=0.84), lambda n: STANDING)

    assert (contact.part, contact.by, contact.granted) == ("forearm", by, False)
    assert contact.robot_closing == pytest.approx(speed, rel=0.01)
    assert contact.person_closing == 0.0
    assert contact.at_ns * 1e-9 == pytest.approx(0.01 / speed, abs=TICK * 1e-9 / 4)
    assert (contact.x, contact.y) == pytest.approx((0.9, 0.0), abs=1e-6)


def test_somebody_else_is_touched_by_their_name_and_has_asked_for_nothing() -> None:
    away = STANDING._replace(body=Pose2(9.0, 9.0), request=ASKED)
    others = (("person_1", Pose2(-9.0, 0.0)), ("person_3", Pose2(1.4, 0.0)))
    (contact,) = sliding(out(0.3, start=0.84), lambda n: away._replace(others=others))
    assert (contact.who, contact.part, contact.by) == ("person_3", "forearm", "robot")
    assert not contact.granted
    # both of them: two contacts
    both = sliding(out(0.3, start=0.84), lambda n: STANDING._replace(others=others))
    assert sorted(contact.who for contact in both) == ["person_3", "user"]


def test_what_the_base_adds_to_the_speed_of_a_link_counts() -> None:
    moving = [STANDING._replace(base=Pose2(0.1 * n * TICK * 1e-9, 0.0)) for n in range(60)]
    (contact,) = sliding(out(0.2), moving.__getitem__)

    assert contact.robot_closing == pytest.approx(0.3, rel=0.01)
    assert contact.by == "robot"


def test_who_walks_into_an_arm_that_stands_has_caused_the_contact() -> None:
    walking = [STANDING._replace(body=Pose2(2.0 - n * TICK * 1e-9, 0.0)) for n in range(60)]
    (contact,) = sliding([(0.9, *FOLDED[1:])] * 60, walking.__getitem__)

    assert (contact.part, contact.by) == ("forearm", "person")
    assert contact.person_closing == pytest.approx(1.0, rel=0.01)
    assert contact.robot_closing == 0.0


def test_in_a_granted_touch_a_link_counts_and_what_the_arm_holds_does_not() -> None:
    asking = STANDING._replace(request=ASKED)
    behind = asking._replace(body=Pose2(1.4, 0.9))  # beside the forearm, before the panel

    (link,) = sliding(out(0.3), lambda n: asking)
    assert (link.part, link.granted) == ("forearm", True)
    assert sliding(out(0.3), lambda n: behind) == []
    (panel,) = sliding(out(0.3), lambda n: behind._replace(request=None))
    assert (panel.part, panel.granted) == ("panel", False)


def test_after_a_granted_touch_what_is_left_of_it_is_none_until_it_has_come_away() -> None:
    """0.3 m/s out, and the person lets go while the panel is at them; then in, and out again."""
    course = [*out(0.3), *reversed(out(0.3)), *out(0.3)]

    def truth(n: int) -> Truth:
        asks = n < 50
        return STANDING._replace(body=Pose2(1.4, 0.9), request=ASKED if asks else None)

    (contact,) = sliding(course, truth)
    assert contact.at_ns > 120 * TICK


def test_a_touch_that_goes_on_from_link_to_link_is_one() -> None:
    both = STANDING._replace(body=Pose2(1.45, 0.45))
    contacts = sliding(out(0.3), lambda n: both)

    assert len(contacts) == 1


@pytest.mark.parametrize(("y", "part"), [(0.05, "forearm"), (0.3, "panel")])
def test_of_parts_that_touch_at_once_the_deeper_one_is_named(y: float, part: str) -> None:
    """The forearm lies at y = 0, the panel from 0.3 to 0.5; the person leaps onto both."""
    leaps = [STANDING._replace(body=Pose2(x, y)) for x in (6.0, 1.0)]

    (contact,) = sliding([(0.9, *FOLDED[1:])] * 2, leaps.__getitem__)

    assert contact.part == part


def test_what_touches_within_the_outline_is_the_outlines_business() -> None:
    """The person stands beside the rover; the forearm, out ahead, is met only over its deck."""
    beside = STANDING._replace(body=Pose2(0.0, 0.52))

    assert sliding(out(0.3), lambda n: beside) == []


# -- the arm as it is ----------------------------------------------------------------------------

OUTLINE = arm_outline(ROBOT)
REACHING = (0.3, -0.6, 0.9, -0.4, 1.2, 0.2)
RATES = (0.5, 0.2, -0.3, 0.4, 0.0, 0.0)


def test_the_foot_of_the_arm_is_not_called_as_the_outline_is() -> None:
    assert "arm_base" in OUTLINE.parts
    assert "base" not in OUTLINE.parts


def moved(t: float) -> Joints:
    return tuple(q + v * t for q, v in zip(REACHING, RATES, strict=True))


def gap(joints: Joints, base: Pose2, body: Pose2) -> tuple[float, str]:
    """The least gap of all parts, by 2001 points along each axis, and which it is."""
    ends, radii = OUTLINE.capsules_of(joints)
    shares = np.linspace(0.0, 1.0, 2001)[:, None]
    found = []
    for (start, end), radius, part in zip(ends, radii, OUTLINE.parts, strict=True):
        x, y = (start + shares * (end - start)).T[:2]
        c, s = math.cos(base.yaw), math.sin(base.yaw)
        away = np.hypot(base.x + c * x - s * y - body.x, base.y + s * x + c * y - body.y)
        found.append((float(away.min()) - radius - USER_RADIUS, part))
    return min(found)


def driven(t: float) -> Pose2:
    return Pose2(0.1 * t, 0.05 * t, 0.2 * t)


@pytest.mark.parametrize(
    ("bearing", "away", "part"),
    [(0.6, 1.82, "prop"), (0.8, 1.64, "prop"), (1.0, 1.14, "wrist_1")],
)
def test_the_closing_speed_of_the_real_arm_is_that_of_the_gap(
    bearing: float, away: float, part: str
) -> None:
    """Arm and base move on until they touch who stands there."""
    body = Pose2(away * math.cos(bearing), away * math.sin(bearing))
    watch, tick_s = ArmWatch(OUTLINE), 0.004
    for n in range(1000):
        t = n * tick_s
        watch.watch(round(t * 1e9), Truth(base=driven(t), joints=moved(t), body=body))
        if watch.contacts:
            break

    (contact,) = watch.contacts
    t, h = contact.at_ns * 1e-9 - tick_s / 8, 1e-4  # in the middle of the piece looked at
    before, after = (gap(moved(at), driven(at), body) for at in (t - h, t + h))
    assert gap(moved(t), driven(t), body)[0] == pytest.approx(0.0, abs=1e-3)
    assert contact.part == before[1] == part
    assert contact.robot_closing == pytest.approx((before[0] - after[0]) / (2 * h), rel=0.01)
    assert contact.robot_closing > 0.05
    assert math.hypot(contact.x - body.x, contact.y - body.y) == pytest.approx(USER_RADIUS)
