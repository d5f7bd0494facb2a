from cobodeck.pictures.drawing.canvas import (
    Sheet as Sheet,
    form_of as form_of,
    save as save,
    save_figure as save_figure,
    sheet as sheet,
)
from cobodeck.pictures.drawing.drawn_shapes import (
    draw as draw,
    ring_of as ring_of,
)
from cobodeck.pictures.drawing.labels import (
    Labels as Labels,
)
from cobodeck.pictures.drawing.looks import (
    FOAM as FOAM,
    INFLATIONS as INFLATIONS,
    PERSON as PERSON,
    ROBOT_TRAIL as ROBOT_TRAIL,
    USER as USER,
)
from cobodeck.pictures.drawing.moment import (
    after as after,
    at_start as at_start,
    with_next_drive as with_next_drive,
)
