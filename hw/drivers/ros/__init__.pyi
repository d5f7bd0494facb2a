from hw.drivers.ros.rosbridge import (
    CONNECTING_S as CONNECTING_S,
    FIRST_S as FIRST_S,
    RosbridgeClient as RosbridgeClient,
    Version as Version,
    kind_of as kind_of,
    reachable as reachable,
    stamp_of as stamp_of,
    topic_of as topic_of,
    yaw_of as yaw_of,
)
