"""Colours of charts; each has one meaning, and letters are legible on all that they stand on."""

from __future__ import annotations

from typing import Literal

Cause = Literal["", "guard", "timeout", "error"]
"""What an outcome comes from: a guard, a time limit, an error, or the node's own work."""

PAGE, INK, GREY = "#ffffff", "#1f2933", "#525d69"
AMBER, RED = "#8a5000", "#b71c1c"
FRAME, LIT_FRAME = "#9aa5b1", "#2e7d32"
FILLS = (PAGE, "#f6f8fa", "#eef1f5")
"""Backgrounds of boxes, by depth."""

KINDS = {  # border, fill, fill when active, style
    "do": ("#2e7d32", "#eaf5ea", "#b5e3b8", "rounded"),
    "watch": ("#c77700", "#fff6e0", "#ffdc8a", "rounded,dashed"),
    "use": ("#1f5fa8", "#e8f1fb", "#bddaf8", "rounded"),
}
CAUSES: dict[Cause, str] = {"": GREY, "guard": AMBER, "timeout": GREY, "error": RED}
ROOT_MARGIN, BOX_MARGIN = "22", "9"
"""From the frames of a chart and of its boxes to what is inside, points: routes bulge over it."""
