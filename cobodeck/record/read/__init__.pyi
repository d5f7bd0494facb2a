from cobodeck.record.read.header_differences import (
    HeaderDifference as HeaderDifference,
)
from cobodeck.record.read.reader import (
    CASE as CASE,
    Group as Group,
    Record as Record,
    RecordedMessage as RecordedMessage,
    closed as closed,
)
from cobodeck.record.read.record_comparison import (
    Comparison as Comparison,
    Figure as Figure,
    FigureTolerance as FigureTolerance,
    compare as compare,
)
from cobodeck.record.read.record_replay import (
    Replay as Replay,
    RunTexts as RunTexts,
    command_of as command_of,
    replaced as replaced,
    setup_of as setup_of,
    stage_replay as stage_replay,
    texts_of as texts_of,
    written_setup as written_setup,
)
from cobodeck.record.read.replayed_person import (
    recalled as recalled,
)
from cobodeck.record.read.replayed_plant import (
    RECORD as RECORD,
    Recorded as Recorded,
    RecordedClock as RecordedClock,
)
from cobodeck.record.read.sample_feed import (
    RecordFeed as RecordFeed,
    ReplayMismatch as ReplayMismatch,
)
