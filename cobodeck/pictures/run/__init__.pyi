from cobodeck.pictures.run.record_picture import (
    course_of as course_of,
    draw_run as draw_run,
)
from cobodeck.pictures.run.run_course import (
    Course as Course,
)
from cobodeck.pictures.run.tracks import (
    thinned as thinned,
)
