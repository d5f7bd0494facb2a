from cobodeck.flexbe.behaviour import (
    Behaviour as Behaviour,
)
from cobodeck.flexbe.converting import (
    Conversion as Conversion,
    Left as Left,
    convert as convert,
)
from cobodeck.flexbe.names import (
    identifier as identifier,
    outcome_name as outcome_name,
    unique as unique,
)
from cobodeck.flexbe.reading import (
    FoundBehaviours as FoundBehaviours,
    found_in as found_in,
    read_json as read_json,
    read_python as read_python,
)
from cobodeck.flexbe.writing import (
    files_of_project as files_of_project,
    summary as summary,
    yaml_of as yaml_of,
)
