from hw.drivers.unity.protocol.ros_messages import (
    BUILDS as BUILDS,
    SECOND as SECOND,
    Messages as Messages,
    frame_of as frame_of,
    is_upright as is_upright,
    pose_of as pose_of,
    stamp_of as stamp_of,
    time_of as time_of,
)
from hw.drivers.unity.protocol.services import (
    Services as Services,
)
from hw.drivers.unity.protocol.session import (
    Session as Session,
)
from hw.drivers.unity.protocol.topics import (
    TRACKER as TRACKER,
    Topics as Topics,
    UnityTopic as UnityTopic,
    plain_name as plain_name,
    plain_type as plain_type,
)
from hw.drivers.unity.protocol.wire import (
    KEEPALIVE as KEEPALIVE,
    MalformedFrame as MalformedFrame,
    UnityFrame as UnityFrame,
    frame as frame,
    handshake as handshake,
    legible as legible,
    text_in as text_in,
    too_long as too_long,
)
