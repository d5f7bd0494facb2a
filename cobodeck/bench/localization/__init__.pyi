from cobodeck.bench.localization.localization_bench import (
    SCENE as SCENE,
    TRUTH as TRUTH,
    by_localizer as by_localizer,
    ride as ride,
    rmse_cm as rmse_cm,
)
from cobodeck.bench.localization.localization_logs import (
    rows as rows,
)
from cobodeck.bench.localization.log_variants import (
    LEAST as LEAST,
    VARIANTS as VARIANTS,
)
