from hw.safety.chain import (
    LocalChain as LocalChain,
    is_standing as is_standing,
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
    STANDSTILL as STANDSTILL,
    PlanarState as PlanarState,
    Ramps as Ramps,
    Velocity as Velocity,
    twist_after as twist_after,
)
from hw.safety.rule import (
    KEPT as KEPT,
)
from hw.safety.separation import (
    QUICK as QUICK,
    STEADY as STEADY,
    Nearness as Nearness,
    nearness as nearness,
)
from hw.safety.stop_line import (
    StopLatch as StopLatch,
)
