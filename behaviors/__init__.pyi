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
    tangent_yaw as tangent_yaw,
)
from behaviors.haptic import (
    all_poses as all_poses,
    first_pose as first_pose,
    poses as poses,
    reachable as reachable,
    round_poses as round_poses,
    soonest_pose as soonest_pose,
)
from behaviors.signal_table import (
    ESTIMATE as ESTIMATE,
    MEASURED as MEASURED,
    planning as planning,
    signals as signals,
)
from behaviors.waiting_place import (
    cells_with_risk as cells_with_risk,
    chase_cell as chase_cell,
    chase_place as chase_place,
    free_cells as free_cells,
)
