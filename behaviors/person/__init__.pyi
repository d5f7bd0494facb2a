from behaviors.person import (
    band as band,
    drives as drives,
    lines as lines,
    margin as margin,
    touch as touch,
    waiting as waiting,
)
from behaviors.person.band import (
    cornered as cornered,
    haste as haste,
    off_the_band as off_the_band,
)
from behaviors.person.drives import (
    STEP_S as STEP_S,
    Array as Array,
    Rollouts as Rollouts,
    closing_time as closing_time,
    roll_out as roll_out,
)
from behaviors.person.lines import (
    lines_of_walk as lines_of_walk,
    predict_user as predict_user,
    setting_off as setting_off,
)
from behaviors.person.margin import (
    Clearing as Clearing,
    lacking as lacking,
    time_left as time_left,
    turns_at_it as turns_at_it,
    watched_from as watched_from,
)
from behaviors.person.touch import (
    RolloutEvaluation as RolloutEvaluation,
    evaluate as evaluate,
    pursued as pursued,
)
from behaviors.person.waiting import (
    risks as risks,
    way_risks as way_risks,
)
