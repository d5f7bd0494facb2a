from behaviors.situation import (
    chase_space as chase_space,
)
from behaviors.situation.chase_cells import (
    Array as Array,
    grid as grid,
)
from behaviors.situation.chase_space import (
    ChaseCell as ChaseCell,
    ChaseSpace as ChaseSpace,
    space as space,
)
from behaviors.situation.keys import (
    CHASE_SPACE as CHASE_SPACE,
    ESCAPE_CANDIDATES as ESCAPE_CANDIDATES,
    ESCAPE_POSES as ESCAPE_POSES,
    ESCAPE_REQUIRED as ESCAPE_REQUIRED,
    ESCAPE_SAFE as ESCAPE_SAFE,
    HAPTIC_POSES as HAPTIC_POSES,
    SETTINGS as SETTINGS,
    settings_of as settings_of,
)
from behaviors.situation.present_situation import (
    CHANGES as CHANGES,
    READS as READS,
    TURN_ROOM as TURN_ROOM,
    WAYS as WAYS,
    Situation as Situation,
    situation as situation,
)
