from hw.motion.pose_history import (
    PoseHistory as PoseHistory,
    along_arc as along_arc,
    wrapped as wrapped,
)
from hw.motion.reckoner import (
    RECKONING as RECKONING,
    Reckoner as Reckoner,
    reckoned as reckoned,
)
from hw.motion.velocity_estimator import (
    EVER_NS as EVER_NS,
    STANDS as STANDS,
    TRAIL as TRAIL,
    UNKNOWN as UNKNOWN,
    Motion as Motion,
    add_pose as add_pose,
    lay_out as lay_out,
    velocity as velocity,
)
