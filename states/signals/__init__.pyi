from states.signals.prediction import (
    PREDICTORS as PREDICTORS,
    chord as chord,
    time_to_contact as time_to_contact,
)
from states.signals.user_motion import (
    StampedPlace as StampedPlace,
    StillnessEstimator as StillnessEstimator,
    VelocityEstimator as VelocityEstimator,
)
