from states.maps.cells import (
    Grid as Grid,
    Mask as Mask,
    fill_rings as fill_rings,
    grid_over as grid_over,
    is_inside_rings as is_inside_rings,
    room_map as room_map,
)
from states.maps.distance import (
    Array as Array,
    distances as distances,
)
from states.maps.field import (
    Field as Field,
    Table as Table,
    distance_at as distance_at,
    is_floor as is_floor,
    map_field as map_field,
    room_field as room_field,
)
from states.maps.mapping import (
    FARTHEST as FARTHEST,
    RESOLUTION as RESOLUTION,
    Corner as Corner,
    Mapper as Mapper,
    covering as covering,
)
from states.maps.occupancy import (
    FREE as FREE,
    OCCUPIED as OCCUPIED,
    UNKNOWN as UNKNOWN,
    MapFile as MapFile,
    OccupancyMap as OccupancyMap,
    load_map as load_map,
    save_map as save_map,
)
from states.maps.rooms import (
    load_floor as load_floor,
    room_of as room_of,
    start_in as start_in,
)
