from cobodeck.campaign.cell import (
    Cell as Cell,
)
from cobodeck.campaign.cell_run import (
    CellResult as CellResult,
    run_cell as run_cell,
)
from cobodeck.campaign.execution import (
    execute as execute,
)
