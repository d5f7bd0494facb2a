from hw.connection.connection import (
    OFFERED as OFFERED,
    OWN_HOST as OWN_HOST,
    REFERS as REFERS,
    Connection as Connection,
    ConnectionFile as ConnectionFile,
    HostedScene as HostedScene,
    Narrowed as Narrowed,
    RunInfo as RunInfo,
    ServedPart as ServedPart,
    connection_from as connection_from,
    connection_names as connection_names,
    load_connection as load_connection,
)
from hw.connection.driver_names import (
    our_drivers as our_drivers,
)
from hw.connection.wired_topics import (
    HeardWire as HeardWire,
    SentWire as SentWire,
    WiredTopics as WiredTopics,
)
