from states.navigation.grid import (
    grid_planners as grid_planners,
    obstacles as obstacles,
    scanning as scanning,
)
from states.navigation.grid.costmap import (
    Costmap as Costmap,
    StaticLayer as StaticLayer,
)
from states.navigation.grid.grid_planners import (
    GridPlanner as GridPlanner,
    NavfnPlanner as NavfnPlanner,
    ThetaStarPlanner as ThetaStarPlanner,
)
from states.navigation.grid.inflation import (
    LETHAL as LETHAL,
    NO_INFORMATION as NO_INFORMATION,
    Costs as Costs,
    Inflation as Inflation,
)
from states.navigation.grid.layers import (
    Costmaps as Costmaps,
    costmaps_of as costmaps_of,
    exact_among as exact_among,
    ground_of as ground_of,
    map_of as map_of,
)
from states.navigation.grid.obstacles import (
    ObstacleValues as ObstacleValues,
)
from states.navigation.grid.scanned_obstacles import (
    Obstacles as Obstacles,
)
from states.navigation.grid.scanning import (
    ObstacleEstimator as ObstacleEstimator,
    Scanner as Scanner,
)
