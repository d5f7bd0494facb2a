from cobodeck.live.access import (
    PageAddress as PageAddress,
    Rules as Rules,
)
from cobodeck.live.clients import (
    Message as Message,
    Page as Page,
    Pages as Pages,
    Source as Source,
)
from cobodeck.live.session import (
    LivePage as LivePage,
    show_record as show_record,
    show_source as show_source,
)
