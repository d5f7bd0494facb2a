from cobodeck.flexbe.behaviour import (
    Behaviour as Behaviour,
)
from cobodeck.flexbe.converting.conversion import (
    Conversion as Conversion,
    convert as convert,
)
from cobodeck.flexbe.converting.told import (
    Left as Left,
)
from cobodeck.flexbe.names import (
    identifier as identifier,
    outcome_name as outcome_name,
    unique as unique,
)
from cobodeck.flexbe.reading.found_files import (
    found_in as found_in,
)
from cobodeck.flexbe.reading.json_reading import (
    read_json as read_json,
)
from cobodeck.flexbe.reading.python_reading import (
    read_python as read_python,
)
from cobodeck.flexbe.writing.chart_text import (
    yaml_of as yaml_of,
)
from cobodeck.flexbe.writing.project_files import (
    files_of_project as files_of_project,
    summary as summary,
)
