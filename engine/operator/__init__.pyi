from engine.operator import (
    commands as commands,
)
from engine.operator.commands import (
    Replace as Replace,
    output_types as output_types,
)
from engine.operator.operator import (
    Operator as Operator,
)
