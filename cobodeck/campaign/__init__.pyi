from cobodeck.campaign.campaign_file import (
    FOLDER as FOLDER,
    CampaignFile as CampaignFile,
    campaign_names as campaign_names,
    load_campaign as load_campaign,
)
from cobodeck.campaign.cell import (
    CampaignCell as CampaignCell,
)
from cobodeck.campaign.cell_run import (
    CellResult as CellResult,
    CellRunner as CellRunner,
    run_cell as run_cell,
)
from cobodeck.campaign.execution import (
    EXECUTORS as EXECUTORS,
    execute as execute,
)
from cobodeck.campaign.product import (
    cells_of as cells_of,
    check_campaign as check_campaign,
)
from cobodeck.campaign.result_store import (
    ResultStore as ResultStore,
)
from cobodeck.campaign.summary import (
    campaigns_block as campaigns_block,
    campaigns_in_short as campaigns_in_short,
    for_programs as for_programs,
    summarised as summarised,
    summary_text as summary_text,
)
from cobodeck.campaign.worst import (
    worst_cells as worst_cells,
)
