"""Time as states ask ROS 1 and ROS 2 for it, on the clock of the run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

NS = 10**9


@dataclass(frozen=True, slots=True, order=True)
class _Span:
    """A number of ns, with the faces that rospy and rclpy give it."""

    ns: int = 0

    @property
    def nanoseconds(self) -> int:
        """All of it, ns."""
        return self.ns

    @property
    def secs(self) -> int:
        """Whole seconds."""
        return self.ns // NS

    @property
    def nsecs(self) -> int:
        """What is left beside the whole seconds, ns."""
        return self.ns % NS

    sec, nanosec = secs, nsecs

    def to_sec(self) -> float:
        """All of it, s."""
        return self.ns / NS

    def to_nsec(self) -> int:
        """All of it, ns."""
        return self.ns

    def to_msg(self) -> Any:
        """Itself: messages hold it as it is."""
        return self

    def seconds_nanoseconds(self) -> tuple[int, int]:
        """Whole seconds, and the rest in ns."""
        return self.secs, self.nsecs

    def is_zero(self) -> bool:
        """Whether it is 0."""
        return self.ns == 0

    def __bool__(self) -> bool:
        return self.ns != 0


class RosDuration(_Span):
    """A span of time."""

    __slots__ = ()

    def __init__(
        self, secs: float = 0, nsecs: int = 0, *, seconds: float = 0, nanoseconds: int = 0
    ) -> None:
        ns = round((secs + seconds) * NS) + nsecs + nanoseconds
        object.__setattr__(self, "ns", ns)

    @classmethod
    def from_sec(cls, seconds: float) -> RosDuration:
        """So many seconds."""
        return cls(seconds)

    def __add__(self, other: Any) -> Any:
        if isinstance(other, RosTime):
            return other + self
        return RosDuration(nsecs=self.ns + _ns(other))

    __radd__ = __add__

    def __sub__(self, other: Any) -> RosDuration:
        return RosDuration(nsecs=self.ns - _ns(other))

    def __mul__(self, factor: float) -> RosDuration:
        return RosDuration(nsecs=round(self.ns * factor))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        if isinstance(other, RosDuration):
            return self.ns / other.ns
        return RosDuration(nsecs=round(self.ns / other))

    def __neg__(self) -> RosDuration:
        return RosDuration(nsecs=-self.ns)


class RosTime(_Span):
    """An instant of the run."""

    __slots__ = ()

    def __init__(
        self,
        secs: float = 0,
        nsecs: int = 0,
        *,
        seconds: float = 0,
        nanoseconds: int = 0,
        clock_type: Any = None,
    ) -> None:
        del clock_type
        object.__setattr__(self, "ns", round((secs + seconds) * NS) + nsecs + nanoseconds)

    @classmethod
    def now(cls) -> RosTime:
        """The present instant."""
        from cobodeck.flexbe_states.ros.bridge import now_ns

        return cls(nsecs=now_ns())

    @classmethod
    def from_sec(cls, seconds: float) -> RosTime:
        """The instant so many seconds after the start."""
        return cls(seconds)

    @classmethod
    def from_msg(cls, message: Any, clock_type: Any = None) -> RosTime:
        """The instant of a message."""
        return cls(message.sec, message.nanosec, clock_type=clock_type)

    def __add__(self, other: Any) -> RosTime:
        return RosTime(nsecs=self.ns + _ns(other))

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        if isinstance(other, RosTime):
            return RosDuration(nsecs=self.ns - other.ns)
        return RosTime(nsecs=self.ns - _ns(other))


class RosRate:
    """A rate."""

    def __init__(self, hz: float = 10.0, *_others: Any) -> None:
        self.hz = hz
        self.sleep_dur = RosDuration(1.0 / hz)

    def sleep(self) -> None:
        """Let a period pass once the hook has returned."""
        from cobodeck.flexbe_states.ros.bridge import bridge

        bridge().sleep(1.0 / self.hz)

    def remaining(self) -> RosDuration:
        """Nothing is left to wait for."""
        return RosDuration()


class Blocks(RuntimeError):
    """A state would hold up the run."""


def refuse_to_wait(what: str) -> None:
    """What blocks is refused.

    Raises:
        Blocks: always.
    """
    raise Blocks(f"{what} would hold up the whole run; return None from execute, and look again")


def _ns(value: Any) -> int:
    return int(value.ns) if isinstance(value, _Span) else round(value * NS)
