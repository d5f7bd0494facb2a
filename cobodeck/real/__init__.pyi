from cobodeck.real.connected import (
    Connected as Connected,
    connect as connect,
)
from cobodeck.real.dummy_connection import (
    with_dummy as with_dummy,
)
from cobodeck.real.open_connection import (
    finds_itself as finds_itself,
    in_this_run as in_this_run,
    is_needed as is_needed,
)
from cobodeck.real.prior_run_search import (
    prior_runs as prior_runs,
)
from cobodeck.real.release_stages import (
    WORDS as WORDS,
    PriorRuns as PriorRuns,
)
