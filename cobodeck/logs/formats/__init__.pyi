from cobodeck.logs.formats.bag import (
    is_bag as is_bag,
    read_bag as read_bag,
)
from cobodeck.logs.formats.carmen import (
    is_carmen as is_carmen,
    read_carmen as read_carmen,
)
from cobodeck.logs.formats.content import (
    head as head,
)
from cobodeck.logs.formats.drive_log import (
    IMU as IMU,
    ODOMETRY as ODOMETRY,
    SCAN as SCAN,
    TRACKER as TRACKER,
    SensorLog as SensorLog,
    odometry_of as odometry_of,
)
from cobodeck.logs.formats.rawlog import (
    is_rawlog as is_rawlog,
    read_rawlog as read_rawlog,
)
from cobodeck.logs.formats.run_record import (
    is_record as is_record,
    read_record as read_record,
)
