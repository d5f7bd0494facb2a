from behaviors.situation.chase_cells import (
    Array as Array,
    placed as placed,
    timed_cells as timed_cells,
    weighted_cells as weighted_cells,
)
from behaviors.situation.chase_ring import (
    ChaseRing as ChaseRing,
)
from behaviors.situation.keys import (
    ESCAPE_POSES as ESCAPE_POSES,
    ESCAPE_REQUIRED as ESCAPE_REQUIRED,
    ESCAPE_SAFE as ESCAPE_SAFE,
    SETTINGS as SETTINGS,
    settings_of as settings_of,
)
from behaviors.situation.present_situation import (
    CHANGES as CHANGES,
    READS as READS,
    WAYS as WAYS,
    Situation as Situation,
    situation as situation,
)
