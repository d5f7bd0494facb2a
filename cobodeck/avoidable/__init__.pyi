from cobodeck.avoidable.envelope import (
    HALF_LENGTH as HALF_LENGTH,
    STANDING as STANDING,
    WALL_M as WALL_M,
    Oncoming as Oncoming,
    asked as asked,
    gap_beside_turning as gap_beside_turning,
    least_distance as least_distance,
)
from cobodeck.avoidable.escape_report import (
    JudgedRun as JudgedRun,
    contacts_avoidable as contacts_avoidable,
    judged_run as judged_run,
    text as text,
)
from cobodeck.avoidable.judged import (
    JudgedEvent as JudgedEvent,
)
from cobodeck.avoidable.motion_search import (
    RADIUS as RADIUS,
    Question as Question,
    RobotLimits as RobotLimits,
    SearchGrid as SearchGrid,
    best_motion as best_motion,
)
from cobodeck.avoidable.motions import (
    CENTRES as CENTRES,
    GAP as GAP,
    ZONES as ZONES,
)
from cobodeck.avoidable.recorded_escapes import (
    EscapeProfile as EscapeProfile,
    RecordedRun as RecordedRun,
)
from cobodeck.avoidable.safety_envelope import (
    EscapePoint as EscapePoint,
    boundary as boundary,
    separation as separation,
)
from cobodeck.avoidable.shapes import (
    Array as Array,
    way_distance as way_distance,
)
