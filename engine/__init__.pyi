from engine.clock import (
    TickGrid as TickGrid,
)
from engine.files.declared.values import Range as Range
from engine.files.units import (
    Acceleration as Acceleration,
    Angle as Angle,
    AngularSpeed as AngularSpeed,
    Duration as Duration,
    Force as Force,
    Length as Length,
    Mass as Mass,
    Ratio as Ratio,
    Speed as Speed,
)
from engine.flexbe import (
    UserData as UserData,
)
from engine.interfaces import (
    Argument as Argument,
    Interface as Interface,
    NoOutcome as NoOutcome,
    interface as interface,
    python_name as python_name,
    resolved as resolved,
)
from engine.literals import (
    Constant as Constant,
    ConstantMismatch as ConstantMismatch,
    OpenName as OpenName,
    constants_in as constants_in,
    convert as convert,
    description_of as description_of,
    fields_of as fields_of,
)
from engine.reports import (
    FORMATS as FORMATS,
    as_json as as_json,
    report as report,
    text as text,
)
from engine.signals.signal_kinds import (
    Derived as Derived,
    Estimated as Estimated,
    Estimator as Estimator,
    Measured as Measured,
)
from engine.state import (
    NEVER_NS as NEVER_NS,
    Action as Action,
    Context as Context,
    Monitor as Monitor,
    On as On,
    Outcome as Outcome,
    Run as Run,
    RunNews as RunNews,
    Stamped as Stamped,
    State as State,
    Until as Until,
    Yielded as Yielded,
)
from engine.state_class import (
    RESERVED_OUTCOMES as RESERVED_OUTCOMES,
    StateError as StateError,
)
from engine.state_code import (
    doubts_in_code as doubts_in_code,
    mistakes_in_code as mistakes_in_code,
)
from engine.state_text import (
    docstring_parts as docstring_parts,
)
from engine.types import (
    ANY as ANY,
    Key as Key,
    Type as Type,
    builtin_types as builtin_types,
    freeze as freeze,
    from_annotation as from_annotation,
    known_types as known_types,
)
