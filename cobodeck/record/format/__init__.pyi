from cobodeck.record.format import (
    schemas as schemas,
)
from cobodeck.record.format.chunks import (
    records_of as records_of,
)
from cobodeck.record.format.class_names import (
    Unknown as Unknown,
)
from cobodeck.record.format.file_names import (
    FOLDER as FOLDER,
    default_name as default_name,
)
from cobodeck.record.format.messages import (
    TruthWriter as TruthWriter,
    arguments_text as arguments_text,
    call_text as call_text,
    charts_again as charts_again,
    command_again as command_again,
    command_text as command_text,
    cycle_again as cycle_again,
    cycle_text as cycle_text,
    failure_text as failure_text,
    log_text as log_text,
    raised_again as raised_again,
    trace_line as trace_line,
    trace_record as trace_record,
    truth_again as truth_again,
)
from cobodeck.record.format.record_header import (
    FORMAT as FORMAT,
    ROOT as ROOT,
    attachments as attachments,
    changes as changes,
    code as code,
    header as header,
    header_of_replay as header_of_replay,
    header_of_setup as header_of_setup,
    label as label,
    machine as machine,
    read_files as read_files,
    sha256 as sha256,
    versions as versions,
)
from cobodeck.record.format.sample_messages import (
    TOPIC as TOPIC,
    SampleReader as SampleReader,
    SampleWriter as SampleWriter,
    sample_of as sample_of,
    schema_of as schema_of,
)
from cobodeck.record.format.scan_messages import (
    LASER as LASER,
    scanner_of as scanner_of,
)
from cobodeck.record.format.schemas import (
    MessageSchema as MessageSchema,
)
from cobodeck.record.format.seal import (
    damage as damage,
    has_end as has_end,
)
from cobodeck.record.format.shape import (
    misfit as misfit,
)
from cobodeck.record.format.sink import (
    Sink as Sink,
    Taken as Taken,
    open_free as open_free,
    require_free as require_free,
)
from cobodeck.record.format.value_codec import (
    text as text,
    today as today,
    value as value,
)
