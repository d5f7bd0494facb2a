from states.arm.planning.approach import (
    TOUCH_SPEED as TOUCH_SPEED,
    ToolLine as ToolLine,
    WayIn as WayIn,
    around as around,
    moved_along as moved_along,
    rungs as rungs,
    tool_lines as tool_lines,
)
from states.arm.planning.parking import (
    CLEARANCE as CLEARANCE,
    ParkedPose as ParkedPose,
    ParkingSearch as ParkingSearch,
)
from states.arm.planning.planning import (
    NoPlan as NoPlan,
    Plan as Plan,
    Planner as Planner,
    Query as Query,
    ended as ended,
    goals_at as goals_at,
    in_turn as in_turn,
    lines_first as lines_first,
    plan as plan,
    planner as planner,
)
from states.arm.planning.reach import (
    ANGLES as ANGLES,
    Reach as Reach,
    ReachPlace as ReachPlace,
    ReachTable as ReachTable,
    disc as disc,
    rover_from_deep as rover_from_deep,
)
