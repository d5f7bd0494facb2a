from cobodeck.live.sources.live_run import (
    LiveSource as LiveSource,
)
from cobodeck.live.sources.recorded import (
    RecordSource as RecordSource,
)
from cobodeck.live.sources.seen_run import (
    SeenRun as SeenRun,
)
