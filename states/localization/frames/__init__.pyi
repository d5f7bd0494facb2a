from states.localization.frames.frames import (
    FramesEstimator as FramesEstimator,
)
from states.localization.frames.transforms import (
    NoTransform as NoTransform,
    TransformBuffer as TransformBuffer,
)
