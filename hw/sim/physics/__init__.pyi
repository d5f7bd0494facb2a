from hw.sim.physics.mechanics import (
    Mechanics as Mechanics,
)
from hw.sim.physics.physical_arm import (
    PhysicalArm as PhysicalArm,
)
from hw.sim.physics.physical_base import (
    PhysicalBase as PhysicalBase,
    physical_robot as physical_robot,
)
from hw.sim.physics.robot_body import (
    RobotBody as RobotBody,
)
