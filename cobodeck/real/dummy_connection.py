"""The dummy stage: a connection with a recorded person, and nobody in the room (R56)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from cobodeck.real.open_connection import signals_of
from hw.connection import REFERS, Connection, ServedPart
from hw.people.walking import Person

OF_PERSON = frozenset(("user.pose", "vr.haptic_request", "vr.release", "vr.restart"))
"""The signals that only the dummy gives in this stage."""
LINK = "dummy"


def with_dummy(connection: Connection, person: Person) -> Connection:
    """The connection with this person; all other parts that report a person are left out.

    A link that such a part shares with others, like the VR application's with trackers on the
    robot, goes on reporting the others to the safety chain; the dummy filters out people.

    Raises:
        Problem: a driver cannot be found.
    """
    given = {name: signals_of(name, served) for name, served in connection.parts.items()}
    left_out = {name for name, signals in given.items() if OF_PERSON & set(signals or ())}
    parts = {name: one for name, one in connection.parts.items() if name not in left_out}
    parts |= {name: _served(kind, link=LINK) for name, kind in PARTS.items()}
    vr = {connection.parts[name].arguments.get("link") for name in left_out}
    entries = (*connection.links.values(), *connection.parts.values())
    chain = next((one for one in map(_tells, entries) if one in connection.links), None)
    told = {} if chain is None else {"tells": chain}
    links: dict[str, ServedPart] = {}
    for name, served in connection.links.items():
        if LINK not in links and (name in vr or _tells(served)):
            links[LINK] = _served("Dummy", person=person, **told)
        if name in vr and _tells(served):
            served = replace(served, arguments={**served.arguments, "tells": LINK})
        links[name] = served
    links.setdefault(LINK, _served("Dummy", person=person, **told))
    return replace(connection, parts=parts, links=links)


PARTS = {"trackers": "DummyTrackers", "vr": "DummyVr"}


def _tells(served: ServedPart) -> Any:
    return served.arguments.get(REFERS[1])


def _served(kind: str, **arguments: Any) -> ServedPart:
    return ServedPart("hw.drivers.dummy", kind, arguments, "the dummy")
