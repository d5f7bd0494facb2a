from hw.sim.contact.collisions import (
    Collisions as Collisions,
)
from hw.sim.contact.contact import (
    Sweep as Sweep,
    gap as gap,
    rectangle_segment_distance as rectangle_segment_distance,
    swept_gap as swept_gap,
)
from hw.sim.contact.moving import (
    MovingArm as MovingArm,
    MovingBase as MovingBase,
)
from hw.sim.contact.nearby import (
    BESIDE_M as BESIDE_M,
    nearest as nearest,
)
