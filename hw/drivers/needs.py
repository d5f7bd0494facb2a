"""What a driver class says of itself, before anything of it is opened.

    class Arm:
        needs = ("vendor_arm",)             # modules that it imports when it is opened

        @staticmethod
        def listens(port, **_):          # the ports of this machine that it opens
            return [Listening("tcp", "0.0.0.0", port, "whoever has the password")]

        @staticmethod
        def probe(host, **_):            # asks the device who it is; OSError: it does not answer
            return f"{host} says that it is {version(host)}"

        @staticmethod
        def observed(port, **_):         # where somebody has to watch its runs, if anybody
            return Observed("127.0.0.1", port + 1)

Each may be left out. The methods take the arguments of its entry in a connection file, and move
nothing. `cobodeck doctor --robot` and `cobodeck run` ask for them (`cobodeck/fitness`).
"""

from __future__ import annotations

from typing import Literal, NamedTuple


class Listening(NamedTuple):
    """A port of this machine: `tcp` or `udp`, its address, and whom its driver believes there.

    `open`: anybody who reaches it.
    """

    kind: Literal["tcp", "udp"]
    host: str
    port: int
    believes: str = ""
    open: bool = False


class Observed(NamedTuple):
    """The address at which an observer has to be heard.

    `key` is the file of its key, None if none is named: then the user's own, near this machine.
    """

    host: str
    port: int
    key: str | None = None
