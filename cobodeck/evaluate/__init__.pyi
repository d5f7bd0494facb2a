from cobodeck.evaluate.arm_contact import (
    ArmOutline as ArmOutline,
    ArmWatch as ArmWatch,
)
from cobodeck.evaluate.evaluators import (
    arm_outline as arm_outline,
    prop_of as prop_of,
    run_figures as run_figures,
    watchers as watchers,
)
from cobodeck.evaluate.figures import (
    NOTHING as NOTHING,
    OF_THE_MACHINE as OF_THE_MACHINE,
    escape_figures as escape_figures,
    shown_figures as shown_figures,
    spread as spread,
)
from cobodeck.evaluate.localization import (
    LocalizationWatch as LocalizationWatch,
)
from cobodeck.evaluate.measured_truth import (
    Senses as Senses,
)
from cobodeck.evaluate.metrics import (
    FAR_M as FAR_M,
    NEAR_M as NEAR_M,
    NOBODY as NOBODY,
    Evaluator as Evaluator,
)
from cobodeck.evaluate.refused_requests import (
    refusal_figures as refusal_figures,
)
from cobodeck.evaluate.requests import (
    RequestWatch as RequestWatch,
)
from cobodeck.evaluate.separation_figures import (
    SeparationWatch as SeparationWatch,
)
from cobodeck.evaluate.stuck import (
    StuckWatch as StuckWatch,
)
