from states.localization.slam.incremental_mapping import (
    points_in as points_in,
)
from states.localization.slam.placing import (
    PlacedScan as PlacedScan,
    Placing as Placing,
    Progress as Progress,
    place as place,
)
