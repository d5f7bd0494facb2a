from hw.people.recorded.from_run_record import (
    Asked as Asked,
    Past as Past,
    Recalled as Recalled,
    SeenPerson as SeenPerson,
    Stood as Stood,
)
from hw.people.recorded.recorded_walk import (
    Playback as Playback,
)
from hw.people.recorded.walk_file import (
    Heading as Heading,
    Recording as Recording,
    Up as Up,
    read_recording as read_recording,
)
