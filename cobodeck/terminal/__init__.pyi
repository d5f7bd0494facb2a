from cobodeck.terminal.argument_types import (
    count as count,
    inputs as inputs,
    instant as instant,
    kept_file as kept_file,
    length as length,
    new_record as new_record,
    pose as pose,
    positive as positive,
    profile as profile,
    scan_mounts as scan_mounts,
    seconds as seconds,
    word as word,
)
from cobodeck.terminal.console import (
    FAILED as FAILED,
    OK as OK,
    REFUSED as REFUSED,
    USAGE as USAGE,
    Problem as Problem,
    ProgressLine as ProgressLine,
    complain as complain,
    show as show,
    show_json as show_json,
    show_what_can_be_shown as show_what_can_be_shown,
    table as table,
    terminal_width as terminal_width,
)
from cobodeck.terminal.record_names import (
    ENDING as ENDING,
    PART as PART,
    behind_record as behind_record,
    is_record as is_record,
)
