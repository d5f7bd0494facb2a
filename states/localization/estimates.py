"""The estimated signals `base.pose` and `base.pose_sigma`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol

from hw import Pose2, PoseSigma
from states.signals import StampedPlace

SENSED = ("base.odometry", "base.imu", "base.scan", "rover.tracker")
"""Inputs of localization; only odometry is required before there is a pose."""


class Localizes(Protocol):
    """The interface of a localizer."""

    @property
    def pose(self) -> Pose2 | None:
        """map_from_base at `stamp_ns`; the same object while nothing has changed, None: unknown."""
        ...

    @property
    def sigma(self) -> PoseSigma:
        """Standard deviations of the pose."""
        ...

    @property
    def stamp_ns(self) -> int | None:
        """Stamp of the pose, ns: that of the newest wheel sample (or scan)."""
        ...

    @property
    def status(self) -> str:
        """What the pose is based on."""
        ...

    @property
    def drift(self) -> object | None:
        """How trackers and scanners differ, printable; None while they agree."""
        ...

    @property
    def counts(self) -> Mapping[str, int]:
        """Numbers of matches computed and skipped, and of corrections."""
        ...

    def take(self, stamp_ns: int, value: object) -> None:
        """Take one sample that is finite, as all on the board are."""
        ...


class PoseEstimate(NamedTuple):
    """map_from_base and its standard deviations."""

    pose: Pose2
    sigma: PoseSigma


class LocalizationEstimator:
    """The estimate of a `localizer`; None while it is lost, so that the last `base.pose` ages."""

    def __init__(self, localizer: Localizes) -> None:
        self.localizer = localizer
        self._value: PoseEstimate | None = None

    def update(self, _signal: str, sample: StampedPlace) -> None:
        """Take one sample of one of `SENSED`."""
        self.localizer.take(sample.stamp, sample.value)
        pose, before = self.localizer.pose, self._value
        if pose is None:
            self._value = None
            return
        sigma = self.localizer.sigma
        same = before is not None and before.pose is pose
        if before is None or not same or (before.sigma is not sigma and before.sigma != sigma):
            self._value = PoseEstimate(pose, sigma)

    def value(self) -> PoseEstimate | None:
        """The present estimate."""
        return self._value

    def stamp(self) -> int | None:
        """Stamp of the estimate, ns."""
        return self.localizer.stamp_ns


class PoseOf:
    """The pose of the newest estimate."""

    memoryless = True

    def __init__(self) -> None:
        self._value: Pose2 | None = None

    def update(self, _signal: str, sample: StampedPlace) -> None:
        """Take one estimate."""
        assert isinstance(sample.value, PoseEstimate)
        self._value = sample.value.pose

    def value(self) -> Pose2 | None:
        """map_from_base."""
        return self._value


class SigmaOf:
    """The standard deviations of the newest estimate."""

    memoryless = True

    def __init__(self) -> None:
        self._value: PoseSigma | None = None

    def update(self, _signal: str, sample: StampedPlace) -> None:
        """Take one estimate."""
        assert isinstance(sample.value, PoseEstimate)
        sigma = sample.value.sigma
        if self._value is not sigma and self._value != sigma:
            self._value = sigma

    def value(self) -> PoseSigma | None:
        """Standard deviations of position and yaw."""
        return self._value
