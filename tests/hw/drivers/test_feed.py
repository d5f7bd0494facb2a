"""A feed: silence is what it has not heard while it listened."""

import threading
import time

from hw.drivers.feed import DatagramFeed
from hw.ipc.datagrams import Outlet
from tests.waiting import PATIENCE_S, until

WITHIN_NS = 300_000_000


def test_who_sends_nothing_is_silent_until_heard_again_and_not_while_we_were_held_up():
    taken, held = [], threading.Event()

    def take(datagram, stamp_ns):
        taken.append(datagram.name)
        if datagram.name == "hold":
            held.wait(PATIENCE_S)

    feed = DatagramFeed("vr", time.monotonic_ns, take, look_s=0.01)
    outlet = Outlet([feed.door])
    silence = lambda: feed.silence(WITHIN_NS, "the VR server")  # noqa: E731
    assert silence() is None
    feed.start()
    until(silence)
    assert silence() == "the VR server is silent"
    outlet.send("here", 0)
    until(lambda: silence() is None)
    outlet.send("hold", 0)
    until(lambda: "hold" in taken)
    before = time.monotonic_ns()
    until(lambda: time.monotonic_ns() - before > 2 * WITHIN_NS)
    assert silence() is None
    held.set()
    feed.close()
    outlet.close()
