from states.navigation.beside_user import (
    comes_in as comes_in,
    is_there as is_there,
    place_near as place_near,
    user_disc as user_disc,
    way_in as way_in,
)
from states.navigation.drive import (
    DRIVES as DRIVES,
    PLANNERS as PLANNERS,
    BaseDrive as BaseDrive,
    planner_of as planner_of,
)
from states.navigation.planner_interfaces import (
    Driver as Driver,
    GlobalPlanner as GlobalPlanner,
    Limits as Limits,
    Tolerance as Tolerance,
)
from states.navigation.planners import (
    GLOBAL_PLANNERS as GLOBAL_PLANNERS,
    LOCAL_PLANNERS as LOCAL_PLANNERS,
    driver_of as driver_of,
    straight_driver_of as straight_driver_of,
)
