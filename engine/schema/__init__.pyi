from engine.schema.document import (
    schema_text as schema_text,
)
