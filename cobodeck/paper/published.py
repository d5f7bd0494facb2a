"""What section 5 of the paper prints (Mortezapoor et al., IEEE VR 2023)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class Printed(NamedTuple):
    """A row of Table 2: response, s, way of the base, m, and Escapes of 100 requests."""

    mean_s: float
    sd_s: float
    distance_m: float
    escapes: int


REQUESTS = 100
TABLE_2: Mapping[str, Printed] = {
    "chase": Printed(10.25, 1.27, 1130.94, 26),
    "corner": Printed(12.79, 1.07, 1554.40, 10),
    "center": Printed(13.00, 2.92, 1180.45, 15),
}


class PrintedTimes(NamedTuple):
    """Mean, SD and range of a time, s."""

    mean: float
    sd: float
    least: float
    most: float


ARM = PrintedTimes(3.70, 0.67, 3.20, 5.30)
TO_SAFETY = PrintedTimes(1.62, 0.52, 1.12, 1.87)
"""Its SD is impossible: in this range and with this mean it is at most 0.354 s, as a variance is at
most (max - mean)(mean - min) (Bhatia and Davis, 2000)."""
KRUSKAL_WALLIS_H = 27.62
EFFECTS = {"chase < corner": 0.85, "chase < center": 0.85, "corner < center": 0.14}
P_VALUES = {"chase < corner": "< 0.001", "chase < center": "< 0.001", "corner < center": "0.22"}
FREE_M2, USABLE_M2, ROUND_M2, SQUARE_M2 = 115.0, 62.0, 74.0, 71.0
"""Floor of the room, what an inflation of 1 m leaves of it, and of a round and a square room of the
same area with a column in the middle (5.1)."""
