from cobodeck.logs.log_calibration import (
    calibrated as calibrated,
    tracking_file as tracking_file,
)
from cobodeck.logs.log_files import (
    open_log as open_log,
)
from cobodeck.logs.log_localization import (
    NEAR as NEAR,
    Localized as Localized,
    LocalizedScan as LocalizedScan,
    LogClock as LogClock,
    figures as figures,
    first_pose as first_pose,
    localize as localize,
)
from cobodeck.logs.mapped import (
    Ground as Ground,
    built_ground as built_ground,
    given_ground as given_ground,
    reference_of as reference_of,
    room_ground as room_ground,
)
from cobodeck.logs.reckoned import (
    reckon as reckon,
    reckoning_figures as reckoning_figures,
)
from cobodeck.logs.seen import (
    SeenScan as SeenScan,
    scans_of as scans_of,
)
