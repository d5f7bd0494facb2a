from states.localization.filter.fusion import (
    GYRO_NOISE as GYRO_NOISE,
    POSE as POSE,
    UNKNOWN as UNKNOWN,
    Fusion as Fusion,
    covariance_of as covariance_of,
    inverse as inverse,
    sigma_of as sigma_of,
)
from states.localization.filter.measurement_sources import (
    FilterConfig as FilterConfig,
    Measurement as Measurement,
    MeasurementSource as MeasurementSource,
    ProcessNoise as ProcessNoise,
)
from states.localization.filter.planar import (
    SLIPPING as SLIPPING,
    PlanarFilter as PlanarFilter,
    planar_config as planar_config,
)
from states.localization.filter.spatial import (
    AXES as AXES,
    SpatialFilter as SpatialFilter,
    without_gravity as without_gravity,
)
