from states.navigation.exact import (
    visibility as visibility,
)
from states.navigation.exact.clearance import (
    TOLERANCE as TOLERANCE,
    TURN as TURN,
    Array as Array,
    Circle as Circle,
    Triple as Triple,
    check_radius as check_radius,
    distance_to_nearest as distance_to_nearest,
    distance_to_segment as distance_to_segment,
    distance_to_side as distance_to_side,
    lines_cross as lines_cross,
    passes_disc as passes_disc,
    turn_between as turn_between,
)
from states.navigation.exact.path import (
    Path as Path,
)
from states.navigation.exact.tangents import (
    UserDisc as UserDisc,
    line_crosses_ray as line_crosses_ray,
    separating_ray as separating_ray,
    sweep_between as sweep_between,
    tangent as tangent,
)
from states.navigation.exact.visibility import (
    NOBODY as NOBODY,
    ExactPlanner as ExactPlanner,
    as_disc as as_disc,
    as_floats as as_floats,
)
