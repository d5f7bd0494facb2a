from cobodeck.bench.compare import (
    common as common,
    worse as worse,
)
from cobodeck.bench.harness import (
    own_version as own_version,
)
from cobodeck.bench.reference_table import (
    reference_block as reference_block,
    tiers_in_short as tiers_in_short,
)
from cobodeck.bench.result import (
    read_result as read_result,
)
from cobodeck.bench.table import (
    curves_block as curves_block,
    engine_block as engine_block,
    missed_block as missed_block,
    plans_block as plans_block,
    runs_block as runs_block,
)
