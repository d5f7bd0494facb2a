"""The frames of a drive that was made up, found again from noisy readings."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hw.geometry import Pose2, Pose3
from states.localization.calibration.hand_eye import CalibrationProblem, first_guess
from states.localization.calibration.pose_pairs import pairs_of
from states.localization.calibration.tracker_calibration import (
    BaseReading,
    Calibration,
    NoCalibration,
    TrackerReading,
    calibrate,
)

MS = 1_000_000
Path = Callable[[float], tuple[float, float, float]]


def posed(x: float, y: float, z: float, *rotation_vector: float) -> Pose3:
    return Pose3(x, y, z, *Rotation.from_rotvec(rotation_vector).as_quat().tolist())


MOUNTS = {
    "front": posed(0.45, 0.30, 0.62, 1.2, -0.4, 0.7),
    "back": posed(-0.47, -0.31, 0.63, 0.1, 2.9, -0.3),
}
MAP_FROM_VIVE = Pose3.from_yaw(3.0, -2.0, 0.0, 1.1) @ posed(0, 0, 0, 0.004, -0.006, 0.0)
STANDING_UP = Pose3.from_yaw(3.0, -2.0, 0.0, 1.1) @ posed(0, 0, 0, math.pi / 2, 0, 0)
SCANNERS = {"front": Pose2(0.2865, -0.2089, 0.0), "back": Pose2(-0.2865, 0.2089, math.pi)}


def roam(t: float) -> tuple[float, float, float]:
    """Through a 5 x 4 m room with turns both ways."""
    return 5 + 2.5 * math.sin(0.23 * t), 4 + 2 * math.sin(0.31 * t + 1), 2.5 * math.sin(0.17 * t)


def straight(t: float) -> tuple[float, float, float]:
    return 5 + 2.5 * math.sin(0.23 * t), 4 + 2 * math.sin(0.31 * t + 1), 0.3


def on_the_spot(t: float) -> tuple[float, float, float]:
    return 5.0, 4.0, 2.5 * math.sin(0.17 * t)


class Drive:
    """Readings of trackers at 25 Hz (0.3 mm, 0.02 degrees) and of a matcher at 12.5 Hz."""

    def __init__(self, seed: int, path: Path = roam, seconds: float = 30.0) -> None:
        self.chance = np.random.default_rng(seed)
        self.path, self.seconds = path, seconds
        self.map_from_vive = MAP_FROM_VIVE
        self.noise, self.matched = (3e-4, math.radians(0.02)), (5e-3, math.radians(0.15))
        self.late = 0.0
        self.yaws: dict[str, float] = {}

    def trackers(self) -> list[TrackerReading]:
        vive_from_map = self.map_from_vive.inverse()
        readings = []
        for ms in range(0, round(self.seconds * 1000), 40):
            x, y, yaw = self.path(ms / 1000)
            for name, mount in MOUNTS.items():
                place, turn = self.chance.normal(size=(2, 3))
                noise = posed(*(self.noise[0] * place), *(self.noise[1] * turn))
                pose = vive_from_map @ Pose3.from_yaw(x, y, 0.0, yaw) @ mount @ noise
                readings.append(TrackerReading(ms * MS + round(self.late * 1e9), name, pose))
        return readings

    def bases(self) -> list[BaseReading]:
        readings = []
        for ms in range(0, round(self.seconds * 1000), 80):
            x, y, yaw = self.path(ms / 1000)
            for name in self.yaws or ("",):
                dx, dy, turn = self.chance.normal(size=3) * (
                    self.matched[0], self.matched[0], self.matched[1],
                )  # fmt: skip
                base = Pose2(x, y, yaw)
                if name:  # what is matched is the scanner; the base comes from its nominal mount
                    nominal = SCANNERS[name]
                    base = base @ nominal @ Pose2(0, 0, self.yaws[name]) @ nominal.inverse()
                base = Pose2(base.x + dx, base.y + dy, base.yaw + turn)
                readings.append(BaseReading(ms * MS, base, name))
        return readings


def found(result: Calibration | NoCalibration) -> Calibration:
    assert isinstance(result, Calibration), result
    return result


def refused(result: Calibration | NoCalibration) -> NoCalibration:
    assert isinstance(result, NoCalibration), result
    return result


def degrees_between(one: Pose3, other: Pose3) -> float:
    return math.degrees(one.angle_to(other))


@pytest.mark.parametrize(("map_from_vive", "tilt"), [(MAP_FROM_VIVE, 0.413), (STANDING_UP, 90.0)])
def test_all_frames_are_found_at_once(map_from_vive: Pose3, tilt: float) -> None:
    """Whichever way up the tracking counts and whichever way trackers are screwed on."""
    drive = Drive(1)
    drive.map_from_vive = map_from_vive
    result = found(calibrate(drive.trackers(), drive.bases()))
    assert result.map_from_vive.distance_to(map_from_vive) < 3e-3
    assert degrees_between(result.map_from_vive, map_from_vive) < 0.02
    for name, mount in MOUNTS.items():
        assert result.mounts[name].distance_to(mount) < 2e-3
        assert degrees_between(result.mounts[name], mount) < 0.03
    assert result.position_rms < 5e-3
    assert result.yaw_rms < math.radians(0.1)
    assert math.degrees(result.tilt) == pytest.approx(tilt, abs=0.02)


@pytest.mark.slow
def test_its_sigmas_are_those_of_many_drives() -> None:
    """Thirty errors in units of their sigmas have a spread of about 1."""
    ratios = []
    for seed in range(6):
        drive = Drive(seed, seconds=30.0)
        result = found(calibrate(drive.trackers(), drive.bases()))
        yaw_off = math.remainder(result.map_from_vive.yaw - MAP_FROM_VIVE.yaw, math.tau)
        ratios.append(yaw_off / result.sigmas["vive about z"])
        for name, mount in MOUNTS.items():
            for axis in "xy":
                off = getattr(result.mounts[name], axis) - getattr(mount, axis)
                ratios.append(off / result.sigmas[f"{name} {axis}"])
    assert 0.7 < np.std(ratios) < 1.4
    assert np.abs(ratios).max() < 3.5


@pytest.mark.parametrize("seed", range(2))
def test_a_restart_of_the_tracking_is_found_again(seed: int) -> None:
    """It turned the frame by 0.9 degrees; the mounts are known, and twenty seconds are enough."""
    first = Drive(seed)
    mounts = found(calibrate(first.trackers(), first.bases())).mounts
    again = Drive(seed + 100, seconds=20.0)
    again.map_from_vive = MAP_FROM_VIVE @ posed(0.05, -0.03, 0.0, 0, 0, math.radians(0.9))
    result = found(calibrate(again.trackers(), again.bases(), mounts=mounts))
    turned = result.map_from_vive.yaw - MAP_FROM_VIVE.yaw
    assert math.degrees(turned) == pytest.approx(0.9, abs=0.02)
    here = (5.0, 4.0, 0.6)
    seen = again.map_from_vive.inverse().transform(*here)
    assert math.dist(result.map_from_vive.transform(*seen), here) < 3e-3


def test_a_restart_in_the_middle_of_a_log_contradicts_it() -> None:
    before, after = Drive(4, seconds=30.0), Drive(5, seconds=45.0)
    after.map_from_vive = MAP_FROM_VIVE @ posed(0.05, 0.0, 0.0, 0, 0, math.radians(0.9))
    late = [r for r in after.trackers() if r.stamp_ns >= 30_000 * MS]
    bases = [r for r in after.bases() if r.stamp_ns >= 30_000 * MS]
    result = refused(calibrate(before.trackers() + late, before.bases() + bases))
    assert result.reason == "residual"
    assert "5 mm and 0.1 degrees are allowed" in result.text
    assert result.found is not None
    assert result.found.position_rms > 5e-3


def test_some_jumps_do_not_spoil_the_rest() -> None:
    """Three seconds of one tracker off by 40 mm."""
    drive = Drive(6)
    readings = [
        reading._replace(vive_from_tracker=posed(0.04, 0, 0, 0, 0, 0) @ reading.vive_from_tracker)
        if reading.tracker == "front" and 10_000 * MS <= reading.stamp_ns < 13_000 * MS
        else reading
        for reading in drive.trackers()
    ]
    result = calibrate(readings, drive.bases())
    calibration = result if isinstance(result, Calibration) else refused(result).found
    assert calibration is not None
    assert calibration.map_from_vive.distance_to(MAP_FROM_VIVE) < 4e-3
    assert degrees_between(calibration.map_from_vive, MAP_FROM_VIVE) < 0.03


def test_a_base_that_never_turned_leaves_the_mounts_open() -> None:
    drive = Drive(7, straight)
    result = refused(calibrate(drive.trackers(), drive.bases()))
    assert result.reason == "motion"
    for name in ("vive x", "front x", "back y"):
        assert name in result.text
    assert "about z" not in result.text


def test_a_base_that_only_turned_leaves_the_yaw_open() -> None:
    drive = Drive(8, on_the_spot)
    result = refused(calibrate(drive.trackers(), drive.bases()))
    assert result.reason == "motion"
    assert "vive about z" in result.text
    with_mounts = Drive(8, on_the_spot)
    assert isinstance(
        calibrate(with_mounts.trackers(), with_mounts.bases(), mounts=MOUNTS), Calibration
    )


def test_scanners_that_are_turned_are_told_apart() -> None:
    """0.11 degrees are 1 cm at 5 m. With unknown mounts the mean of both turns stays hidden."""
    turned = {"front": math.radians(0.25), "back": math.radians(-0.15)}
    drive = Drive(9)
    drive.yaws = turned
    trackers, bases = drive.trackers(), drive.bases()
    result = found(calibrate(trackers, bases, scanners=SCANNERS))
    apart = result.scanner_yaws["front"] - result.scanner_yaws["back"]
    assert math.degrees(apart) == pytest.approx(0.40, abs=0.02)
    known = found(calibrate(trackers, bases, scanners=SCANNERS, mounts=MOUNTS))
    for name, yaw in turned.items():
        assert math.degrees(known.scanner_yaws[name] - yaw) == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("late", [-0.015, 0.02])
def test_clocks_that_differ_are_set(late: float) -> None:
    drive = Drive(10)
    drive.late = late
    result = found(calibrate(drive.trackers(), drive.bases()))
    assert result.clock_offset == pytest.approx(-late, abs=2e-3)


def test_the_jacobian_is_the_numerical_derivative() -> None:
    """Where both ways agree: the analytic one is meant for turns that are nearly equal."""
    drive = Drive(13, seconds=12.0)
    drive.noise = drive.matched = (0.0, 0.0)
    drive.yaws = {"front": 0.0, "back": 0.0}
    pairs = pairs_of(drive.trackers(), drive.bases(), 1.0)
    nominal = [SCANNERS[name] for name in pairs.scanners]
    problem = CalibrationProblem(pairs, 3, [0, 1], nominal, (1.0, 1.0, 1.0))
    frames = first_guess(pairs, None)
    analytic = problem.jacobian(frames)
    for at in range(problem.unknowns):
        h = np.zeros(problem.unknowns)
        h[at] = 1e-2 if at == problem.unknowns - 1 else 1e-5
        ahead, behind = (problem.residuals(problem.moved(frames, s * h)) for s in (1, -1))
        numerical = (ahead - behind) / (2 * h[at])
        scale = np.abs(numerical).max()
        np.testing.assert_allclose(analytic[:, at], numerical, atol=1e-3 * scale)


def test_too_few_readings_are_no_calibration() -> None:
    drive = Drive(11, seconds=3.0)
    assert refused(calibrate(drive.trackers(), drive.bases())).reason == "data"
    assert refused(calibrate([], drive.bases())).reason == "data"
    assert refused(calibrate(drive.trackers(), [])).reason == "data"
    gaps = Drive(11).bases()[::10]  # 0.8 s: nobody knows where the base was between
    assert refused(calibrate(Drive(11).trackers(), gaps)).reason == "data"


def test_names_that_nobody_described_are_refused() -> None:
    drive = Drive(12)
    drive.yaws = {"front": 0.0}
    trackers, bases = drive.trackers(), drive.bases()
    with pytest.raises(ValueError, match=r"scanners: there is none of front"):
        calibrate(trackers, bases)
    with pytest.raises(ValueError, match=r"mounts: there is none of front"):
        calibrate(trackers, bases, scanners=SCANNERS, mounts={"back": MOUNTS["back"]})
