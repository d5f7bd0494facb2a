from hw.ipc.datagrams import (
    LOOPBACK as LOOPBACK,
    Address as Address,
    Datagram as Datagram,
    Door as Door,
    Hearer as Hearer,
    Intake as Intake,
    Outlet as Outlet,
    Reader as Reader,
    Seal as Seal,
    coded as coded,
    is_loopback as is_loopback,
    key_of as key_of,
    received as received,
)
from hw.ipc.near import (
    keep_near as keep_near,
)
from hw.ipc.priority import (
    ARM as ARM,
    CHAIN as CHAIN,
    DEVICES as DEVICES,
    ENGINE as ENGINE,
    SENSES as SENSES,
    hurrying as hurrying,
    permitted as permitted,
)
from hw.ipc.processes import (
    AGAIN as AGAIN,
    Child as Child,
    Parent as Parent,
    Ready as Ready,
    serve as serve,
)
