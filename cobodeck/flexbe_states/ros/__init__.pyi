from cobodeck.flexbe_states.ros.bridge import (
    Blocks as Blocks,
    Bridge as Bridge,
    current_bridge as current_bridge,
)
from cobodeck.flexbe_states.ros.flexbe_names import (
    FlexbeState as FlexbeState,
)
from cobodeck.flexbe_states.ros.plain_values import (
    PlainRecord as PlainRecord,
    frozen as frozen,
    thawed as thawed,
)
from cobodeck.flexbe_states.ros.stand_ins import (
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
