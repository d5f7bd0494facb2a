from cobodeck.campaign.cell import (
    CampaignCell as CampaignCell,
)
from cobodeck.campaign.cell_run import (
    CellResult as CellResult,
    run_cell as run_cell,
)
from cobodeck.campaign.execution import (
    execute as execute,
)
