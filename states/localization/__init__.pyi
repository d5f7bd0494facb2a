from states.localization.estimates import (
    SENSED as SENSED,
    LocalizationEstimator as LocalizationEstimator,
    Localizes as Localizes,
    PoseEstimate as PoseEstimate,
    PoseOf as PoseOf,
    SigmaOf as SigmaOf,
)
from states.localization.localizer import (
    Localizer as Localizer,
)
from states.localization.particle_localizer import (
    ParticleLocalizer as ParticleLocalizer,
)
