from cobodeck.flexbe_states.ros.bridge import (
    Blocks as Blocks,
    Bridge as Bridge,
    current_bridge as current_bridge,
)
from cobodeck.flexbe_states.ros.flexbe_names import (
    FlexbeState as FlexbeState,
)
from cobodeck.flexbe_states.ros.messages import (
    RosMessage as RosMessage,
    message_class as message_class,
)
from cobodeck.flexbe_states.ros.plain_values import (
    PlainRecord as PlainRecord,
    as_command as as_command,
    as_message as as_message,
    frozen as frozen,
    thawed as thawed,
)
from cobodeck.flexbe_states.ros.ros_time import (
    RosDuration as RosDuration,
    RosTime as RosTime,
)
from cobodeck.flexbe_states.ros.stand_ins import (
    NotProvided as NotProvided,
    has_stand_in as has_stand_in,
    stand_in as stand_in,
)
from cobodeck.flexbe_states.ros.topic_table import (
    TopicFile as TopicFile,
    TopicTable as TopicTable,
    load_topics as load_topics,
    names_in_table as names_in_table,
    topics_from as topics_from,
)
