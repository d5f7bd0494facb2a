from cobodeck.logs.formats.bag import (
    is_bag as is_bag,
    read_bag as read_bag,
)
from cobodeck.logs.formats.carmen import (
    is_carmen as is_carmen,
    read_carmen as read_carmen,
)
from cobodeck.logs.formats.drive_log import (
    IMU as IMU,
    ODOMETRY as ODOMETRY,
    SCAN as SCAN,
    TRACKER as TRACKER,
    Gathered as Gathered,
    RawScan as RawScan,
    SensorLog as SensorLog,
    odometry_of as odometry_of,
)
from cobodeck.logs.formats.log_content import (
    content as content,
    head as head,
)
from cobodeck.logs.formats.run_record import (
    is_record as is_record,
    read_record as read_record,
)
from cobodeck.logs.formats.stamps import (
    Stamp as Stamp,
    straightened as straightened,
)
