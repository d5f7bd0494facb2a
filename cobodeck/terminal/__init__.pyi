from cobodeck.terminal.argument_types import (
    count as count,
    inputs as inputs,
    instant as instant,
    kept_file as kept_file,
    length as length,
    live as live,
    new_record as new_record,
    port as port,
    pose as pose,
    positive as positive,
    profile as profile,
    scan_mounts as scan_mounts,
    seconds as seconds,
    shadow as shadow,
    word as word,
)
from cobodeck.terminal.command_parser import (
    CommandParser as CommandParser,
    WrongArguments as WrongArguments,
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
    show_what_can_be_shown as show_what_can_be_shown,
    table as table,
    terminal_width as terminal_width,
)
from cobodeck.terminal.json_answer import (
    answering as answering,
    json_options as json_options,
    show_failure as show_failure,
    show_json as show_json,
)
from cobodeck.terminal.record_names import (
    ENDING as ENDING,
    PART as PART,
    behind_record as behind_record,
    is_record as is_record,
)
from cobodeck.terminal.tracebacks import (
    place_of as place_of,
    show_traceback as show_traceback,
    traced as traced,
)
