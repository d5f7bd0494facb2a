from behaviors import (
    chase as chase,
    danger as danger,
    escape as escape,
    escape_candidates as escape_candidates,
    escape_poses as escape_poses,
    haptic as haptic,
    paper_escape as paper_escape,
)
from behaviors.chase import (
    best_cell as best_cell,
    out_of_the_way as out_of_the_way,
    tangent_yaw as tangent_yaw,
)
from behaviors.haptic import (
    all_poses as all_poses,
    best_pose as best_pose,
    poses as poses,
    reachable as reachable,
    round_poses as round_poses,
)
from behaviors.signal_table import (
    ESTIMATE as ESTIMATE,
    MEASURED as MEASURED,
    planning as planning,
    signals as signals,
)
