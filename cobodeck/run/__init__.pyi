from cobodeck.run import (
    trace_file as trace_file,
)
from cobodeck.run.build_run import (
    stage as stage,
)
from cobodeck.run.decisions import (
    Decision as Decision,
    DecisionReader as DecisionReader,
    decisions_of as decisions_of,
)
from cobodeck.run.explanation import (
    explain as explain,
)
from cobodeck.run.run_summary import (
    summary as summary,
)
from cobodeck.run.shadow import (
    Shadow as Shadow,
    shadow_rows as shadow_rows,
)
from cobodeck.run.simulation import (
    RunResult as RunResult,
    Spent as Spent,
    figures_of as figures_of,
    one_in_the_other as one_in_the_other,
    simulate as simulate,
)
from cobodeck.run.stand_in import (
    Answers as Answers,
    Raises as Raises,
    StandIn as StandIn,
)
from cobodeck.run.topics import (
    topics_of as topics_of,
)
