from cobodeck.flexbe.reading.found_files import (
    FoundBehaviours as FoundBehaviours,
    found_in as found_in,
)
from cobodeck.flexbe.reading.json_reading import (
    is_neutral as is_neutral,
    read_json as read_json,
)
from cobodeck.flexbe.reading.python_reading import (
    is_behaviour as is_behaviour,
    read_python as read_python,
)
