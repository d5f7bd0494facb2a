from hw.sim.sensors import (
    coverage as coverage,
)
from hw.sim.sensors.devices import (
    ScriptedOperator as ScriptedOperator,
    SimBumper as SimBumper,
    SimTrackers as SimTrackers,
    SimVr as SimVr,
)
from hw.sim.sensors.imu import (
    SimImu as SimImu,
)
from hw.sim.sensors.lidar import (
    SimLidar as SimLidar,
)
from hw.sim.sensors.odometry import (
    SimOdometry as SimOdometry,
)
from hw.sim.sensors.person_view import (
    PersonView as PersonView,
)
from hw.sim.sensors.scanned_shapes import (
    Shapes as Shapes,
)
from hw.sim.sensors.streams import (
    Normals as Normals,
)
from hw.sim.sensors.track import (
    Track as Track,
)
from hw.sim.sensors.vive import (
    SimulatedTrackers as SimulatedTrackers,
)
