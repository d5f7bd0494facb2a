from cobodeck.flexbe_states.class_reading import (
    HOOKS as HOOKS,
    FlexbeClass as FlexbeClass,
    FlexbeParameter as FlexbeParameter,
    read_state_classes as read_state_classes,
)
from cobodeck.flexbe_states.docstrings import (
    Described as Described,
    ReadDocstring as ReadDocstring,
    read_docstring as read_docstring,
)
from cobodeck.flexbe_states.old_syntax import (
    python_tree as python_tree,
)
