from engine.files import (
    source as source,
)
from engine.files.assignments import (
    ANYWHERE as ANYWHERE,
    assignment as assignment,
    written_text as written_text,
)
from engine.files.codec import (
    Write as Write,
    Writers as Writers,
    decoded as decoded,
    fields_of as fields_of,
    quoted as quoted,
)
from engine.files.finding import (
    CODE as CODE,
    FileError as FileError,
    Finding as Finding,
    NotFound as NotFound,
    Place as Place,
    Severity as Severity,
    did_you_mean as did_you_mean,
    in_order as in_order,
    mistake as mistake,
    not_found as not_found,
)
from engine.files.source import (
    MAX_BYTES as MAX_BYTES,
    Map as Map,
    Mark as Mark,
    Seq as Seq,
    SourceFile as SourceFile,
    plain as plain,
    read as read,
    read_file as read_file,
)
from engine.files.suggestions import (
    all_near as all_near,
    help_with_name as help_with_name,
    nearest as nearest,
    plain_word as plain_word,
)
from engine.files.text import (
    instead as instead,
    is_file as is_file,
    note as note,
    noted as noted,
    noting as noting,
    read_bytes as read_bytes,
    read_text as read_text,
    unreadable as unreadable,
)
from engine.files.units import (
    DIMENSIONS as DIMENSIONS,
    UNITS as UNITS,
    Acceleration as Acceleration,
    Angle as Angle,
    AngularAcceleration as AngularAcceleration,
    AngularJerk as AngularJerk,
    AngularSpeed as AngularSpeed,
    Dimension as Dimension,
    Duration as Duration,
    Force as Force,
    Length as Length,
    Mass as Mass,
    Momentum as Momentum,
    Power as Power,
    Ratio as Ratio,
    Speed as Speed,
    Torque as Torque,
    quantity as quantity,
    quantity_text as quantity_text,
    si_unit as si_unit,
)
from engine.files.visible_text import (
    escaped as escaped,
    visible as visible,
)
