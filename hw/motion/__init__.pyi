from hw.motion.pose_history import (
    PoseHistory as PoseHistory,
    along_arc as along_arc,
    wrapped as wrapped,
)
from hw.motion.reckoner import (
    Reckoner as Reckoner,
)
from hw.motion.velocity_estimator import (
    Motion as Motion,
)
