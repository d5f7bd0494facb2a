from cobodeck.bench.system.page import (
    disturbed_block as disturbed_block,
    keys_block as keys_block,
    precision_block as precision_block,
)
