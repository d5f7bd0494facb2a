from behaviors.person import (
    costs as costs,
    drives as drives,
    lines as lines,
    touch as touch,
    waiting as waiting,
)
from behaviors.person.costs import (
    crowding as crowding,
    efforts as efforts,
    haste as haste,
    lateness as lateness,
)
from behaviors.person.drives import (
    STEP_S as STEP_S,
    Array as Array,
    Rollouts as Rollouts,
    roll_out as roll_out,
)
from behaviors.person.lines import (
    predict_user as predict_user,
)
from behaviors.person.margin import (
    SETS_OFF_S as SETS_OFF_S,
    is_met_braking as is_met_braking,
    time_aside as time_aside,
    turns_at_it as turns_at_it,
)
from behaviors.person.touch import (
    STOPPED_S as STOPPED_S,
    RolloutEvaluation as RolloutEvaluation,
    evaluate as evaluate,
    pursued as pursued,
)
from behaviors.person.waiting import (
    risks as risks,
    way_risks as way_risks,
)
