from cobodeck.fitness.check import (
    BAD as BAD,
    FIT as FIT,
    MISSING as MISSING,
    NOTE as NOTE,
    CheckResult as CheckResult,
)
from cobodeck.fitness.check_list import (
    ask as ask,
    require as require,
)
