from cobodeck.real.connected import (
    Connected as Connected,
    connect as connect,
)
from cobodeck.real.dummy_connection import (
    with_dummy as with_dummy,
)
from cobodeck.real.open_connection import (
    finds_itself as finds_itself,
    is_needed as is_needed,
    refuse_strange_drivers as refuse_strange_drivers,
)
from cobodeck.real.preflight_checks import (
    NEVER as NEVER,
    hindered as hindered,
    observers as observers,
    preflight as preflight,
)
from cobodeck.real.prior_runs import (
    refuse_untried as refuse_untried,
)
from cobodeck.real.release_stages import (
    WORDS as WORDS,
)
