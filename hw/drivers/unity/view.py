"""The robot's state as messages to VR applications."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from hw.drivers.unity.inbox import MAP, VIVE
from hw.drivers.unity.protocol import Messages
from hw.geometry import Pose3
from hw.samples import RobotView


def shown(
    made: Messages, stamp_ns: int, view: RobotView, joints: Sequence[str], map_from_vive: Pose3
) -> Iterator[tuple[str, Any]]:
    """The messages by the roles of their topics; `joints` are the names of the arm's."""
    yield "visible", made.flag(view.visible)
    yield "stop_sign", made.flag(view.stop_sign)
    if view.joints is not None:
        yield "joints", made.joint_state(stamp_ns, joints, view.joints)
    if view.pose is not None and view.twist is not None:
        vive_from_map = map_from_vive.inverse()
        base = view.pose.upright()
        yield "robot", made.odometry(stamp_ns, VIVE, vive_from_map @ base, view.twist)
        frames = [(VIVE, MAP, vive_from_map), (MAP, "base_link", base)]
        yield "tf", made.transforms(stamp_ns, frames)
