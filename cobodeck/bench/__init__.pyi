from cobodeck.bench.compare import (
    common as common,
    worse as worse,
)
from cobodeck.bench.harness import (
    machine as machine,
    own_version as own_version,
    versions as versions,
)
from cobodeck.bench.result import (
    read_result as read_result,
)
