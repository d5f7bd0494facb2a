from engine.signals.board import (
    Board as Board,
    Usage as Usage,
)
from engine.signals.event_log import (
    EventReader as EventReader,
)
from engine.signals.signal_kinds import (
    Derived as Derived,
    Estimated as Estimated,
    Measured as Measured,
    Signal as Signal,
    closure as closure,
    declare as declare,
    roots as roots,
    types_of as types_of,
)
from engine.signals.slots import (
    EstimatedSlot as EstimatedSlot,
    MeasuredSlot as MeasuredSlot,
    compute as compute,
)
