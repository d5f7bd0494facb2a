"""What a scanner would see, for tests of what goes by scans."""

from __future__ import annotations

import math

from hw.geometry import Pose2
from hw.samples import Scan
from hw.scene.room import Point

BEAMS = 720


def scan_of(*posts: Point, sensor: Pose2, radius: float = 0.2, name: str = "laser") -> Scan:
    """All round, of posts of this radius in the open; the range is not limited."""
    ranges = [math.inf] * BEAMS
    for i in range(BEAMS):
        angle = sensor.yaw - math.pi + 2.0 * math.pi * i / BEAMS
        for x, y in posts:
            dx, dy = x - sensor.x, y - sensor.y
            along = dx * math.cos(angle) + dy * math.sin(angle)
            aside = abs(dx * math.sin(angle) - dy * math.cos(angle))
            if along > 0.0 and aside < radius:
                ranges[i] = min(ranges[i], along - math.sqrt(radius**2 - aside**2))
    return Scan(name, -math.pi, 2.0 * math.pi / BEAMS, tuple(ranges))
