from cobodeck.pictures.drawing.actors import (
    FOAM as FOAM,
    ROBOT_TRAIL as ROBOT_TRAIL,
    USER as USER,
    draw_robot as draw_robot,
    draw_trail as draw_trail,
    draw_user as draw_user,
    draw_zones as draw_zones,
)
from cobodeck.pictures.drawing.arm_outline import (
    draw_arm as draw_arm,
)
from cobodeck.pictures.drawing.canvas import (
    Sheet as Sheet,
    form_of as form_of,
    save as save,
    save_figure as save_figure,
    sheet as sheet,
)
from cobodeck.pictures.drawing.labels import (
    Labels as Labels,
)
from cobodeck.pictures.drawing.moment import (
    Moment as Moment,
    after as after,
    at_start as at_start,
    situation_at as situation_at,
    with_next_drive as with_next_drive,
)
from cobodeck.pictures.drawing.room_drawing import (
    INFLATIONS as INFLATIONS,
    add_area as add_area,
    draw_inflations as draw_inflations,
    draw_items as draw_items,
    draw_objects as draw_objects,
    draw_places as draw_places,
    draw_room as draw_room,
    draw_tracked_area as draw_tracked_area,
    ring_of as ring_of,
)
