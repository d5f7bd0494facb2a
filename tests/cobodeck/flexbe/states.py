"""Stubs of the FlexBE states that the two written charts name: they wait, compute or agree."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from engine.files.units import Duration, Length, Ratio
from engine.interfaces import interface
from engine.state import Action, Context, Outcome, Run, State, Until
from engine.types import from_annotation

Numbers = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Pose:
    """Where something is, in m, in the frame of the robot's base."""

    x: float
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Joint positions in rad, one after the other."""

    points: tuple[Numbers, ...] = ()


class LogState(Action):
    """Tells the operator something."""

    outcomes = ("done",)

    def __init__(self, text: str, severity: Literal["info", "warn", "hint", "error"]) -> None:
        self.text = text

    def run(self, ctx: Context) -> Run:
        yield self.text
        return "done"


class WaitState(Action):
    """Waits."""

    outcomes = ("done",)

    def __init__(self, wait_time: Duration) -> None:
        self.wait_time = wait_time

    def run(self, ctx: Context) -> Run:
        yield Until(ctx.after(self.wait_time))
        return "done"


class ExampleState(Action):
    """Works for `target_time`; never fails of itself."""

    outcomes = ("done", "failed")

    def __init__(self, target_time: Duration) -> None:
        self.target_time = target_time

    def run(self, ctx: Context) -> Run:
        yield Until(ctx.after(self.target_time))
        return "done"


class OperatorDecisionState(Action):
    """Asks the operator; suggests an outcome, which the chart's autonomy holds or lets go."""

    outcomes = ("$outcomes",)

    def __init__(self, outcomes: tuple[str, ...], hint: str, suggestion: str) -> None:
        self.hint = hint
        self.suggestion = suggestion

    def run(self, ctx: Context) -> Run:
        yield self.hint
        return self.suggestion


class GetJointsFromSrdfState(Action):
    """Reads a joint configuration from a file."""

    outcomes = ("retrieved", "file_error")
    outputs = {"retrieved": {"joint_values": Numbers}}

    def __init__(self, config_name: str, srdf_file: str, move_group: str, robot_name: str) -> None:
        self.config_name = config_name

    def run(self, ctx: Context) -> Outcome:
        return "retrieved", {"joint_values": (0.0, 1.0, 0.0, 0.0, 0.0)}


class MoveitToJointsState(Action):
    """Moves joints."""

    outcomes = ("reached", "planning_failed", "control_failed")

    def __init__(self, move_group: str, joint_names: tuple[str, ...], action_topic: str) -> None:
        self.joint_names = joint_names

    def run(self, ctx: Context, joint_config: Numbers) -> Run:
        yield
        return "reached" if len(joint_config) >= len(self.joint_names) else "planning_failed"


class PipeDetectionState(Action):
    """Asks for pipes until some are found."""

    outcomes = ("found", "unknown")

    def __init__(self, max_attempts: int) -> None:
        self.max_attempts = max_attempts

    def run(self, ctx: Context) -> Run:
        yield
        return "found"


class MonitorPerceptState(Action):
    """Waits for an object; here there are two pipes, 0.2 m to both sides."""

    outcomes = ("detected",)
    outputs = {"detected": {"object_id": str, "object_pose": Pose, "object_data": Numbers}}

    def __init__(self, required_support: float, percept_class: str, track_percepts: bool) -> None:
        self.percept_class = percept_class

    def run(self, ctx: Context) -> Run:
        yield
        offsets = (0.0, 0.2, 0.0, 0.0, -0.2, 0.0)
        found = {"object_id": "pipes_0", "object_pose": Pose(1.0), "object_data": offsets}
        return "detected", found


class PublishPoseState(Action):
    """Shows a pose."""

    outcomes = ("done",)

    def __init__(self, topic: str) -> None:
        self.topic = topic

    def run(self, ctx: Context, pose: Pose) -> Run:
        yield f"{self.topic}: {pose}"
        return "done"


class IncrementIndex(Action):
    """Counts."""

    outcomes = ("done",)
    outputs = {"done": {"output_value": int}}

    def run(self, ctx: Context, input_value: int) -> Outcome:
        return "done", {"output_value": input_value + 1}


