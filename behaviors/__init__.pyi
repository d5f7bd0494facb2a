from behaviors import (
    haptic as haptic,
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
