from states.navigation.drive import (
    DRIVES as DRIVES,
    PLANNERS as PLANNERS,
    command_of as command_of,
    is_there as is_there,
    place_near as place_near,
    planner_of as planner_of,
    user_disc as user_disc,
    wide_disc as wide_disc,
)
from states.navigation.planner_interfaces import (
    GlobalPlanner as GlobalPlanner,
    Limits as Limits,
    Tolerance as Tolerance,
)
from states.navigation.planners import (
    GLOBAL_PLANNERS as GLOBAL_PLANNERS,
    LOCAL_PLANNERS as LOCAL_PLANNERS,
    driver_of as driver_of,
)
