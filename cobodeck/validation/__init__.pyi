from cobodeck.validation.dead_ends import (
    OPEN as OPEN,
    Explored as Explored,
    dead_end_tests as dead_end_tests,
    explanation as explanation,
)
from cobodeck.validation.editor_schema import (
    declaration as declaration,
    declarations as declarations,
    schema_for as schema_for,
    schema_notes as schema_notes,
)
from cobodeck.validation.file_checks import (
    FileChecker as FileChecker,
)
