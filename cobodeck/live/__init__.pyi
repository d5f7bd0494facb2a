from cobodeck.live.access import (
    PageAddress as PageAddress,
)
from cobodeck.live.session import (
    LivePage as LivePage,
)
