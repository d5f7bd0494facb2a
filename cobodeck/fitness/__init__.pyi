from cobodeck.fitness.arm_reach import (
    arm_checks as arm_checks,
)
from cobodeck.fitness.checker import (
    FileChecker as FileChecker,
)
from cobodeck.fitness.floor_space import (
    FloorReport as FloorReport,
    floor_report as floor_report,
)
from cobodeck.fitness.room_fitness import (
    BAD as BAD,
    FIT as FIT,
    MISSING as MISSING,
    DoctorLine as DoctorLine,
    room_checks as room_checks,
    tracking_checks as tracking_checks,
)
