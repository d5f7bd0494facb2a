from cobodeck.bench.localization.localization_logs import (
    rows as rows,
)
from cobodeck.bench.localization.log_variants import (
    LEAST as LEAST,
    VARIANTS as VARIANTS,
)
