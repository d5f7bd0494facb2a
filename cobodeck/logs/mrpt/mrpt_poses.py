"""Poses and pose distributions in MRPT archives; of a distribution only the mean is read."""

from __future__ import annotations

import math
from collections.abc import Callable

from cobodeck.logs.mrpt.archive_reader import ArchiveReader, Kinds
from hw import Pose2, Pose3, unit_quaternion, wrap

PoseRows = tuple[tuple[float, ...], ...]


def _pose2(reader: ArchiveReader, version: int) -> Pose2:
    x, y, yaw = reader.numbers("3f" if version == 0 else "3d")
    return Pose2(x, y, wrap(yaw) if math.isfinite(yaw) else yaw)


def _pose3(reader: ArchiveReader, version: int) -> Pose3:
    if version in (0, 1):
        rows = reader.part()
        return Pose3.from_matrix(rows)
    if version == 2:
        return _quaternion_pose(reader, version)
    x, y, z, *matrix = reader.numbers("12d")
    return Pose3.from_matrix(((*matrix[:3], x), (*matrix[3:6], y), (*matrix[6:], z)))


def _quaternion_pose(reader: ArchiveReader, _version: int) -> Pose3:
    x, y, z, qw, qx, qy, qz = reader.numbers("7d")
    return Pose3(x, y, z, *unit_quaternion(qx, qy, qz, qw))


def _matrix(form: str) -> Callable[[ArchiveReader, int], PoseRows]:
    def read(reader: ArchiveReader, _version: int) -> PoseRows:
        rows, columns = reader.numbers("2I")
        if rows > 64 or columns > 64:
            rows = reader.count(1 << 60)  # larger than any matrix of a pose: refuse
        return tuple(reader.numbers(f"{columns}{form}") for _ in range(rows))

    return read


def _gaussian2(reader: ArchiveReader, version: int) -> Pose2:
    mean: Pose2 = reader.part()
    if version == 0:
        reader.part()
    else:
        reader.numbers("6f" if version == 1 else "6d")
    return mean


def _gaussian3(reader: ArchiveReader, version: int) -> Pose3:
    mean: Pose3 = reader.part()
    if version == 0:
        reader.part()
    else:
        reader.numbers("21d")
    return mean


def _information2(reader: ArchiveReader, _version: int) -> Pose2:
    return Pose2(*reader.numbers("9d")[:3])


def _information3(reader: ArchiveReader, _version: int) -> Pose3:
    mean: Pose3 = reader.part()
    reader.numbers("21d")
    return mean


def _particles2(reader: ArchiveReader, version: int) -> Pose2:
    """The weighted mean of particles, circular for the yaw; stored weights are logarithms."""
    weights, poses = [], []
    for _ in range(reader.count(16)):
        weights.append(reader.number("d"))
        poses.append(reader.part() if version == 0 else Pose2(*reader.numbers("3d")))
    if not poses:
        return Pose2(0.0, 0.0)
    top = max(weights)
    shares = [math.exp(weight - top) for weight in weights]
    total = sum(shares)
    pairs = list(zip(shares, poses, strict=True))
    return Pose2(
        sum(share * pose.x for share, pose in pairs) / total,
        sum(share * pose.y for share, pose in pairs) / total,
        math.atan2(
            sum(share * math.sin(pose.yaw) for share, pose in pairs),
            sum(share * math.cos(pose.yaw) for share, pose in pairs),
        ),
    )


POSES: Kinds = {
    "CPose2D": _pose2,
    "CPose3D": _pose3,
    "CPose3DQuat": _quaternion_pose,
    "CMatrix": _matrix("f"),
    "CMatrixF": _matrix("f"),
    "CMatrixD": _matrix("d"),
    "CPosePDFGaussian": _gaussian2,
    "CPosePDFGaussianInf": _information2,
    "CPosePDFParticles": _particles2,
    "CPose3DPDFGaussian": _gaussian3,
    "CPose3DPDFGaussianInf": _information3,
}
