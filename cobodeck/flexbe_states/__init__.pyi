from cobodeck.flexbe_states.chart_names import (
    identifier as identifier,
    key_name as key_name,
    outcome_name as outcome_name,
)
from cobodeck.flexbe_states.class_reading import (
    HOOKS as HOOKS,
    FlexbeClass as FlexbeClass,
    FlexbeParameter as FlexbeParameter,
    read_state_classes as read_state_classes,
)
from cobodeck.flexbe_states.docstrings import (
    Described as Described,
)
from cobodeck.flexbe_states.importing import (
    flexbe_modules as flexbe_modules,
)
from cobodeck.flexbe_states.old_syntax import (
    python_tree as python_tree,
)
from cobodeck.flexbe_states.ros.plain_values import (
    PlainRecord as PlainRecord,
)
from cobodeck.flexbe_states.ros.topic_table import (
    TopicFile as TopicFile,
    TopicTable as TopicTable,
    load_topics as load_topics,
    names_in_table as names_in_table,
)
from cobodeck.flexbe_states.ros.wire import (
    wired_topics as wired_topics,
)
from cobodeck.flexbe_states.state_modules import (
    broken_module as broken_module,
    leave_out as leave_out,
    state_module as state_module,
)
