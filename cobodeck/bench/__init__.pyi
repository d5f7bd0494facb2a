from cobodeck.bench.compare import (
    worse as worse,
)
from cobodeck.bench.harness import (
    own_version as own_version,
)
from cobodeck.bench.result import (
    read_result as read_result,
)
