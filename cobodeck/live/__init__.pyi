from cobodeck.live.access import (
    PageAddress as PageAddress,
)
from cobodeck.live.clients import (
    Source as Source,
)
from cobodeck.live.session import (
    LivePage as LivePage,
    show_source as show_source,
)
from cobodeck.live.terminal_session import (
    FarLink as FarLink,
    NearLink as NearLink,
    socket_url as socket_url,
    watch_in_terminal as watch_in_terminal,
)
