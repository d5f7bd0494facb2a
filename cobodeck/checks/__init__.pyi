from cobodeck.checks.floor_space import (
    FloorReport as FloorReport,
    floor_report as floor_report,
)
from cobodeck.checks.room_checks import (
    small_floor as small_floor,
)
