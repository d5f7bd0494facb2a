from hw.connection.connection import (
    REFERS as REFERS,
    Connection as Connection,
    HostedScene as HostedScene,
    Listening as Listening,
    Narrowed as Narrowed,
    RunInfo as RunInfo,
    ServedPart as ServedPart,
    connection_from as connection_from,
    connection_names as connection_names,
    load_connection as load_connection,
)
