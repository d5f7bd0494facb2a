from cobodeck.project.chart_files import (
    behaviour_of as behaviour_of,
    chart_file as chart_file,
    chart_names as chart_names,
    names_of_charts as names_of_charts,
    nodes_of as nodes_of,
)
from cobodeck.project.library import (
    errors_in_used as errors_in_used,
    errors_in_users as errors_in_users,
    files_in as files_in,
    findings_of as findings_of,
    load_beside as load_beside,
    misfits as misfits,
    open_chart as open_chart,
    reached as reached,
    read_source as read_source,
    replacements as replacements,
    strictly as strictly,
    yaml_files as yaml_files,
)
from cobodeck.project.named_files import (
    KINDS as KINDS,
    kind_of as kind_of,
    name_in as name_in,
    own_files_around as own_files_around,
)
from cobodeck.project.names_in_values import (
    PLACE as PLACE,
    known_names as known_names,
    known_places as known_places,
)
from cobodeck.project.part_check import (
    error_text as error_text,
    made as made,
    why_no_part as why_no_part,
    wrong_parts as wrong_parts,
)
from cobodeck.project.project import (
    is_there as is_there,
)
from cobodeck.project.state_catalogue import (
    CHARTS as CHARTS,
    Catalogue as Catalogue,
    catalogue as catalogue,
    shipped_charts as shipped_charts,
)
from cobodeck.project.unimported import (
    arguments_of as arguments_of,
    names_in as names_in,
)
