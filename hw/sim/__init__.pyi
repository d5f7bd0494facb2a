from hw.sim.contact.moving import (
    MovingBase as MovingBase,
)
from hw.sim.external_world import (
    DRIVES as DRIVES,
    EVALUATOR as EVALUATOR,
    SCANNERS as SCANNERS,
    STEP_NS as STEP_NS,
    VR as VR,
    HostedWorld as HostedWorld,
    PeerMessage as PeerMessage,
)
from hw.sim.mock import (
    mock_world as mock_world,
)
from hw.sim.sim_base import (
    SimBase as SimBase,
)
from hw.sim.slip import (
    SlipperyFloor as SlipperyFloor,
)
from hw.sim.staging import (
    check_scene as check_scene,
)
from hw.sim.world import (
    World as World,
)
