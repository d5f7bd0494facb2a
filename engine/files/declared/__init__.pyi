from engine.files.declared.item import (
    Fault as Fault,
    Item as Item,
    find_file as find_file,
    gather as gather,
    is_path as is_path,
    load_yaml as load_yaml,
    notes as notes,
)
from engine.files.declared.merge import (
    merged as merged,
    single as single,
)
from engine.files.declared.named import (
    YAML as YAML,
    OwnFiles as OwnFiles,
    known_files as known_files,
    no_files as no_files,
    own_files as own_files,
    with_own_files as with_own_files,
)
from engine.files.declared.records import (
    FileKey as FileKey,
    Name as Name,
    Written as Written,
    fields_of as fields_of,
    reader_of as reader_of,
    record as record,
    split as split,
)
from engine.files.declared.schema import (
    DRAFT as DRAFT,
    Schema as Schema,
    bounds as bounds,
    document as document,
    either_of as either_of,
    meanings_of as meanings_of,
    quantity_pattern as quantity_pattern,
    said as said,
    text_of as text_of,
    written_default as written_default,
)
from engine.files.declared.values import (
    ABOVE_0 as ABOVE_0,
    FROM_0 as FROM_0,
    NAME as NAME,
    Count as Count,
    Mismatch as Mismatch,
    Range as Range,
    above_0 as above_0,
    boolean as boolean,
    choice as choice,
    example as example,
    is_name as is_name,
    number as number,
    shown as shown,
    text as text,
    whole as whole,
    with_article as with_article,
)
