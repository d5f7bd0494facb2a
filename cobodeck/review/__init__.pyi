from cobodeck.review.case_file import (
    write_case as write_case,
)
from cobodeck.review.chart_coverage import (
    edge_counts as edge_counts,
)
from cobodeck.review.run_events import (
    RunEvents as RunEvents,
    events_of as events_of,
)
from cobodeck.review.state_statistics import (
    review as review,
)
from cobodeck.review.statistics_table import (
    statistics_text as statistics_text,
)
