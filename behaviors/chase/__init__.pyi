from behaviors.chase import (
    chase_states as chase_states,
)
from behaviors.chase.chase_states import (
    tangent_yaw as tangent_yaw,
)
from behaviors.chase.refuge import (
    is_outside as is_outside,
    way_out as way_out,
)
from behaviors.chase.waiting_place import (
    cells_with_risk as cells_with_risk,
    chase_cell as chase_cell,
    chase_place as chase_place,
    free_cells as free_cells,
)
