from states.localization.matching.amcl import (
    Amcl as Amcl,
    AmclValues as AmclValues,
)
from states.localization.matching.correlative import (
    ALIKE as ALIKE,
    Window as Window,
    correlated as correlated,
)
from states.localization.matching.localizer_values import (
    LocalizerValues as LocalizerValues,
)
from states.localization.matching.map_search import (
    Search as Search,
)
from states.localization.matching.match_health import (
    WORSE as WORSE,
    LocalizerMode as LocalizerMode,
    MatchHealth as MatchHealth,
)
from states.localization.matching.particles import (
    log_likelihoods as log_likelihoods,
    weigh as weigh,
)
from states.localization.matching.pose_matcher import (
    AROUND as AROUND,
    LEAP as LEAP,
    PoseMatcher as PoseMatcher,
    Prediction as Prediction,
    is_near as is_near,
    is_same as is_same,
    is_sure as is_sure,
    leaps as leaps,
)
from states.localization.matching.scan_tracker import (
    Match as Match,
    TrackerValues as TrackerValues,
    match as match,
    rotated as rotated,
)
from states.localization.matching.scans import (
    Cloud as Cloud,
    cloud_of as cloud_of,
    middle_ns as middle_ns,
    span_ns as span_ns,
)
