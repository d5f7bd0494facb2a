from engine.draw.dot_text import (
    dot as dot,
)
from engine.draw.layout import (
    FILE_FORMS as FILE_FORMS,
    CannotRender as CannotRender,
    render as render,
)
from engine.draw.mermaid_text import (
    mermaid as mermaid,
)
from engine.draw.picture import (
    MOST_NODES as MOST_NODES,
    nodes_shown as nodes_shown,
)
from engine.draw.style import (
    GREY as GREY,
    INK as INK,
    RED as RED,
)
from engine.draw.wording import (
    resolved_value as resolved_value,
    value_text as value_text,
    values_of as values_of,
)
