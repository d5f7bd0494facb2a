from states.arm.motion.joint_path import (
    JointPath as JointPath,
    first_contact as first_contact,
    rounded as rounded,
)
from states.arm.motion.timing import (
    LINE_SAMPLES as LINE_SAMPLES,
    line_durations as line_durations,
    time_path as time_path,
)
from states.arm.motion.timing_kernels import (
    line_times as line_times,
)
from states.arm.motion.trajectory import (
    SlowZone as SlowZone,
    Trajectory as Trajectory,
)
