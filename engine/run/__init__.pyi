from engine.run.chart_run import (
    ChartRun as ChartRun,
)
from engine.run.command import (
    Command as Command,
)
from engine.run.errors import (
    Raised as Raised,
    raised as raised,
    seeing_exceptions as seeing_exceptions,
    text_of as text_of,
)
from engine.run.run_queue import (
    ASKS as ASKS,
)
from engine.run.trace import (
    TraceRecord as TraceRecord,
    encode as encode,
)
