from engine.operator import (
    commands as commands,
)
from engine.operator.commands import (
    Replace as Replace,
)
from engine.operator.operator import (
    Operator as Operator,
)
