from cobodeck.bench.harness import (
    WORSE as WORSE,
    machine as machine,
)
from cobodeck.bench.result import (
    read_result as read_result,
)
