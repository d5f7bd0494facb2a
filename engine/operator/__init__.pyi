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
from engine.operator.place import (
    ChartPlace as ChartPlace,
    place_of as place_of,
    set_place as set_place,
)
