"""What shapes look like in pictures, and their signs in legends."""

from __future__ import annotations

from typing import Any, NamedTuple

from matplotlib.patheffects import withStroke

from engine.draw import INK, RED

ROBOT, FOAM, ROBOT_TRAIL = "#f4a522", "#ffe0a3", "#c77700"
USER, USER_NEAR, VIEW, PERSON = "#123f8c", "#3f7fd0", "#5c6773", "#b9cdec"
INFLATIONS = ("#e6e9ed", "#cdd3da", "#b4bcc6")
"""From the widest to the narrowest."""
TRACKED, OBJECT, ITEM, PLACE = "#8a94a0", "#b39b7d", "#e3a008", "#9c2f7f"
ARM, HELD = "#8ea3b8", "#7b5ea7"
PATH, DEEP, HAPTIC, DROPPED = "#00838f", "#1e66ff", "#2e7d32", "#7f8b98"
SCAN, COSTS = "#c62828", "#455a64"
LETTERS = {"escape": (RED, 7.0), "dropped": (DROPPED, 7.0), "haptic": (HAPTIC, 7.0)} | {
    "item": (INK, 7.5),
    "place": (PLACE, 7.5),
}
"""Colour and size of what is written beside shapes of a style."""
_DASHES, _DOTS, _SHORT = (0, (4, 2.5)), (0, (1, 2)), (0, (3, 1.5))

ArtistValues = dict[str, Any]


class Look(NamedTuple):
    """Values of matplotlib for what is drawn, and for its sign in legends if that differs."""

    drawn: ArtistValues
    sign: ArtistValues = {}


def _area(z: float, colour: str, edge: str = "none", width: float = 0.0) -> ArtistValues:
    return {"zorder": z, "fc": colour, "ec": edge, "lw": width}


def _border(z: float, colour: str, width: float, dash: Any = "-") -> ArtistValues:
    return {"zorder": z, "fill": False, "ec": colour, "lw": width, "ls": dash}


def _line(z: float, colour: str, width: float, **more: Any) -> ArtistValues:
    return {"zorder": z, "color": colour, "lw": width, **more}


def _dot(colour: str, edge: str, **more: Any) -> ArtistValues:
    return {"color": colour, "lw": 0, "marker": "o", "mec": edge, "ms": 7, **more}


_CASING = withStroke(linewidth=4.0, foreground="white", alpha=0.8)
_BUTT: ArtistValues = {"solid_capstyle": "butt"}
_RING = _dot("none", RED, mfc="none", mew=1.8, ms=9)

LOOKS = {
    "wall outline": Look(_border(5.0, INK, 3.0), {"fc": INK}),
    "wall poly": Look(_area(5.0, INK, INK, 0.8)),
    "object disc": Look(_area(4.0, OBJECT, INK, 0.6)),
    "object line": Look(_line(3.9, OBJECT, 1.2)),
    **{f"inflation-{n} poly": Look(_area(1.1 + n / 9, c)) for n, c in enumerate(INFLATIONS)},
    "tracked outline": Look(
        _border(1.9, TRACKED, 0.8, _DOTS), {"color": TRACKED, "lw": 0.8, "ls": _DOTS}
    ),
    "user disc": Look(_area(7.0, USER, "white", 0.8), {"fc": USER}),
    "view line": Look(_line(7.1, "white", 1.6)),
    "view arrow": Look(_line(7.0, VIEW, 2.2, mutation_scale=13.0)),
    "kept disc": Look(_area(4.0, USER_NEAR), {"fc": USER_NEAR, "alpha": 0.3}),
    "trail-user line": Look(_line(4.8, USER, 2.4, **_BUTT), {"alpha": 0.5}),
    "chase cells": Look({"zorder": 2.5}),
    "chase arrow": Look(_line(2.7, INK, 0.9)),
    "zone poly": Look(_area(3.0, RED)),
    "zone outline": Look(_border(4.6, RED, 0.9, _DASHES), {"color": RED, "lw": 0.9, "ls": _DASHES}),
    "escape arrow": Look(_line(6.0, RED, 2.0), {"marker": ">", "ms": 6}),
    "escape outline": Look(_border(8.5, RED, 1.8), _RING),
    "deep arrow": Look(_line(8.1, DEEP, 2.0, mutation_scale=10.0)),
    "deep disc": Look(_area(8.2, DEEP, "white", 0.8), _dot(DEEP, "white")),
    "haptic line": Look(_line(5.2, HAPTIC, 1.0, ls=_DASHES)),
    "haptic arrow": Look(_line(6.0, HAPTIC, 1.6), {"marker": "o", "markevery": [0], "ms": 6}),
    "haptic text": Look({}),
    "haptic disc": Look(_area(6.05, HAPTIC)),
    "dropped arrow": Look(_line(6.0, DROPPED, 2.0), {"marker": "x", "ms": 6}),
    "dropped text": Look({}),
    "dropped disc": Look(_area(6.05, DROPPED)),
    "dropped line": Look(_line(6.07, DROPPED, 1.8, solid_capstyle="round")),
    "trail-robot line": Look(_line(4.8, ROBOT_TRAIL, 2.4, **_BUTT), {"alpha": 0.5}),
    "scan dots": Look(_line(6.9, SCAN, 0.0, ls="", marker=".", ms=2.0)),
    "costmap poly": Look(_area(4.1, COSTS)),
    "costmap cells": Look({"zorder": 1.8}, {"fc": COSTS}),
    "path line": Look(_line(5.1, PATH, 2.0, path_effects=[_CASING])),
    "goal poly": Look(_area(5.3, "white")),
    "goal outline": Look(
        _border(8.5, PATH, 1.6, _SHORT), {"fc": "white", "ec": PATH, "lw": 1.6, "ls": _SHORT}
    ),
    "goal line": Look(_line(8.5, PATH, 1.6)),
    "goal disc": Look(_area(8.5, PATH)),
    "ring outline": Look(_border(6.0, INK, 0.7, ":")),
    "foam poly": Look(_area(6.1, FOAM, INK, 0.8)),
    "robot poly": Look(_area(6.2, ROBOT, INK, 0.8)),
    "front poly": Look(_area(6.3, INK, INK, 0.5)),
    "arm poly": Look(_area(6.4, ARM, INK, 0.5), _dot(ARM, INK)),
    "held poly": Look(_area(6.4, HELD, INK, 0.5), _dot(HELD, INK)),
    "item disc": Look(_area(8.5, ITEM, INK, 0.6)),
    "place arrow": Look(
        _line(8.6, PLACE, 1.4, mutation_scale=9.0),
        {"marker": "o", "mfc": "white", "markevery": [0], "ms": 6},
    ),
    "place outline": Look(_area(8.7, "white", PLACE, 1.4)),
    "left outline": Look(_border(4.0, INK, 1.0)),
    "footprint poly": Look(_area(4.0, FOAM, INK)),
    "footprint outline": Look(_border(4.0, INK, 1.0)),
    "footprint line": Look(_line(4.0, INK, 1.0)),
    "person disc": Look(_area(4.0, PERSON, USER)),
    "person outline": Look(_border(4.0, USER, 1.0)),
    "person line": Look(_line(4.0, USER, 1.0)),
}
"""By style and kind, in the order of legends; a ring or disc that is not filled is an outline."""