class SelectPipePose(Action):
    """Picks one pipe; `object_data` has three numbers for each, relative to `object_pose`."""

    outcomes = ("selected", "out_of_range")
    outputs = {"selected": {"pipe_pose": Pose}}

    def run(
        self, ctx: Context, object_pose: Pose, object_data: Numbers, pose_choice: int
    ) -> Outcome:
        offset = object_data[3 * pose_choice : 3 * pose_choice + 3]
        if len(offset) < 3:
            return "out_of_range"
        x, y, z = offset
        pipe = Pose(object_pose.x + x, object_pose.y + y, object_pose.z + z)
        return "selected", {"pipe_pose": pipe}


class LookAtWaypoint(Action):
    """Turns the sensor head."""

    outcomes = ("reached", "failed")

    def run(self, ctx: Context, waypoint: Pose) -> Run:
        yield
        return "reached"


class MovePoseOut(Action):
    """A pose in front of another."""

    outcomes = ("done",)
    outputs = {"done": {"output_value": Pose}}

    def __init__(self, pose_offset: Length) -> None:
        self.offset = pose_offset

    def run(self, ctx: Context, input_value: Pose) -> Outcome:
        return "done", {"output_value": replace(input_value, x=input_value.x - self.offset)}


class MovePoseCartesian(Action):
    """A pose close to another."""

    outcomes = ("done",)
    outputs = {"done": {"output_value": Pose}}

    def __init__(self, close_offset: Length) -> None:
        self.offset = close_offset

    def run(self, ctx: Context, input_value: Pose) -> Outcome:
        return "done", {"output_value": replace(input_value, x=input_value.x - self.offset)}


class CalculateIKState(Action):
    """Joint positions for a pose of the tool."""

    outcomes = ("planned", "failed")
    outputs = {"planned": {"joint_config": Numbers}}

    def __init__(self, move_group: str, ignore_collisions: bool) -> None:
        self.move_group = move_group

    def run(self, ctx: Context, eef_pose: Pose) -> Outcome:
        return "planned", {"joint_config": (eef_pose.x, eef_pose.y, eef_pose.z, 0.0, 0.0)}


class CalculateCartesianPathState(Action):
    """A straight way of the tool to a pose."""

    outcomes = ("planned", "failed")
    outputs = {"planned": {"joint_trajectory": Trajectory, "plan_fraction": Ratio}}

    def __init__(self, move_group: str, ignore_collisions: bool) -> None:
        self.move_group = move_group

    def run(self, ctx: Context, eef_pose: Pose) -> Outcome:
        way = Trajectory(((eef_pose.x, eef_pose.y, eef_pose.z),))
        return "planned", {"joint_trajectory": way, "plan_fraction": 1.0}


class MoveitExecuteTrajectoryState(Action):
    """Follows a trajectory."""

    outcomes = ("done", "failed")

    def run(self, ctx: Context, joint_trajectory: Trajectory) -> Run:
        yield f"{joint_trajectory.points}"
        return "done"


class GripperRollState(Action):
    """Turns the gripper."""

    outcomes = ("done", "failed")

    def __init__(self, rotation: Literal["horizontal", "vertical"], duration: Duration) -> None:
        self.duration = duration

    def run(self, ctx: Context) -> Run:
        yield Until(ctx.after(self.duration))
        return "done"


class GripperState(Action):
    """Opens or closes the gripper: `action` 0 is open, 1 closed."""

    outcomes = ("done", "failed")

    def __init__(self, action: Ratio, duration: Duration) -> None:
        self.duration = duration

    def run(self, ctx: Context) -> Run:
        yield Until(ctx.after(self.duration))
        return "done"


def _classes(cls: type[State]) -> list[type[State]]:
    below = [found for sub in cls.__subclasses__() for found in _classes(sub)]
    return [cls, *below] if cls.__module__ == __name__ and cls.outcomes else below


INTERFACES = {cls.__name__: interface(cls) for cls in _classes(Action)}
TYPES = {
    "Pose": from_annotation(Pose),
    "Numbers": from_annotation(Numbers),
    "Trajectory": from_annotation(Trajectory),
}
