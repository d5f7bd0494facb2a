from states.navigation.local import (
    profile_planner as profile_planner,
    straight_planner as straight_planner,
    teb_planner as teb_planner,
)
from states.navigation.local.local_planner import (
    LocalPlanner as LocalPlanner,
)
from states.navigation.local.profile_planner import (
    ProfilePlanner as ProfilePlanner,
)
from states.navigation.local.speed_profile import (
    rest_to_rest as rest_to_rest,
)
from states.navigation.local.straight_planner import (
    StraightPlanner as StraightPlanner,
)
from states.navigation.local.teb_planner import (
    TebPlanner as TebPlanner,
)
