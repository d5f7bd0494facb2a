"""Poses of robot and person from the samples that arrive, on a plant without ground truth.

No signal is requested: values whose signals do not arrive stay None. Contacts and energy are not
measured.
"""

from __future__ import annotations

from cobodeck.loop import Inlet
from engine import Stamped as Stamped
from hw import ArmState, Pose2, Pose3, Sample, Truth, UserPose
from hw.model import Footprint
from hw.sim.contact import gap
from states.signals import VelocityEstimator

WINDOW_S = 0.2
"""Window over which the person's speed is estimated, s."""
LOST_NS = 500_000_000
"""The person's position is unknown after a longer silence of tracking, ns."""
STRIDE_M = 0.05
"""Travelled distance is summed in steps of at least this length, m, so that noise adds nothing."""


class Senses:
    """Listens to the samples of an inlet; `truth` is the latest state that they give."""

    def __init__(self, inlet: Inlet, footprint: Footprint) -> None:
        self._footprint = footprint
        self._now = 0
        self._base: Pose2 | None = None
        self._counted: Pose2 | None = None
        self._distance_m = 0.0
        self._user: UserPose | None = None
        self._seen_ns: int | None = None
        self._velocity = VelocityEstimator(WINDOW_S)
        self._arm: ArmState | None = None
        self._request: Pose3 | None = None
        self._min_gap: float | None = None
        inlet.listen("base.pose", self._hear_base)
        inlet.listen("user.pose", self._hear_user)
        inlet.listen("arm.joints", self._hear_arm)
        inlet.listen("vr.haptic_request", self._hear_request)

    @property
    def truth(self) -> Truth:
        """The measured state, in place of the ground truth."""
        user, base = self._user if self._is_seen() else None, self._base
        velocity = self._velocity.value()
        return Truth(
            base=base,
            joints=None if self._arm is None else self._arm.joints,
            arm_moving=self._arm is not None and self._arm.moving,
            body=None if user is None else user.body,
            speed=0.0 if user is None or velocity is None else velocity.speed,
            request=self._request,
            seen_ns=self._seen_ns,
            head_turn=0.0 if user is None else user.head_yaw - user.body.yaw,
            distance_m=None if base is None else self._distance_m,
            min_gap=self._min_gap,
        )

    def _is_seen(self) -> bool:
        return self._seen_ns is not None and self._now - self._seen_ns <= LOST_NS

    def _hear_base(self, sample: Sample, now_ns: int) -> None:
        self._now = now_ns
        pose = sample.value
        if not isinstance(pose, Pose2):
            return
        self._base = pose
        counted = self._counted = self._counted or pose
        stride = counted.distance_to(pose)
        if stride >= STRIDE_M:
            self._distance_m, self._counted = self._distance_m + stride, pose
        self._watch_gap()

    def _hear_user(self, sample: Sample, now_ns: int) -> None:
        self._now = now_ns
        pose = sample.value
        if isinstance(pose, UserPose):
            self._user, self._seen_ns = pose, sample.stamp_ns
            self._velocity.update(sample.name, Stamped(pose, sample.stamp_ns))
            self._watch_gap()

    def _watch_gap(self) -> None:
        if self._base is not None and self._user is not None and self._is_seen():
            body = self._user.body
            found = gap(self._footprint, self._base, body.x, body.y)
            self._min_gap = found if self._min_gap is None else min(self._min_gap, found)

    def _hear_arm(self, sample: Sample, now_ns: int) -> None:
        self._now = now_ns
        if isinstance(sample.value, ArmState):
            self._arm = sample.value

    def _hear_request(self, sample: Sample, now_ns: int) -> None:
        self._now = now_ns
        self._request = sample.value if isinstance(sample.value, Pose3) else None
