from cobodeck.pictures.run.record_picture import (
    CourseReader as CourseReader,
    course_of as course_of,
    draw_run as draw_run,
)
from cobodeck.pictures.run.run_course import (
    Course as Course,
    NodeSpan as NodeSpan,
    lanes_of as lanes_of,
)
from cobodeck.pictures.run.tracks import (
    thinned as thinned,
)
from cobodeck.pictures.run.watch import (
    Visits as Visits,
    used_charts as used_charts,
)
