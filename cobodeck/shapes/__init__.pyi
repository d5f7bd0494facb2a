from cobodeck.shapes.actors import (
    arm_shapes as arm_shapes,
    body_shapes as body_shapes,
    deep_shapes as deep_shapes,
    outline_shapes as outline_shapes,
)
from cobodeck.shapes.layers import (
    Backdrop as Backdrop,
    room_shapes as room_shapes,
    shapes_of as shapes_of,
)
from cobodeck.shapes.moment import (
    Moment as Moment,
    MomentTrail as MomentTrail,
    next_deep as next_deep,
    situation_at as situation_at,
    with_drive as with_drive,
)
from cobodeck.shapes.room_parts import (
    object_shapes as object_shapes,
    place_shapes as place_shapes,
    tracked_shapes as tracked_shapes,
    wall_shapes as wall_shapes,
)
from cobodeck.shapes.shape import (
    LAYERS as LAYERS,
    MapShape as MapShape,
    areas as areas,
    box as box,
    wire as wire,
)
