from cobodeck.live.sources.live_run import (
    LiveSource as LiveSource,
    serve_feed as serve_feed,
)
from cobodeck.live.sources.recorded import (
    RecordedRun as RecordedRun,
    RecordSource as RecordSource,
)
from cobodeck.live.sources.seen_run import (
    SeenRun as SeenRun,
    Texts as Texts,
)
