from cobodeck.record.write.excerpt import (
    write_excerpt as write_excerpt,
)
from cobodeck.record.write.record_recovery import (
    Extent as Extent,
    extent as extent,
    recover as recover,
)
from cobodeck.record.write.run_file import (
    RunFile as RunFile,
    WriteBytes as WriteBytes,
)
from cobodeck.record.write.run_recorder import (
    Recorder as Recorder,
)
from cobodeck.record.write.start import (
    recorder as recorder,
    replay_recorder as replay_recorder,
    unkept_recorder as unkept_recorder,
)
from cobodeck.record.write.viewer_layout import (
    foxglove_layout as foxglove_layout,
)
