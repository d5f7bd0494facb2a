from hw.safety.chain import (
    LocalChain as LocalChain,
)
from hw.safety.checks import (
    RULE as RULE,
    cycle as cycle,
)
from hw.safety.cycle_log import (
    CYCLE as CYCLE,
    CycleLog as CycleLog,
    CycleReader as CycleReader,
    bits_of as bits_of,
)
from hw.safety.cycle_record import (
    GRANTED as GRANTED,
    ChainStatus as ChainStatus,
    SafetyRecord as SafetyRecord,
)
from hw.safety.guarded import (
    CYCLE_NS as CYCLE_NS,
    HEARD as HEARD,
    GuardedBase as GuardedBase,
)
from hw.safety.limits import (
    SafetyLimits as SafetyLimits,
)
from hw.safety.ramps import (
    RAMPS as RAMPS,
    STANDSTILL as STANDSTILL,
    PlanarState as PlanarState,
    Ramps as Ramps,
    limited as limited,
    require_rolling as require_rolling,
    toward as toward,
    twist_after as twist_after,
    velocity_after as velocity_after,
)
from hw.safety.rule import (
    is_standing as is_standing,
)
from hw.safety.separation import (
    Nearness as Nearness,
    PlanarPose as PlanarPose,
    Velocity as Velocity,
    allowed_speed as allowed_speed,
    nearness as nearness,
)
from hw.safety.stop_line import (
    StopLatch as StopLatch,
)
from hw.safety.user_track import (
    QUICK as QUICK,
    STEADY as STEADY,
)
