from cobodeck.loop.clocks import (
    Clock as Clock,
    Paced as Paced,
    RealTime as RealTime,
    Virtual as Virtual,
)
from cobodeck.loop.loop import (
    LATE_NS as LATE_NS,
    Loop as Loop,
)
from cobodeck.loop.operators import (
    ConsoleOperator as ConsoleOperator,
)
from cobodeck.loop.plant import (
    Inert as Inert,
    Nothing as Nothing,
    Plant as Plant,
)
from cobodeck.loop.sample_router import (
    Inlet as Inlet,
)
from cobodeck.loop.stopwatch import (
    PHASES as PHASES,
    Stopwatch as Stopwatch,
)
from cobodeck.loop.ticked import (
    Kind as Kind,
    Observer as Observer,
    Ticked as Ticked,
)
from cobodeck.loop.tier0 import (
    wander as wander,
)
from cobodeck.loop.watchdog import (
    ending_on_signals as ending_on_signals,
    naming_what_blocks as naming_what_blocks,
)
from cobodeck.loop.wiring import (
    ValueTap as ValueTap,
    Wired as Wired,
    freezers as freezers,
    wire as wire,
)
