"""The campaigns that vary one thing each: what it is, and which of its values is ours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

OneRun = Mapping[str, Any]
"""A cell as `campaign --json` prints it: its key, seed, figures and CPU."""


@dataclass(frozen=True, slots=True)
class SystemKnob:
    """A shipped campaign that varies one thing, from run to run of the same people.

    `key` is the field of a cell, or of its `sets` the dotted key, that is varied; `ours` is the
    value without a change. `names` are those of its values in the order of the campaign; if there
    are none, values are called as they are written.
    """

    campaign: str
    title: str
    key: str
    ours: str
    names: tuple[str, ...] = ()

    def grouped(self, cells: Sequence[OneRun]) -> dict[str, list[OneRun]]:
        """The cells of each value, by its name, in the order of the campaign."""
        groups: dict[str, list[OneRun]] = {}
        for cell in cells:
            groups.setdefault(_value(cell["key"], self.key), []).append(cell)
        if not self.names:
            return groups
        return dict(zip(self.names, groups.values(), strict=True))


def _value(key: Mapping[str, Any], varied: str) -> str:
    if varied in key:
        return str(key[varied])
    pairs = (str(text).partition("=") for text in key["sets"])
    return next(value for name, _, value in pairs if name == varied)


_GRIDS = ("20 cm", "5 cm")
PRECISION = (
    SystemKnob("precision_tick", "ticks per second", "tick_hz", "30"),
    SystemKnob("precision_cell", "cells of Chase", "chase.cell", "5 cm"),
    SystemKnob(
        "precision_tolerance", "tolerance of drives", "navigation", "5 cm",
        ("1 cm", "2 cm", "5 cm", "10 cm", "20 cm"),
    ),
    SystemKnob(
        "precision_planner", "planner, and its grid", "navigation", "exact",
        (*(f"theta* {grid}" for grid in _GRIDS), *(f"navfn {grid}" for grid in _GRIDS), "exact"),
    ),
    SystemKnob("precision_beams", "beams matched", "localizer.beams", "180"),
    SystemKnob(
        "precision_particles", "particles of AMCL", "localizer.particles", "KLD",
        ("100", "1000", "KLD"),
    ),
    SystemKnob("precision_window", "window, 5 cm of noise", "user.window", "0.3 s"),
    SystemKnob("precision_tier", "tier", "tier", "1"),
)  # fmt: skip
KEYS = (
    SystemKnob(
        "key_acceleration", "robot.\nbase_acceleration", "robot.base_acceleration", "1.0 m/s2"
    ),
    SystemKnob(
        "key_follows", "navigation.\nchase.max_speed", "navigation.chase.max_speed", "1.5 m/s"
    ),
    SystemKnob(
        "key_serves", "navigation.\nhaptic.max_speed", "navigation.haptic.max_speed", "1.5 m/s"
    ),
    SystemKnob(
        "key_round", "navigation.\nhaptic.user_radius", "navigation.haptic.user_radius", "1.6 m"
    ),
    SystemKnob("key_outer", "chase.outer", "chase.outer", "4.0 m"),
    SystemKnob("key_risk", "chase.risk", "chase.risk", "6"),
    SystemKnob("key_room", "chase.room", "chase", "3.4 m", ("2.8 m", "3.1 m", "3.4 m", "3.8 m")),
    SystemKnob("key_near", "chase.near", "chase.near", "3.4 m"),
    SystemKnob("key_contact", "escape.contact", "escape.contact", "1.27 m"),
    SystemKnob("key_reaction", "escape.reaction", "escape.reaction", "0.15 s"),
    SystemKnob("key_warning", "escape.warning", "escape.warning", "2.5 s"),
    SystemKnob("key_least", "inform.least", "inform.least", "4 s"),
)
"""The keys of the profile that a person may want to set; titles are theirs."""
_PACES = tuple(f"{speed:g} m/s" for speed in (0.5, 1.0, 1.5, 2.0, 2.5))
DISTURBED = (
    SystemKnob("disturbed_delay", "delay of tracking", "plant.tracking_delay", "0 ms"),
    SystemKnob("disturbed_noise", "noise of tracking", "plant.tracking_noise", "0 cm"),
    SystemKnob("disturbed_latency", "latency of the robot", "plant.latency", "0 ms"),
    SystemKnob(
        "disturbed_slip", "slip, of linoleum's", "plant.sensing.slip", "×1",
        ("×0", "×1", "×2", "×3", "×5"),
    ),
    SystemKnob("disturbed_speed", "speed, attentive", "user", "1 m/s", _PACES),
    SystemKnob("disturbed_deaf", "speed, deaf to the sign", "user", "1 m/s", _PACES),
)  # fmt: skip
