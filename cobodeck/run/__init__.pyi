from cobodeck.run import (
    trace_file as trace_file,
)
from cobodeck.run.build_run import (
    stage as stage,
)
from cobodeck.run.explanation import (
    explain as explain,
)
from cobodeck.run.run_summary import (
    summary as summary,
)
from cobodeck.run.simulation import (
    RunResult as RunResult,
    Spent as Spent,
    figures_of as figures_of,
    simulate as simulate,
)
from cobodeck.run.topics import (
    topics_of as topics_of,
)
