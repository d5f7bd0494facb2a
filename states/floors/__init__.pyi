from states.floors.floor_cells import (
    MapFloor as MapFloor,
)
from states.floors.floor_plan import (
    RoomFloor as RoomFloor,
)
from states.floors.usable_space import (
    Floor as Floor,
    Passage as Passage,
    Space as Space,
    Untouchable as Untouchable,
    measure as measure,
    room_ahead as room_ahead,
    shortcoming as shortcoming,
    smallest_square as smallest_square,
    without_haptic_pose as without_haptic_pose,
)
