from cobodeck.bench.system.page import (
    disturbed_block as disturbed_block,
    precision_block as precision_block,
)
