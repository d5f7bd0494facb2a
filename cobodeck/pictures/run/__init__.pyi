from cobodeck.pictures.run.record_picture import (
    draw_run as draw_run,
)
