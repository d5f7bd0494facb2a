from hw.motion.reckoner import (
    Reckoner as Reckoner,
)
from hw.motion.velocity_estimator import (
    Motion as Motion,
)
