from behaviors.escape import (
    danger as danger,
    escape_candidates as escape_candidates,
    escape_poses as escape_poses,
    escape_states as escape_states,
    paper_escape as paper_escape,
)
from behaviors.escape.escape_candidates import (
    EscapeCandidates as EscapeCandidates,
    seen_candidates as seen_candidates,
)
from behaviors.escape.escape_poses import (
    free_poses as free_poses,
    poses as poses,
)
from behaviors.escape.escape_states import (
    DriveToBest as DriveToBest,
    can_get_away as can_get_away,
)
from behaviors.escape.pursuit import (
    is_caught as is_caught,
)
from behaviors.escape.zones import (
    in_zone as in_zone,
)
