from cobodeck.flexbe.reading.found_files import (
    found_in as found_in,
)
from cobodeck.flexbe.reading.json_reading import (
    read_json as read_json,
)
from cobodeck.flexbe.reading.python_reading import (
    read_python as read_python,
)
