"""Colours of charts; each has one meaning."""

from __future__ import annotations

from typing import Literal

Cause = Literal["", "guard", "timeout", "error"]
"""What an outcome comes from: a guard, a time limit, an error, or the node's own work."""

INK, GREY, LINE = "#1f2933", "#6b7785", "#52606d"
AMBER, RED = "#b26a00", "#c62828"
FRAME, LIT_FRAME = "#9aa5b1", "#2e7d32"
FILLS = ("#ffffff", "#f6f8fa", "#eef1f5")
"""Backgrounds of boxes, by depth."""

KINDS = {  # border, fill, fill when active, style
    "do": ("#2e7d32", "#eaf5ea", "#8fd694", "rounded"),
    "watch": ("#c77700", "#fff6e0", "#ffd166", "rounded,dashed"),
    "use": ("#1f5fa8", "#e8f1fb", "#9cc7f5", "rounded"),
}
CAUSES: dict[Cause, str] = {"": LINE, "guard": AMBER, "timeout": LINE, "error": RED}
