from behaviors.prediction import (
    costs as costs,
    rollout as rollout,
    waiting as waiting,
)
from behaviors.prediction.aside import (
    SETS_OFF_S as SETS_OFF_S,
    is_met_braking as is_met_braking,
    time_aside as time_aside,
    turns_at_it as turns_at_it,
)
from behaviors.prediction.costs import (
    crowding as crowding,
    efforts as efforts,
    haste as haste,
    lateness as lateness,
)
from behaviors.prediction.rollout import (
    STEP_S as STEP_S,
    STOPPED_S as STOPPED_S,
    Array as Array,
    RolloutEvaluation as RolloutEvaluation,
    Rollouts as Rollouts,
    evaluate as evaluate,
    predict_user as predict_user,
    pursued as pursued,
    roll_out as roll_out,
)
from behaviors.prediction.waiting import (
    risks as risks,
    way_risks as way_risks,
)
