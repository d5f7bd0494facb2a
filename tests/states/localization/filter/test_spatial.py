"""The filter in space on a real log, and the conversions about it."""

from __future__ import annotations

import gzip
import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, strategies as st
from rosbags.rosbag1 import Reader
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from hw.geometry import Pose3
from states.localization.filter.measurement_sources import (
    FilterConfig,
    Measurement,
    MeasurementSource,
    ProcessNoise,
)
from states.localization.filter.spatial import (
    AXES,
    GRAVITY,
    SpatialFilter,
    without_gravity,
)

DATA = Path(__file__).resolve().parents[5] / "shared/data/ekf"
ANGLES = st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1)


@given(*ANGLES)
def test_angles_and_quaternions_are_those_of_scipy(roll, pitch, yaw) -> None:
    turn = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    pose = Pose3.from_angles(0.0, 0.0, 0.0, (roll, pitch, yaw))
    assert abs(np.dot(pose.as_motion()[3:], turn.as_quat())) == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(pose.roll_pitch_yaw, (roll, pitch, yaw), atol=1e-7)


@given(*ANGLES)
def test_gravity_is_what_an_accelerometer_tells_at_rest(roll, pitch, yaw) -> None:
    world_from_body = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    told = world_from_body.inv().apply([0.0, 0.0, GRAVITY])
    np.testing.assert_allclose(without_gravity(tuple(told), roll, pitch), 0.0, atol=1e-13)


def test_a_helix_is_followed() -> None:
    """Known rates and velocity alone: at 100 Hz the way on a circle is right to 2 %."""
    f = SpatialFilter(
        FilterConfig(
            (MeasurementSource("all", ("vx", "vy", "vz", "wx", "wy", "wz")),),
            ProcessNoise((1e-3,) * 15, (0.0,) * 15, (0.0,) * 15),
            (1e-6,) * 6 + (1.0,) * 9,
        )
    )
    for n in range(201):
        f.correct(Measurement(n * 10_000_000, "all", (1.0, 0, 0.2, 0, 0, 1.0), (1e-8,) * 6))
    expected = (math.sin(2.0), 1.0 - math.cos(2.0), 0.4)
    np.testing.assert_allclose((f.pose.x, f.pose.y, f.pose.z), expected, atol=0.03)
    assert f.pose.yaw == pytest.approx(2.0, abs=1e-3)


def test_the_jackal_ends_where_robot_localization_says(tmp_path: Path) -> None:
    """61 s of IMU and wheels by the published configuration; its tolerance is 13.8 cm."""
    if not DATA.exists():
        pytest.skip("the shared log of the Jackal is not here")
    documents = yaml.safe_load((DATA / "ekf_bag2.yaml").read_text())
    told = documents["test_ekf_localization_node_bag2_ekf"]["ros__parameters"]
    pose = documents["test_ekf_localization_node_bag2_pose"]["ros__parameters"]

    f = SpatialFilter(
        FilterConfig(
            (
                MeasurementSource("imu", chosen(told["imu0_config"]), gate=None),
                MeasurementSource("odom", chosen(told["odom0_config"]), gate=None),
            ),
            ProcessNoise(diagonal(told["process_noise_covariance"]), (0.0,) * 15, (0.0,) * 15),
            tuple(math.sqrt(v) for v in diagonal(told["initial_estimate_covariance"])),
        )
    )
    bag = tmp_path / "jackal.bag"
    bag.write_bytes(gzip.decompress((DATA / "test2.bag.gz").read_bytes()))
    store = get_typestore(Stores.ROS1_NOETIC)
    with Reader(bag) as reader:
        for connection, _, raw in reader.messages():
            message = store.deserialize_ros1(raw, connection.msgtype)
            f.correct(imu(message) if "Imu" in connection.msgtype else odometry(message))
    assert f.counts["imu", "accepted"] == 3061
    assert f.counts["odom", "accepted"] == 3060
    expected = (pose["final_x"], pose["final_y"], pose["final_z"])
    assert math.dist((f.pose.x, f.pose.y, f.pose.z), expected) <= pose["tolerance"]


def chosen(switches: list[bool]) -> tuple[str, ...]:
    return tuple(axis for axis, on in zip(AXES, switches, strict=True) if on)


def diagonal(numbers: list[float | str]) -> tuple[float, ...]:
    return tuple(float(v) for v in numbers[:: len(AXES) + 1])


def stamp_of(message) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def imu(message) -> Measurement:
    q, w, a = message.orientation, message.angular_velocity, message.linear_acceleration
    angles = Pose3(0.0, 0.0, 0.0, q.x, q.y, q.z, q.w).roll_pitch_yaw
    free = without_gravity((a.x, a.y, a.z), *angles[:2])
    spread = np.zeros((9, 9))
    spread[:3, :3] = message.orientation_covariance.reshape(3, 3)
    spread[3:6, 3:6] = message.angular_velocity_covariance.reshape(3, 3)
    spread[6:, 6:] = message.linear_acceleration_covariance.reshape(3, 3)
    return Measurement(stamp_of(message), "imu", (*angles, w.x, w.y, w.z, *free), spread)


def odometry(message) -> Measurement:
    v, w = message.twist.twist.linear, message.twist.twist.angular
    axes = [0, 1, 2, 5]
    spread = message.twist.covariance.reshape(6, 6)[np.ix_(axes, axes)]
    return Measurement(stamp_of(message), "odom", (v.x, v.y, v.z, w.z), spread)
