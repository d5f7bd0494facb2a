from cobodeck.setup.chart_inputs import (
    read_inputs as read_inputs,
    wanted_inputs as wanted_inputs,
)
from cobodeck.setup.compiled_code import (
    described as described,
    keep_compiled_code as keep_compiled_code,
)
from cobodeck.setup.defaults import PROFILE as PROFILE, SCENE as SCENE, TICK_HZ as TICK_HZ
from cobodeck.setup.open_scene import (
    RunPlace as RunPlace,
    environment_at as environment_at,
    is_map as is_map,
    open_place as open_place,
)
from cobodeck.setup.options import (
    FULL as FULL,
    REFERENCE as REFERENCE,
    Options as Options,
    longest_s as longest_s,
)
from cobodeck.setup.other_policy import (
    of_other_policy as of_other_policy,
)
from cobodeck.setup.run_profile import (
    profile_with as profile_with,
    with_values as with_values,
)
from cobodeck.setup.setup import (
    Setup as Setup,
    Uses as Uses,
    open_setup as open_setup,
    reachable as reachable,
)
from cobodeck.setup.warmup import (
    warm_up as warm_up,
)
