from engine.check.values.arguments import (
    check_arguments as check_arguments,
)
from engine.check.values.declarations import (
    check_declarations as check_declarations,
)
from engine.check.values.named_by_node import (
    name_by_nodes as name_by_nodes,
)
