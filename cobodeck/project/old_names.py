"""Names of states and charts that are gone, and what there is in their place."""

from __future__ import annotations

from collections.abc import Mapping

_PARKED = (
    "it is condition_parked, by the profile paper paper_condition_parked, with "
    "--in 'parking={{place: {}}}'"
)
OLD_CHARTS: Mapping[str, str] = {
    "paper_corner": _PARKED.format("corner"),
    "paper_center": _PARKED.format("center"),
    "paper_parked": "it is condition_parked, by the profile paper paper_condition_parked",
    "paper_parking": "it is condition_parking, and its guards stand in condition_parked",
}
OLD_STATES: Mapping[str, str] = {
    "Flee": "`use: escape`, or beside each other OutOfDanger, NoEscapePose, TouchAhead and "
    "DriveToBest, as in the chart escape",
    "GiveUp": "a timeout of the node, as `stay` of the chart paper_chase has it",
}
