"""The arm seen from above, as the capsules that enclose its links."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from matplotlib.lines import Line2D

from cobodeck.evaluate import ArmOutline
from cobodeck.pictures.drawing.canvas import Sheet
from cobodeck.pictures.drawing.room_drawing import add_area
from engine.draw import INK
from hw import Joints, Pose2

ARM, HELD = "#8ea3b8", "#7b5ea7"


def draw_arm(on: Sheet, base: Pose2, joints: Joints, arm: ArmOutline, zorder: float = 6.4) -> None:
    """The links at `joints`, rad, on a rover at `base`; higher links are drawn over lower ones."""
    ends, radii = arm.capsules_of(joints)
    for k in np.argsort(ends[:, :, 2].mean(axis=1), kind="stable").tolist():
        axis = [base.transform(float(x), float(y)) for x, y, _ in ends[k]]
        area = shapely.LineString(axis).buffer(float(radii[k]), quad_segs=6)
        colour = HELD if arm.parts[k] == arm.held else ARM
        add_area(on, area, facecolor=colour, edgecolor=INK, linewidth=0.5, zorder=zorder)
    look: dict[str, Any] = {"lw": 0, "marker": "o", "mec": INK, "ms": 7}
    on.explain("arm", Line2D([], [], mfc=ARM, **look))
    if arm.held in arm.parts:
        on.explain(f"held: {arm.held}", Line2D([], [], mfc=HELD, **look))
