"""Writes MRPT archives, of any version of a class, by their fields: no code of the reader's."""

import struct

OLD, NEW = "old", "new"


def pack(form, *values):
    return struct.pack("<" + form, *values)


def text(words):
    return pack("I", len(words)) + words.encode()


def thing(name, version, fields, form=NEW):
    """An object with its header and, in the new form, its end."""
    raw = name.encode()
    if form == OLD:
        return pack("I", len(raw)) + raw + pack("i", version) + fields
    return bytes([len(raw) | 0x80]) + raw + bytes([version]) + fields + b"\x88"


def pose2(x, y, yaw, version=1, form=NEW):
    return thing("CPose2D", version, pack("3f" if version == 0 else "3d", x, y, yaw), form)


def matrix(rows, name="CMatrix", form=NEW):
    letter = "d" if name == "CMatrixD" else "f"
    body = b"".join(pack(f"{len(row)}{letter}", *row) for row in rows)
    return thing(name, 0, pack("2I", len(rows), len(rows[0])) + body, form)


def pose3(x, y, z, yaw_turn, version=3, form=NEW, upside_down=False):
    """A pose by (cosine, sine) of its yaw; upside down it is turned by pi about its own x, too."""
    c, s = yaw_turn
    flip = -1.0 if upside_down else 1.0
    rows = [[c, -s * flip, 0.0, x], [s, c * flip, 0.0, y], [0.0, 0.0, flip, z], [0, 0, 0, 1]]
    if version == 0:
        fields = matrix(rows, "CMatrix", form)
    elif version == 1:
        fields = matrix(rows, "CMatrixD", form)
    elif version == 2:
        half_c, half_s = ((1 + c) / 2) ** 0.5, ((1 - c) / 2) ** 0.5
        fields = pack("7d", x, y, z, half_c, 0.0, 0.0, half_s)
    else:
        fields = pack("3d", x, y, z) + b"".join(pack("3d", *row[:3]) for row in rows[:3])
    return thing("CPose3D", version, fields, form)


def scan(
    ranges,
    version=7,
    form=NEW,
    ticks=10_000_000,
    aperture=3.0,
    right_to_left=True,
    label="front",
    mount=None,
    name="CObservation2DRangeScan",
    most=80.0,
):
    fields = pack("fBf", aperture, right_to_left, most)
    fields += mount if mount is not None else pose3(0.5, 0.25, 0.3, (1.0, 0.0), 0, form)
    if version < 6:
        fields += matrix([[0.0] * 6] * 6, form=form)
    fields += pack("I", len(ranges)) + pack(f"{len(ranges)}f", *ranges)
    fields += bytes(0 < r < most for r in ranges) if version >= 1 else b""
    fields += pack("f", 0.01) if version >= 2 else b""
    fields += pack("Q", ticks) if version >= 3 else b""
    fields += pack("f", 0.004) if version >= 4 else b""
    fields += text(label) + pack("d", 0.0) if version >= 5 else b""
    fields += b"\1" + pack(f"{len(ranges)}i", *range(len(ranges))) if version >= 7 else b""
    return thing(name, version, fields, form)


def frame(*observations, version=2, form=NEW, name="CSensoryFrame"):
    fields = pack("I", 7) if version < 2 else b""
    fields += pack("Q", 10_000_000) if version == 0 else b""
    return thing(
        name, version, fields + pack("I", len(observations)) + b"".join(observations), form
    )


def gaussian(x, y, yaw, version=2, form=NEW):
    fields = pose2(x, y, yaw, 1, form)
    fields += (
        matrix([[0.0] * 3] * 3, form=form)
        if version == 0
        else pack("6f" if version == 1 else "6d", *[0.0] * 6)
    )
    return thing("CPosePDFGaussian", version, fields, form)


def movement(x, y, yaw, version=7, form=NEW, by_wheels=True):
    method = pack("I", 0 if by_wheels else 1)
    if version < 2:
        fields = gaussian(x, y, yaw, 1, form) + method
    elif by_wheels:
        model = {2: 44, 3: 44, 4: 48}.get(version, 56)
        fields = method + pose2(x, y, yaw, 1, form) + b"\x5a" * model
    else:
        fields = method + gaussian(x, y, yaw, 2, form)
    if version >= 7:
        fields += b"\1" + pack("3d", 1.0, 0.0, 0.1) + b"\0"
    elif version >= 1:
        fields += b"\x5a" + pack("2f", 1.0, 0.1) + b"\1" + pack("2i", 3, 4)
    fields += pack("Q", 0) if version >= 6 else b""
    return thing("CActionRobotMovement2D", version, fields, form)


def actions(*moves, form=NEW):
    return thing("CActionCollection", 0, pack("I", len(moves)) + b"".join(moves), form)


def odometry(x, y, yaw, ticks, version=2, form=NEW):
    fields = pose2(x, y, yaw, 1, form) + text("wheels") + pack("Q", ticks)
    if version == 1:
        fields += b"\0" + pack("2i", 0, 0) + b"\0" + pack("2f", 0.0, 0.0)
    elif version == 2:
        fields += b"\1" + pack("2i", 1, 2) + b"\1" + pack("3d", 1.0, 0.0, 0.0)
    return thing("CObservationOdometry", version, fields, form)


def inertial(values, ticks, version=4, mount=None):
    """Values: ax, ay, az, then the rates as this version has them."""
    count = 31 if version >= 4 else 15
    values = [*values, *[0.0] * (count - len(values))]
    fields = mount if mount is not None else pose3(0.0, 0.0, 0.0, (1.0, 0.0))
    sized = pack("I", count) if version < 4 else b""
    letter = "f" if version == 0 else "d"
    fields += sized + b"\1" * count + pack("Q", ticks)
    fields += sized + pack(f"{count}{letter}", *values) + text("imu")
    return thing("CObservationIMU", version, fields)
