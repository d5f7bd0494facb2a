from states.localization.wheels.drift import (
    Drift as Drift,
    TrackerComparison as TrackerComparison,
)
from states.localization.wheels.steps import (
    Planar as Planar,
    composed as composed,
    place_of as place_of,
)
from states.localization.wheels.tracker_feed import (
    TrackerFeed as TrackerFeed,
)
from states.localization.wheels.trail import (
    Trail as Trail,
)
from states.localization.wheels.wheel_motion import (
    MISSING_NS as MISSING_NS,
    STOOD as STOOD,
    WheelMotion as WheelMotion,
)
