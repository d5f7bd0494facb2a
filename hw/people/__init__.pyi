from hw.people.live import (
    LivePerson as LivePerson,
)
from hw.people.user import (
    is_recording as is_recording,
    open_user as open_user,
    with_manner as with_manner,
)
