from hw.sim.hand.loose_items import (
    LooseItems as LooseItems,
)
from hw.sim.hand.tool import (
    Hand as Hand,
    SimGripper as SimGripper,
    SimWrench as SimWrench,
)
