from cobodeck.flexbe.writing.chart_text import (
    yaml_of as yaml_of,
)
from cobodeck.flexbe.writing.project_files import (
    files_of_project as files_of_project,
    summary as summary,
)
